"""Environment light on a BTF: a few Gaussians fixed in the surface's frame, and a cosine.

Mueller, Meseth and Klein 2004 (eq. 2) integrate eigen-BRDFs against light in spherical harmonics; here each view of
each component is a vector in a balanced light basis (`light_basis`), and texels are weighted sums of components as
before. Rotating the light or changing its spectrum costs look-ups or a fold, and no fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..core.terms import TermShader
from .corners import by_cluster, levels_at, listed_levels
from .fixed_lobes import StandingForm
from .light_basis import LightBasis, LightFunctions, balanced_lights, light_functions
from .texels import BtfTexels, directions_listed, folded, in_fours, steps_of_corners

# Rows that the basis is balanced on.
_ROWS = 6000


@dataclass(frozen=True, eq=False)
class BtfGathering(StandingForm):
    """Environment form of local PCA; the clusters of the four texels around a point are evaluated first, then mixed."""

    texels: BtfTexels

    @cached_property
    def functions(self) -> LightFunctions:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Functions that represent the measured lights."""
        return light_functions(self.texels.form.lights)

    @cached_property
    def basis(self) -> LightBasis:
        """Light basis balanced for the means and components of the clusters, scaled as they occur in texels."""
        table = self.texels.table
        size = np.sqrt(np.mean(np.square(self.texels.weights), axis=0))
        rows = (table * size[:, None]).transpose(0, 1, 3, 4, 2)[:, :, :2].reshape(-1, table.shape[2])
        some = rows[:: max(1, len(rows) // _ROWS)].astype(np.float64)
        return balanced_lights(some, self.texels.form.lights)

    @cached_property
    def analysis(self) -> Float[np.ndarray, "Lt B"]:
        """Weight of each measured light in each term."""
        return self.basis.analysis

    @cached_property
    def table(self) -> Float[np.ndarray, "k V c1 B J"]:
        """Means and components of every view in the light basis."""
        return self._in_basis(self.texels.table)

    @cached_property
    def _coarser(self) -> list[Float[np.ndarray, "k V c1 B J"]]:
        return [self._in_basis(level.table) for level in self.texels.form.coarser()]

    def _in_basis(self, table: Float[np.ndarray, "k V Lt c1 J"]) -> Float[np.ndarray, "k V c1 B J"]:
        found = np.einsum("kvlcj,lb->kvcbj", table, self.analysis, optimize=True)
        return np.ascontiguousarray(found, dtype=np.float32)

    @cached_property
    def lights(self) -> Float[np.ndarray, "B F"]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Weights of functions in each term of the light basis."""
        return self.basis.synthesis.T @ self.functions.hats

    def terms(
        self,
        uv: Float[np.ndarray, "N 2"],
        wo: Float[np.ndarray, "N 3"],
        footprint: Float[np.ndarray, "N 2 2"] | None = None,
    ) -> Float[np.ndarray, "N B J"]:
        """Implement `StandingForm.terms`."""
        form = self.texels.form
        view, of_view = form.views.shares(wo)
        views, components, terms, size = self.table.shape[1:]
        total = np.zeros((len(uv), terms, size))
        for number, points, share in levels_at(footprint, self.texels.size, len(uv)):
            table = self.table if number == 0 else self._coarser[number - 1]
            rows = table.reshape(-1, components, terms * size)
            for here, cluster, weights in by_cluster(self.texels.level(number), uv[points]):
                at = points[here]
                for side in range(3):
                    found = weights[:, None] @ rows.take(cluster * views + view[at, side], axis=0)
                    counted = (share[here] * of_view[at, side])[:, None, None]
                    total[at] += counted * found.reshape(-1, terms, size)
        return total

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `lobes`."""
        tables = [self.table, *(self._coarser if filtered else ())]
        rows = [table / self.texels.tallest(number)[:, None, :, None, None] for number, table in enumerate(tables)]
        # Half precision holds numbers of size 1 best; the lights take the rest of the scale.
        largest = float(np.abs(rows[0]).max(initial=0.0)) or 1.0
        textures = {
            "components": folded(np.concatenate([in_fours(some / largest) for some in rows])),
            "texels": self.texels.packed(filtered),
            "views": directions_listed(self.texels.form.views),
            **self.standing_textures(largest),
        }
        views = self.texels.form.views
        sizes = {"FOURS": -(-self.palette.rank // 4), "CELLS": views.cells.shape[0], "VIEWS": len(views)}
        sizes |= {"VIEW_CELLS": views.cells.shape[2], "COMPONENTS": self.table.shape[2], "TERMS": len(self.lights)}
        places, uniforms = listed_levels([level.number.shape for level in self.texels.levels(filtered)])
        a_cluster = sizes["COMPONENTS"] * (4 + 3 * sizes["TERMS"] * sizes["FOURS"])
        of_lights = self.lights.size * sizes["FOURS"]
        steps = steps_of_corners(sizes["COMPONENTS"], a_cluster, filtered) + of_lights
        return TermShader(Path(__file__).with_suffix(".glsl"), sizes | places, textures, uniforms, steps)
