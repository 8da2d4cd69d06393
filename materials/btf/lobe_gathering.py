"""Environment light on a lobe field: one look-up per lobe, as in Meseth, Mueller and Klein 2003.

Their section 5.2 rotates the lobes of a texel in three views into the environment's frame and looks each up in a map
prefiltered for its exponent. Here four texels surround a point, and a lobe is a Gaussian and a bent cosine
(`prefiltered`). Another environment, another spectrum or a rotation of the light costs only the look-ups.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ..core.environment_form import BENDS, EnvironmentForm, Lobes
from ..core.points import Points
from ..core.terms import TermShader
from .corners import around, levels_at
from .field_texels import FieldTexels
from .lobe_field import LobeField
from .prefiltered import Prefiltered, nearest_angle, prefiltered
from .texels import directions_listed

# Stored texels about a point, at one level: four texels in three views.
_AROUND = 12


@dataclass(frozen=True, eq=False)
class LobeGathering(EnvironmentForm):
    """Gaussians of the lobes of four texels in three views; the last, about the normal, is of the constant rho_d."""

    uses_uv: ClassVar[bool] = True
    bent = BENDS

    texels: FieldTexels

    def __post_init__(self) -> None:
        if not isinstance(self.texels.form, LobeField):
            found = type(self.texels.form).__name__
            raise InputError("texels that are no lobes", field="texels", found=found, expected="a LobeField")

    @property
    def field(self) -> LobeField:
        """Lobe field of the texels."""
        assert isinstance(self.texels.form, LobeField)
        return self.texels.form

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Palette of the texels."""
        return self.texels.palette

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Number of Gaussians per point without filtering."""
        return self._count(False)

    def _count(self, filtered: bool) -> int:
        """Count the Gaussians per point, at one level or, if `filtered`, two."""
        sets, lobes = self.field.axes.shape[3:5]
        return (2 if filtered else 1) * _AROUND * sets * lobes + 1

    @property
    def table(self) -> Prefiltered:
        """Table of prefiltered lobes for the measured lights."""
        return prefiltered(round(self.field.lights.lowest, 6))

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`; points with a footprint use two levels."""
        assert points.uv is not None
        spanned = None if points.spans is None else points.footprint
        count, rank, table, (sets, lobes) = len(points), self.palette.rank, self.table, self.field.axes.shape[3:5]
        every = self._count(spanned is not None)
        directions, sharpness = np.tile([0.0, 0.0, 1.0], (count, every, 1)), np.ones((count, every))
        value = np.zeros((count, every, rank))
        matt, even = np.zeros((count, BENDS, rank)), np.zeros((count, rank))
        first = np.zeros(count, dtype=np.int64)
        for number, at, counted in levels_at(spanned, self.texels.size, count):
            form = self.texels.level(number)
            assert isinstance(form, LobeField)
            for share, view, row, column in around(form, points.uv[at], points.wo[at]):
                axes, exponents, amplitudes = form.of(view, row, column)
                amplitudes = amplitudes * (counted * share)[:, None, None]
                even[at] += amplitudes[:, 0]
                exponent, angle = np.rint(2.0 * np.log2(exponents)).astype(np.int64) + 2, nearest_angle(axes)
                about, gaussian = table.axes(exponent, angle, axes), table.value[exponent, angle]
                cosines = table.matt(exponent, angle, axes)
                for one in range(sets):
                    mine = slice(0, rank) if sets == 1 else slice(one, one + 1)
                    here = at[:, None], first[at, None] + np.arange(lobes)
                    directions[here], sharpness[here] = about[:, one], table.sharpness[exponent, angle][:, one]
                    value[(*here, mine)] = gaussian[:, one, :, None] * amplitudes[:, 1:, mine]
                    matt[at, :, mine] += np.einsum("nkb,nkj->nbj", cosines[:, one], amplitudes[:, 1:, mine])
                    first[at] += lobes
        up, last = np.broadcast_to([0.0, 0.0, 1.0], (count, 3)), np.full(count, len(table.value) - 1)
        upright = np.zeros(count, dtype=np.int64)
        directions[:, -1], sharpness[:, -1] = up, table.sharpness[-1, 0]
        value[:, -1] = table.value[-1, 0] * even
        matt += table.matt(last, upright, up)[:, :, None] * even[:, None]
        return Lobes(directions, sharpness, value, np.pi * matt)

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `lobes`."""
        form = self.texels.form
        kind = form.gathering_shader(filtered)
        levels, uniforms = self.texels.places(filtered)
        sizes = {"FOURS": -(-self.palette.rank // 4), "LOBES": self._count("LEVELS" in levels)}
        sizes |= {"CELLS": form.views.cells.shape[0], "VIEW_CELLS": form.views.cells.shape[2], "VIEWS": len(form.views)}
        textures = {"views": directions_listed(form.views), "prefiltered": self.table.listed()}
        return TermShader(
            kind.file, {**kind.sizes, **sizes, **levels}, {**kind.textures, **textures}, {**kind.uniforms, **uniforms}
        )

    @property
    def key(self) -> tuple:
        """Key of the texels."""
        return self.texels.key
