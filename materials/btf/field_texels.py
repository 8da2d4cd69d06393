"""Summand of reflectance fields: interpolation among four texels, in three views each, under any light.

Fields are functions of the light (Meseth, Mueller and Klein 2003, section 5.1), so that nothing is interpolated between
measured lights. Below the lowest measured light f_r is clamped, as in the original.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.points import Points
from ..core.terms import Terms, TermShader
from .corners import around, levels_at, listed_levels
from .reflectance_field import ReflectanceField
from .texels import TexelSummand, directions_listed

# Points per block: one texel's numbers in a view are held of each.
_BLOCK = 1 << 13


@dataclass(frozen=True, eq=False)
class FieldTexels(TexelSummand):
    """Look-up of a reflectance field."""

    form: ReflectanceField

    @property
    def size(self) -> tuple[int, int]:
        """Texels down and across."""
        return self.form.height, self.form.width

    def level(self, number: int) -> ReflectanceField:
        """Return the field of a mip level; coarser ones are computed on first use, once for all bases."""
        return self.form if number == 0 else self.form.coarser()[number - 1]

    def places(self, filtered: bool) -> tuple[dict[str, int], dict[str, Any]]:
        """Describe the places of levels in the lists of texels; see `listed_levels`."""
        sizes = [(level.height, level.width) for level in self.form.levels(filtered)]
        return listed_levels(sizes, [height * width for height, width in sizes])

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`, averaged over the footprint of points that have one."""
        assert points.uv is not None
        value = np.zeros((len(points), self.palette.rank))
        scale = points.angles(self.frame).scale
        lit = np.flatnonzero(scale > 0.0)
        for start in range(0, len(lit), _BLOCK):
            some = lit[start : start + _BLOCK]
            light, falling = self.form.lights.held(points.wi[some])
            spanned = None if points.spans is None or points.footprint is None else points.footprint[some]
            for number, here, counted in levels_at(spanned, self.size, len(some)):
                at, form = some[here], self.level(number)
                for share, view, row, column in around(form, points.uv[at], points.wo[at]):
                    value[at] += (counted * share)[:, None] * form.at(view, row, column, light[here])
            value[some] *= (scale[some] * falling)[:, None]
        return Terms(value)

    def shader(self, filtered: bool = False) -> TermShader:
        """Implement `Summand.shader`."""
        kind, form = self.form.shader(filtered), self.form
        sizes = {"FOURS": -(-self.palette.rank // 4)}
        sizes |= {"CELLS": form.views.cells.shape[0], "VIEW_CELLS": form.views.cells.shape[2], "VIEWS": len(form.views)}
        lowest = form.lights.lowest
        levels, uniforms = self.places(filtered)
        uniforms |= {"steepest": (float(np.arccos(lowest)), lowest)}
        textures = {**kind.textures, "views": directions_listed(form.views)}
        return TermShader(kind.file, {**kind.sizes, **sizes, **levels}, textures, {**kind.uniforms, **uniforms})

    @property
    def key(self) -> tuple:
        """Identity of the field."""
        return "btf field", id(self.form)

    @property
    def nbytes(self) -> int:
        """Bytes of memory used for rendering."""
        return self.form.nbytes + self.palette.values.nbytes
