"""Environment light on a reflectance field.

Meseth, Mueller and Klein 2003 (section 5.2) look each lobe up in an environment prefiltered for its exponent. Here the
response of a texel in a view is a sum of a few functions of the light, the same for all texels, or its values under the
measured lights; both are approximated by fixed Gaussians (`fixed_lobes`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..core.terms import TermShader
from .corners import around, levels_at
from .field_texels import FieldTexels
from .fixed_lobes import StandingForm
from .light_basis import LightFunctions
from .texels import directions_listed


@dataclass(frozen=True, eq=False)
class FieldGathering(StandingForm):
    """Environment form of a reflectance field, interpolated among four texels in each of three views."""

    texels: FieldTexels

    @property
    def functions(self) -> LightFunctions:
        """Light functions of the field."""
        return self.texels.form.functions

    @property
    def lights(self) -> Float[np.ndarray, "B F"]:
        """Weights of the light functions in each term (`LightFunctions.hats`)."""
        return self.functions.hats

    def terms(
        self,
        uv: Float[np.ndarray, "N 2"],
        wo: Float[np.ndarray, "N 3"],
        footprint: Float[np.ndarray, "N 2 2"] | None = None,
    ) -> Float[np.ndarray, "N B J"]:
        """Implement `StandingForm.terms`."""
        total = np.zeros((len(uv), len(self.lights), self.palette.rank))
        for number, at, counted in levels_at(footprint, self.texels.size, len(uv)):
            form = self.texels.level(number)
            for share, view, row, column in around(form, uv[at], wo[at]):
                total[at] += (counted * share)[:, None, None] * form.gathered(view, row, column)
        return total

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `lobes`."""
        kind, form = self.texels.form.gathering_shader(filtered), self.texels.form
        sizes = {"FOURS": -(-self.palette.rank // 4), "TERMS": len(self.lights)}
        sizes |= {"CELLS": form.views.cells.shape[0], "VIEW_CELLS": form.views.cells.shape[2], "VIEWS": len(form.views)}
        textures = {**kind.textures, **self.standing_textures(), "views": directions_listed(form.views)}
        levels, uniforms = self.texels.places(filtered)
        return TermShader(kind.file, {**kind.sizes, **sizes, **levels}, textures, {**kind.uniforms, **uniforms})
