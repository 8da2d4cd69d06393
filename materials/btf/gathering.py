"""How a BTF gathers light from all around: a few Gaussians that stand still in the surface's frame, and a cosine.

Where the paper folds eigen-BRDFs with light in spherical harmonics (Mueller, Meseth and Klein 2004, eq. 2), each view
of each component is here a vector in a balanced light basis (`light_basis`); what a texel makes of it is a sum as
before. Turning the light, or another spectrum, costs look-ups or a fold, and no fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...spectral.palette import Palette
from ..svbrdf.texels import between
from ..term_shader import TermShader
from .light_basis import LightBasis, LightFunctions, balanced_lights, light_functions
from .standing import StandingForm
from .texels import BtfTexels, directions_listed, folded

# Rows that the basis is balanced on.
_ROWS = 6000


@dataclass(frozen=True, eq=False)
class BtfGathering(StandingForm):
    """What the texels of a BTF gather; the four about a point are worked out each for itself, and mixed then."""

    texels: BtfTexels

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texels'."""
        return self.texels.palette

    @cached_property
    def functions(self) -> LightFunctions:  # pyright: ignore[reportIncompatibleMethodOverride]
        """That stand for the measured lights."""
        return light_functions(self.texels.form.lights)

    @cached_property
    def basis(self) -> LightBasis:
        """Balanced for the clusters' means and components, each as large as it occurs."""
        table = self.texels.table
        size = np.sqrt(np.mean(np.square(self.texels.weights), axis=0))
        rows = (table * size[:, None]).transpose(0, 1, 3, 4, 2)[:, :, :2].reshape(-1, table.shape[2])
        some = rows[:: max(1, len(rows) // _ROWS)].astype(np.float64)
        return balanced_lights(some, self.texels.form.lights)

    @cached_property
    def table(self) -> Float[np.ndarray, "k V B c1 J"]:
        """Means and components of every view in the light basis."""
        found = np.einsum("kvlcj,lb->kvbcj", self.texels.table, self.basis.analysis, optimize=True)
        return np.ascontiguousarray(found, dtype=np.float32)

    @cached_property
    def lights(self) -> Float[np.ndarray, "B F"]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Of each term of the light basis what it takes of each function."""
        return self.basis.synthesis.T @ self.functions.hats

    def terms(self, uv: Float[np.ndarray, "N 2"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N B J"]:
        """What the texels at points have of each term of the light basis."""
        form = self.texels.form
        view, of_view = form.views.shares(wo)
        height, width = form.number.shape
        rows, columns, shares = between(uv, height, width)
        total = np.zeros((len(uv), self.table.shape[2], self.palette.rank))
        for texel in range(4):
            place = rows[:, texel] * width + columns[:, texel]
            cluster = form.number.ravel()[place].astype(np.int64)
            weights = self.texels.weights[place] * shares[:, texel, None].astype(np.float32)
            for side in range(3):
                found = np.einsum("nbcj,nc->nbj", self.table[cluster, view[:, side]], weights, optimize=True)
                total += of_view[:, side, None, None] * found
        return total

    def shader(self, filtered: bool = False) -> TermShader:
        """The twin of `lobes`."""
        looked_up = self.texels.shader(filtered)
        size, components = self.palette.rank, self.table.shape[3]
        tallest = self.texels.tallest
        fours = -(-size // 4)
        table = self.table / tallest[:, None]
        rows = table.transpose(0, 1, 3, 2, 4).reshape(-1, size)
        # What half precision holds best is of size 1; the lights take what is left.
        largest = float(np.abs(rows).max(initial=0.0)) or 1.0
        padded = np.zeros((len(rows), fours * 4), dtype=np.float16)
        padded[:, :size] = rows / largest
        textures = {
            "components": folded(padded.reshape(-1, 4)),
            "texels": looked_up.textures["texels"],
            "views": directions_listed(self.texels.form.views),
            **self.standing_textures(largest),
        }
        kept = {name: looked_up.sizes[name] for name in ("FOURS", "CELLS", "VIEWS", "VIEW_CELLS")}
        sizes = kept | {"COMPONENTS": components, "TERMS": len(self.lights)}
        return TermShader(Path(__file__).with_suffix(".glsl"), sizes, textures, looked_up.uniforms)

    @property
    def key(self) -> tuple:
        """The texels'."""
        return self.texels.key
