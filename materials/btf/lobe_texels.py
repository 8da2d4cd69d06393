"""The summand of lobe fields: four texels about a point, in three views each, under any light.

Lobes are functions of the light (Meseth, Mueller and Klein 2003, section 5.1): between measured lights nothing is
interpolated. Lower than any light that was measured f_r is held, as it is in the original.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float, Int

from ...spectral.errors import InputError
from ...spectral.palette import Palette
from ..axes import Frame
from ..fast import Summand
from ..points import Points
from ..svbrdf.texels import between
from ..term_shader import TermShader
from ..terms import Terms
from .coding import decoded_amplitudes, decoded_exponents
from .lobe_field import LobeField
from .texels import directions_listed, folded

# Points at once: twelve texels' numbers are held of each.
_BLOCK = 1 << 13


@dataclass(frozen=True, eq=False)
class LobeTexels(Summand):
    """Lobes, looked up: term j is coefficient j of the texels at a point, f_r cos(theta_i).

    palette : one entry of J spectra, 1 each where values are in 1/sr.

    Raises
    ------
    InputError : another palette.
    """

    uses_uv: ClassVar[bool] = True

    form: LobeField
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
    def lowest(self) -> float:
        """The smallest cosine of a light that was measured."""
        return float(self.form.lights.directions[:, 2].min())

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
        light, falling = self.measured(wi)
        total = np.zeros((len(uv), self.palette.rank))
        for share, view, row, column in self.around(uv, wo):
            total += share[:, None] * self.form.at(view, row, column, light)
        return total * falling[:, None]

    def measured(self, wi: Float[np.ndarray, "N 3"]) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
        """Directions no lower than what was measured, and what values fall by beyond."""
        low = wi[:, 2] < self.lowest
        level = np.linalg.norm(wi[:, :2], axis=1)
        inward = np.sqrt(max(0.0, 1.0 - self.lowest**2)) / np.where(low, level, 1.0)
        held = np.concatenate([wi[:, :2] * inward[:, None], np.full((len(wi), 1), self.lowest)], axis=1)
        return np.where(low[:, None], held, wi), np.where(low, wi[:, 2] / max(self.lowest, 1e-9), 1.0)

    def around(
        self, uv: Float[np.ndarray, "N 2"], wo: Float[np.ndarray, "N 3"]
    ) -> Iterator[tuple[Float[np.ndarray, " N"], Int[np.ndarray, " N"], Int[np.ndarray, " N"], Int[np.ndarray, " N"]]]:
        """Of each of four texels in three views about points: what it counts, the view, its row and column."""
        view, of_view = self.form.views.shares(wo)
        height, width = self.form.axes.shape[1:3]
        rows, columns, shares = between(uv, height, width)
        for texel in range(4):
            for side in range(3):
                yield of_view[:, side] * shares[:, texel], view[:, side], rows[:, texel], columns[:, texel]

    @cached_property
    def tallest(self) -> float:
        """The largest amplitude, 1/sr: what they are relative to on the GPU, so that half precision holds them."""
        return float(self.form.largest.max()) or 1.0

    def shader(self, filtered: bool = False) -> TermShader:
        """See `Summand.shader`; amplitudes are in half precision, relative to the largest of all."""
        height, width = self.form.axes.shape[1:3]
        textures = {"kept": self._listed(), "views": directions_listed(self.form.views)}
        steepest = float(np.arccos(np.clip(self.lowest, 0.0, 1.0)))
        uniforms = {"size": (width, height), "steepest": steepest, "tallest": self.tallest}
        sizes = {"KEPT_LOBES": self.form.lobes, "SETS": self.form.axes.shape[3], "FOURS": -(-self.palette.rank // 4)}
        sizes |= {"CELLS": self.form.views.cells.shape[0], "VIEW_CELLS": self.form.views.cells.shape[2]}
        return TermShader(Path(__file__).with_suffix(".glsl"), sizes, textures, uniforms)

    def _listed(self) -> np.ndarray:
        """Of each view and texel its lobes, codes of axis and exponent, and then its amplitudes; float16."""
        form = self.form
        views, height, width, sets, lobes = form.axes.shape[:5]
        texels, size = height * width, self.palette.rank
        quads = -(-size // 4)
        listed = np.zeros((views, texels, sets * lobes + (lobes + 1) * quads, 4), dtype=np.float16)
        for view in range(views):
            codes = listed[view, :, : sets * lobes].reshape(texels, sets, lobes, 4)
            codes[..., :2] = form.axes[view].reshape(texels, sets, lobes, 2)
            # The exponent's code, a whole number.
            exponents = decoded_exponents(form.exponents[view], lobes).reshape(texels, sets, lobes)
            codes[..., 2] = np.rint(2.0 * np.log2(exponents))
            listed[view, :, : sets * lobes] = codes.reshape(texels, -1, 4)
            shares = decoded_amplitudes(form.amplitudes[view], form.largest[view]) / self.tallest
            padded = np.zeros((texels, lobes + 1, 4 * quads), dtype=np.float16)
            padded[..., :size] = shares.reshape(texels, lobes + 1, size)
            listed[view, :, sets * lobes :] = padded.reshape(texels, -1, 4)
        return folded(listed.reshape(-1, 4))

    @property
    def key(self) -> tuple:
        """Which form it is."""
        return "lobes", id(self.form)

    @property
    def nbytes(self) -> int:
        """Of what is held to draw it."""
        kept = (self.form.axes, self.form.exponents, self.form.amplitudes, self.form.largest, self.palette.values)
        return sum(array.nbytes for array in kept)

    @property
    def grid(self) -> str:
        """Texels across and down, views and lobes."""
        height, width = self.form.axes.shape[1:3]
        return f"{width} x {height} texels, {len(self.form.views)} views of {self.form.lobes} lobes"
