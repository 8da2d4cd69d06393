"""Non-linear reflectance fields: a few cosine lobes of the light for each texel and view.

Meseth, Mueller and Klein 2003 (section 4.1): views are fitted one by one and interpolated when rendered, so that what
is hidden in one view need not be hidden in another. Their lobes have one colour and are fitted to luminance. Here each
has a spectrum of its own: axes and exponents are fitted to luminance, then the amplitudes of all coefficients by least
squares. With `shared=False` each coefficient has lobes of its own, at more bytes: red, green and blue if images are of
these, else the coefficients of a spectral basis. Images are registered.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int, Int8, UInt8

from ...runtime.errors import InputError
from ..core.terms import TermShader
from .images import BtfImages
from .lobe_amplitudes import Equations, summed, to_luminance, weights_of
from .lobe_mip_levels import LobesOfView, lobes_from_afar
from .lobes import fitted_lobes, lobe_values
from .quantisation import (
    coded_axes,
    coded_exponents,
    decoded_amplitudes,
    decoded_axes,
    decoded_exponents,
)
from .reflectance_field import ReflectanceField, registered_view
from .texels import folded

#: Lobes at most: eleven numbers and more for each are not a compact form any longer.
MOST_LOBES = 8
# Texels per block.
_BLOCK = 1 << 12


@dataclass(frozen=True, eq=False)
class LobeField(ReflectanceField):
    """H x W texels of V views, each rho + sum of k amplitudes times max(axis . l, 0)^exponent, stored in bytes.

    basis : of J coefficients. axes (V,H,W,G,k,2), exponents (V,H,W,G,k/2) : see `quantisation`; G is 1 if coefficients
    share their lobes, else J. amplitudes (V,H,W,k+1,J) : integers, rho first. largest (V,k+1,J) : their scale, 1/sr.
    """

    KIND: ClassVar[str] = "rfnl"
    ARRAYS: ClassVar[tuple[str, ...]] = ("axes", "exponents", "amplitudes", "largest")

    axes: UInt8[np.ndarray, "V H W G k 2"]
    exponents: UInt8[np.ndarray, "V H W G k2"]
    amplitudes: Int8[np.ndarray, "V H W k1 J"]
    largest: Float[np.ndarray, "V k1 J"]
    _decoded: dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=dict, init=False, repr=False)

    @property
    def height(self) -> int:
        """H."""
        return self.axes.shape[1]

    @property
    def width(self) -> int:
        """W."""
        return self.axes.shape[2]

    @property
    def lobes(self) -> int:
        """k."""
        return self.axes.shape[4]

    @property
    def bytes_per_texel(self) -> int:
        """Bytes over all views: two per axis, half of one per exponent, one per amplitude."""
        kept = (self.axes, self.exponents, self.amplitudes)
        return sum(array.nbytes for array in kept) // (self.height * self.width)

    def of_view(
        self, view: int
    ) -> tuple[Float[np.ndarray, "H W G k 3"], Float[np.ndarray, "H W G k"], Float[np.ndarray, "H W k1 J"]]:
        """Decode the axes, exponents and amplitudes, 1/sr, of a view; float32."""
        if view not in self._decoded:
            # Views come one after the other.
            self._decoded.clear()
            axes, exponents = decoded_axes(self.axes[view]), decoded_exponents(self.exponents[view], self.lobes)
            self._decoded[view] = axes, exponents, decoded_amplitudes(self.amplitudes[view], self.largest[view])
        return self._decoded[view]

    def of(
        self, view: Int[np.ndarray, " N"], row: Int[np.ndarray, " N"], column: Int[np.ndarray, " N"]
    ) -> tuple[Float[np.ndarray, "N G k 3"], Float[np.ndarray, "N G k"], Float[np.ndarray, "N k1 J"]]:
        """Decode the axes, exponents and amplitudes, 1/sr, of texels in views; float64."""
        axes = decoded_axes(self.axes[view, row, column]).astype(np.float64)
        exponents = decoded_exponents(self.exponents[view, row, column], self.lobes).astype(np.float64)
        return axes, exponents, decoded_amplitudes(self.amplitudes[view, row, column], self.largest[view])

    def at(
        self,
        view: Int[np.ndarray, " N"],
        row: Int[np.ndarray, " N"],
        column: Int[np.ndarray, " N"],
        light: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N J"]:
        """Implement `ReflectanceField.at`."""
        axes, exponents, amplitudes = self.of(view, row, column)
        cosine = np.maximum(np.einsum("ngkx,nx->ngk", axes, light, optimize=True), 0.0)
        return amplitudes[:, 0] + summed(cosine**exponents, amplitudes[:, 1:])

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Implement `ReflectanceField.reconstruct`; a view is decoded once for all its lights."""
        axes, exponents, amplitudes = self.of_view(view)
        values = lobe_values(axes, exponents, self.lights.directions[light, None])[..., 0]
        return amplitudes[..., 0, :] + summed(values, amplitudes[..., 1:, :])

    def coarser(self) -> tuple[LobeField, ...]:
        """Return the coarser levels, whose lobes are refitted (`lobe_mip_levels`); see `ReflectanceField.coarser`."""
        return self._coarser

    @cached_property
    def _coarser(self) -> tuple[LobeField, ...]:
        to_y, lights = to_luminance(self.basis), self.lights.directions
        views = [lobes_from_afar(*self.of_view(view), lights, to_y) for view in range(len(self.views))]
        return tuple(self._of_views(level) for level in zip(*views, strict=True))

    def _of_views(self, views: tuple[LobesOfView, ...]) -> LobeField:
        kept = [np.stack(part) for part in zip(*views, strict=True)]
        return LobeField(self.views, self.lights, self.basis, *kept)

    def shader(self, filtered: bool = False) -> TermShader:
        """Implement `ReflectanceField.shader`; amplitudes are in half precision, relative to the largest of all."""
        return self._shader("lobe_texels.glsl", filtered)

    def gathering_shader(self, filtered: bool = False) -> TermShader:
        """Make the shader that reads lobes for `lobe_gathering`."""
        return self._shader("lobe_gathering.glsl", filtered)

    def _shader(self, file: str, filtered: bool) -> TermShader:
        sizes = {"KEPT_LOBES": self.lobes, "SETS": self.axes.shape[3]}
        kept = self._filtered if filtered else self._listed
        return TermShader(Path(__file__).with_name(file), sizes, {"kept": kept}, {"tallest": self._tallest})

    @property
    def _tallest(self) -> float:
        return float(self.largest.max(initial=0.0)) or 1.0

    @cached_property
    def _listed(self) -> np.ndarray:
        return folded(self._rows(self._tallest))

    @cached_property
    def _filtered(self) -> np.ndarray:
        return folded(np.concatenate([level._rows(self._tallest) for level in (self, *self._coarser)]))

    def _rows(self, tallest: float) -> np.ndarray:
        """Lay out, for each view and texel, its lobes (codes of axis and exponent), then its amplitudes; float16."""
        sets, lobes = self.axes.shape[3:5]
        texels, size = self.height * self.width, self.basis.size
        quads = -(-size // 4)
        listed = np.zeros((len(self.views), texels, sets * lobes + (lobes + 1) * quads, 4), dtype=np.float16)
        for view, one in enumerate(listed):
            codes = np.zeros((texels, sets, lobes, 4), dtype=np.float16)
            codes[..., :2] = self.axes[view].reshape(texels, sets, lobes, 2)
            # Twice the binary logarithm, a whole number.
            exponents = decoded_exponents(self.exponents[view], lobes).reshape(texels, sets, lobes)
            codes[..., 2] = np.rint(2.0 * np.log2(exponents))
            one[:, : sets * lobes] = codes.reshape(texels, -1, 4)
            shares = decoded_amplitudes(self.amplitudes[view], self.largest[view]) / tallest
            padded = np.zeros((texels, lobes + 1, 4 * quads), dtype=np.float16)
            padded[..., :size] = shares.reshape(texels, lobes + 1, size)
            one[:, sets * lobes :] = padded.reshape(texels, -1, 4)
        return listed.reshape(-1, 4)


def lobe_field(
    images: BtfImages, lobes: int = 2, shared: bool = True, heard: Callable[[float], None] = lambda share: None
) -> LobeField:
    """Fit lobes to registered images, for each texel and view; `shared` by all coefficients or separate.

    heard : receives the fraction of the work done, from 0 to 1.

    Raises
    ------
    InputError : fewer than 1 or more than `MOST_LOBES` lobes; images that are not finite.
    """
    if not 1 <= lobes <= MOST_LOBES:
        expected = f"1 to {MOST_LOBES}"
        raise InputError("a number of lobes that there is not", field="lobes", found=lobes, expected=expected)
    to_y = to_luminance(images.basis)
    shape, size = (len(images.views), images.height, images.width), images.basis.size
    sets = 1 if shared else size
    axes = np.empty((*shape, sets, lobes, 2), dtype=np.uint8)
    exponents = np.empty((*shape, sets, -(-lobes // 2)), dtype=np.uint8)
    amplitudes = np.empty((*shape, lobes + 1, size), dtype=np.int8)
    largest = np.empty((len(images.views), lobes + 1, size))
    for view in range(len(images.views)):
        values = registered_view(images, view)
        texels = values.shape[1]
        flat = axes[view].reshape(texels, sets, lobes, 2), exponents[view].reshape(texels, sets, -1)
        equations = Equations(texels, lobes + 1, sets, size)
        for start in range(0, texels, _BLOCK):
            rows = slice(start, start + _BLOCK)
            some = np.ascontiguousarray(values[:, rows].transpose(1, 0, 2))
            luminance = some @ to_y
            weights = weights_of(luminance)
            for one in range(sets):
                mine = slice(0, size) if shared else slice(one, one + 1)
                fitted = luminance if shared else some[..., one]
                found = fitted_lobes(fitted, weights, images.lights.directions, lobes)
                order = np.argsort(-np.abs(found.amplitudes), axis=1, kind="stable")
                flat[0][rows, one] = coded_axes(np.take_along_axis(found.axes, order[..., None], axis=1))
                flat[1][rows, one] = coded_exponents(np.take_along_axis(found.exponents, order, axis=1))
                kept = decoded_axes(flat[0][rows, one]), decoded_exponents(flat[1][rows, one], lobes)
                equations.add(rows, one, lobe_values(*kept, images.lights.directions), weights, some[..., mine])
            heard((view + min(1.0, rows.stop / texels)) / len(images.views))
        largest[view], codes = equations.rounded()
        amplitudes[view] = codes.reshape(amplitudes.shape[1:])
    return LobeField(images.views, images.lights, images.basis, axes, exponents, amplitudes, largest)
