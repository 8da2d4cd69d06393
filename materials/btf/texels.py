"""The summand of BTFs: four texels about a point, in three views and under three lights each.

Weights of different clusters mean different things and are never mixed: texels are worked out first, and mixed then.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float, Int

from ...spectral.errors import InputError
from ...spectral.palette import Palette
from ..axes import Frame
from ..fast import MOST_TEXELS, Summand
from ..points import Points
from ..svbrdf.texels import between
from ..term_shader import TermShader
from ..terms import Terms
from .clustered_form import ClusteredForm
from .hemisphere import Hemisphere

# Points at once: nine pairs of directions of four texels' components are held of each.
_BLOCK = 1 << 11


@dataclass(frozen=True, eq=False)
class BtfTexels(Summand):
    """Local PCA, looked up: term j is coefficient j of the texels at a point, f_r cos(theta_i).

    palette : one entry of J spectra, 1 each where values are in 1/sr.
    """

    uses_uv: ClassVar[bool] = True

    form: ClusteredForm
    palette: Palette
    precision: Literal["single", "half"] = "single"
    frame: Frame = "io"

    def __post_init__(self) -> None:
        expected = (1, self.form.basis.size)
        if (self.palette.entries, self.palette.rank) != expected:
            words = f"one entry of {expected[1]} spectra"
            found = f"{self.palette.entries} of {self.palette.rank}"
            raise InputError("a palette that does not fit", field="palette", found=found, expected=words)

    @cached_property
    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """See `LocalPca.table`, with components for weights of whole numbers."""
        return self.form.table()

    @cached_property
    def weights(self) -> Float[np.ndarray, "T c1"]:
        """Of each texel in the order of rows, 1 and its weights; float32."""
        weights = self.form.weights.reshape(self.form.number.size, -1)
        return np.concatenate([np.ones((len(weights), 1), np.float32), weights.astype(np.float32)], axis=1)

    @cached_property
    def tallest(self) -> Float[np.ndarray, " c1"]:
        """What components are divided by and weights multiplied with on the GPU, so that half precision holds them."""
        tallest = np.abs(self.table).max(axis=(0, 1, 2, 4))
        return np.where(tallest > 0.0, tallest, 1.0).astype(np.float32)

    def terms(self, points: Points) -> Terms:
        """See `Summand.terms`."""
        assert points.uv is not None
        value = np.zeros((len(points), self.palette.rank))
        scale = points.angles(self.frame).scale
        lit = np.flatnonzero(scale > 0.0)
        for start in range(0, len(lit), _BLOCK):
            some = lit[start : start + _BLOCK]
            value[some] = self._at(points.uv[some], points.wi[some], points.wo[some]) * scale[some, None]
        return Terms(value)

    def _at(
        self, uv: Float[np.ndarray, "N 2"], wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]
    ) -> Float[np.ndarray, "N J"]:
        """Coefficients at points."""
        view, of_view = self.form.views.shares(wo)
        light, of_light = self.form.lights.shares(wi, falling=True)
        height, width = self.form.number.shape
        rows, columns, shares = between(uv, height, width)
        total = np.zeros((len(uv), self.palette.rank))
        for texel in range(4):
            place = rows[:, texel] * width + columns[:, texel]
            cluster = self.form.number.ravel()[place].astype(np.int64)
            found = self._between(cluster, view, of_view, light, of_light)
            total += shares[:, texel, None] * np.einsum("nc,ncj->nj", self.weights[place], found)
        return total

    def _between(
        self,
        cluster: Int[np.ndarray, " N"],
        view: Int[np.ndarray, "N 3"],
        of_view: Float[np.ndarray, "N 3"],
        light: Int[np.ndarray, "N 3"],
        of_light: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N c1 J"]:
        """Mean and components of clusters between three views and three lights."""
        found = np.zeros((len(cluster), *self.table.shape[3:]), dtype=np.float32)
        for a in range(3):
            for b in range(3):
                share = (of_view[:, a] * of_light[:, b]).astype(np.float32)
                found += share[:, None, None] * self.table[cluster, view[:, a], light[:, b]]
        return found

    def shader(self, filtered: bool = False) -> TermShader:
        """See `Summand.shader`; components are in half precision, relative to the largest of each."""
        table = self.table.reshape(-1, *self.table.shape[3:])
        components, size = table.shape[1:]
        quads = -(-size // 4)
        padded = np.zeros((len(table), components, quads * 4), dtype=np.float16)
        padded[..., :size] = table / self.tallest[:, None]
        textures = {
            "components": folded(padded.reshape(-1, 4)),
            "texels": self._packed(),
            "views": directions_listed(self.form.views),
            "lights": directions_listed(self.form.lights),
        }
        sizes = {"COMPONENTS": components, "FOURS": quads, "CELLS": self.form.views.cells.shape[0]}
        sizes |= {"VIEWS": len(self.form.views), "LIGHTS": len(self.form.lights)}
        sizes |= {"VIEW_CELLS": self.form.views.cells.shape[2], "LIGHT_CELLS": self.form.lights.cells.shape[2]}
        height, width = self.form.number.shape
        return TermShader(Path(__file__).with_suffix(".glsl"), sizes, textures, {"size": (width, height)})

    def _packed(self) -> np.ndarray:
        """Of each texel its cluster and its weights, four numbers to a texel of the GPU's, one beside the other."""
        height, width = self.form.number.shape
        numbers = self.weights * self.tallest
        numbers = np.concatenate([self.form.number.reshape(-1, 1).astype(np.float32), numbers], axis=1)
        quads = -(-numbers.shape[1] // 4)
        padded = np.zeros((len(numbers), quads * 4), dtype=np.float32)
        padded[:, : numbers.shape[1]] = numbers
        if width * quads > MOST_TEXELS or height > MOST_TEXELS:
            found, expected = f"{width * quads} x {height} texels", f"at most {MOST_TEXELS} each way"
            raise InputError("a BTF too large for the GPU", field="texels", found=found, expected=expected)
        return padded.reshape(height, width * quads, 4)

    @property
    def key(self) -> tuple:
        """Which form it is."""
        return "btf", id(self.form)

    @property
    def nbytes(self) -> int:
        """Of what is held to draw it."""
        return self.table.nbytes + self.form.weights.nbytes + self.form.number.nbytes + self.palette.values.nbytes

    @property
    def grid(self) -> str:
        """Texels across and down, views and lights."""
        height, width = self.form.number.shape
        return f"{width} x {height} texels, {len(self.form.views)} views x {len(self.form.lights)} lights"


def folded(rows: Float[np.ndarray, "n 4"]) -> np.ndarray:
    """A long list of texels as a picture of at most `MOST_TEXELS` each way, row by row.

    Raises
    ------
    InputError : it is longer.
    """
    height = -(-len(rows) // MOST_TEXELS)
    if height > MOST_TEXELS:
        found, expected = f"{len(rows)} numbers", f"at most {MOST_TEXELS**2}"
        raise InputError("a BTF too large for the GPU", field="components", found=found, expected=expected)
    width = min(len(rows), MOST_TEXELS)
    padded = np.zeros((height * width, 4), dtype=rows.dtype)
    padded[: len(rows)] = rows
    return padded.reshape(height, width, 4)


def directions_listed(hemisphere: Hemisphere) -> np.ndarray:
    """What `hemisphere.glsl` reads: first each triangle, two texels a corner, then each cell's triangles.

    Of a corner the row of `Hemisphere.inverse`, and 0; then which measured direction it stands for, its cosine, whether
    it is a held one, and 0.
    """
    corners = hemisphere.triangles
    triangles = np.zeros((len(corners), 3, 2, 4), dtype=np.float32)
    triangles[:, :, 0, :3] = hemisphere.inverse
    measured = hemisphere.measured[corners]
    triangles[:, :, 1, 0] = measured
    triangles[:, :, 1, 1] = hemisphere.directions[measured, 2]
    triangles[:, :, 1, 2] = corners >= len(hemisphere)
    cells = np.zeros((hemisphere.cells.size, 4), dtype=np.float32)
    cells[:, 0] = hemisphere.cells.ravel()
    head = np.zeros((1, 4), dtype=np.float32)
    head[0, 0] = len(corners)
    return folded(np.concatenate([head, triangles.reshape(-1, 4), cells]))
