"""Non-linear reflectance fields: each texel of each view a few lobes of the light.

Meseth, Mueller and Klein 2003 (section 4.1): views are fitted one by one, and mixed when they are looked at, so that
what a view hides from one side it need not hide from another. Their lobes have one colour and are found for luminance.
Here each has a spectrum of its own: axes and exponents are found for luminance, amplitudes of all coefficients then by
least squares. By `shared=False` each coefficient has lobes of its own, at more bytes: red, green and blue where images
are of these, else the coefficients of a spectral basis. Images are registered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float, Int, Int8, UInt8

from ...spectral.basis import SpectralBasis
from ...spectral.difference import lightness_slope
from ...spectral.errors import InputError
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..term_shader import TermShader
from .coding import (
    coded_amplitudes,
    coded_axes,
    coded_exponents,
    decoded_amplitudes,
    decoded_axes,
    decoded_exponents,
)
from .hemisphere import Hemisphere
from .images import BtfImages
from .lobes import fitted_lobes, lobe_values
from .reflectance_field import ReflectanceField, registered_view
from .side_by_side import solved
from .texels import folded

#: Lobes at most: eleven numbers and more for each are not a compact form any longer.
MOST_LOBES = 8
# What is missed is weighted by this power of dL*/dY: 1 would be lightness itself; below it, what is saturated and dark
# counts for less, since its error is in chroma as well.
_POWER = 0.75
# Of the mean of the diagonal, what each amplitude is held back by: lobes that are alike would else be large and differ.
_HELD = 1e-5
# Texels at once.
_BLOCK = 1 << 12


@dataclass(frozen=True, eq=False)
class LobeField(ReflectanceField):
    """H x W texels of V views, each rho + sum of k amplitudes times max(axis . l, 0)^exponent, kept in bytes.

    basis : of J coefficients. axes (V,H,W,G,k,2), exponents (V,H,W,G,k/2) : see `coding`; G is 1 where coefficients
    share their lobes, or J. amplitudes (V,H,W,k+1,J) : whole numbers, rho first. largest (V,k+1,J) : what they are
    relative to, 1/sr.
    """

    KIND: ClassVar[str] = "rfnl"

    views: Hemisphere
    lights: Hemisphere
    basis: SpectralBasis
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
    def nbytes(self) -> int:
        """Of all arrays."""
        return sum(array.nbytes for array in (self.axes, self.exponents, self.amplitudes, self.largest))

    @property
    def lobes(self) -> int:
        """k."""
        return self.axes.shape[4]

    @property
    def bytes_per_texel(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Of all views: two for each axis, half of one for each exponent, one for each amplitude."""
        kept = (self.axes, self.exponents, self.amplitudes)
        return sum(array.nbytes for array in kept) // (self.height * self.width)

    def of_view(
        self, view: int
    ) -> tuple[Float[np.ndarray, "H W G k 3"], Float[np.ndarray, "H W G k"], Float[np.ndarray, "H W k1 J"]]:
        """Axes, exponents and amplitudes, 1/sr, of a view; float32."""
        if view not in self._decoded:
            # Views come one after the other.
            self._decoded.clear()
            axes, exponents = decoded_axes(self.axes[view]), decoded_exponents(self.exponents[view], self.lobes)
            self._decoded[view] = axes, exponents, decoded_amplitudes(self.amplitudes[view], self.largest[view])
        return self._decoded[view]

    def of(
        self, view: Int[np.ndarray, " N"], row: Int[np.ndarray, " N"], column: Int[np.ndarray, " N"]
    ) -> tuple[Float[np.ndarray, "N G k 3"], Float[np.ndarray, "N G k"], Float[np.ndarray, "N k1 J"]]:
        """Axes, exponents and amplitudes, 1/sr, of texels in views; float64."""
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
        """See `ReflectanceField.at`."""
        axes, exponents, amplitudes = self.of(view, row, column)
        cosine = np.maximum(np.einsum("ngkx,nx->ngk", axes, light, optimize=True), 0.0)
        return amplitudes[:, 0] + summed(cosine**exponents, amplitudes[:, 1:])

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """See `Field.reconstruct`; a view is decoded once for all its lights."""
        axes, exponents, amplitudes = self.of_view(view)
        values = lobe_values(axes, exponents, self.lights.directions[light, None])[..., 0]
        return amplitudes[..., 0, :] + summed(values, amplitudes[..., 1:, :])

    def shader(self) -> TermShader:
        """See `ReflectanceField.shader`; amplitudes are in half precision, relative to the largest of all."""
        return self._shader("lobe_texels.glsl")

    def gathering_shader(self) -> TermShader:
        """What `lobe_gathering` reads of lobes."""
        return self._shader("lobe_gathering.glsl")

    def _shader(self, file: str) -> TermShader:
        sizes = {"KEPT_LOBES": self.lobes, "SETS": self.axes.shape[3]}
        return TermShader(Path(__file__).with_name(file), sizes, {"kept": self._listed}, {"tallest": self._tallest})

    @property
    def _tallest(self) -> float:
        return float(self.largest.max(initial=0.0)) or 1.0

    @cached_property
    def _listed(self) -> np.ndarray:
        """Of each view and texel its lobes, codes of axis and exponent, and then its amplitudes; float16."""
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
            shares = decoded_amplitudes(self.amplitudes[view], self.largest[view]) / self._tallest
            padded = np.zeros((texels, lobes + 1, 4 * quads), dtype=np.float16)
            padded[..., :size] = shares.reshape(texels, lobes + 1, size)
            one[:, sets * lobes :] = padded.reshape(texels, -1, 4)
        return folded(listed.reshape(-1, 4))

    def stored(self) -> dict[str, Any]:
        """See `ReflectanceField.stored`."""
        arrays = {name: getattr(self, name) for name in ("axes", "exponents", "amplitudes", "largest")}
        return arrays | {"views": self.views.directions, "lights": self.lights.directions}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> LobeField:
        """See `ReflectanceField.from_stored`."""
        arrays = {name: np.asarray(kept[name]) for name in ("axes", "exponents", "amplitudes", "largest")}
        views, lights = (Hemisphere(np.asarray(kept[name])) for name in ("views", "lights"))
        return cls(views, lights, basis, **arrays)


def summed(values: Float[np.ndarray, "*n G k"], amplitudes: Float[np.ndarray, "*n k J"]) -> Float[np.ndarray, "*n J"]:
    """Of lobes' values and amplitudes the sums, one for each coefficient."""
    return np.einsum("...gk,...kg->...g" if values.shape[-2] > 1 else "...gk,...kj->...j", values, amplitudes)


def lobe_field(
    images: BtfImages, lobes: int = 2, shared: bool = True, heard: Callable[[float], None] = lambda share: None
) -> LobeField:
    """So many lobes for each texel of each view, of registered images; `shared` by all coefficients, or of each.

    heard : hears how much of the work is done, from 0 to 1.

    Raises
    ------
    InputError : no lobes, or more than `MOST_LOBES`; images that are not finite.
    """
    if not 1 <= lobes <= MOST_LOBES:
        expected = f"1 to {MOST_LOBES}"
        raise InputError("a number of lobes that there is not", field="lobes", found=lobes, expected=expected)
    to_y = np.pi * images.basis.fold(illuminant("D65"), observer("1931_2"))[1].astype(np.float32)
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
        equations = _Equations(texels, lobes + 1, sets, size)
        for start in range(0, texels, _BLOCK):
            rows = slice(start, start + _BLOCK)
            some = np.ascontiguousarray(values[:, rows].transpose(1, 0, 2))
            luminance = some @ to_y
            weights = lightness_slope(luminance.astype(np.float64)) ** _POWER
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


class _Equations:
    """Normal equations of the amplitudes of a view's texels: m functions, a set of them for each g of G."""

    def __init__(self, texels: int, functions: int, sets: int, size: int) -> None:
        self.square = np.empty((sets, functions, functions, texels))
        self.right = np.empty((sets, functions, size // sets, texels))

    def add(
        self,
        rows: slice,
        one: int,
        lobes: Float[np.ndarray, "n k Lt"],
        weights: Float[np.ndarray, "n Lt"],
        values: Float[np.ndarray, "n Lt j"],
    ) -> None:
        """Those of some texels."""
        functions = np.concatenate([np.ones((len(lobes), 1, lobes.shape[2]), lobes.dtype), lobes], axis=1)
        # Relative, so that no texel is held back more than another.
        squares = (weights / np.sqrt(np.mean(weights**2, axis=1, keepdims=True))) ** 2
        weighed = functions * squares[:, None].astype(lobes.dtype)
        square = (weighed @ functions.swapaxes(1, 2)).astype(np.float64)
        diagonal = np.einsum("nii->ni", square)
        diagonal += _HELD * diagonal.mean(axis=1, keepdims=True)
        self.square[one, ..., rows] = square.transpose(1, 2, 0)
        self.right[one, ..., rows] = (weighed @ values).transpose(1, 2, 0)

    def rounded(self) -> tuple[Float[np.ndarray, "m J"], Int8[np.ndarray, "T m J"]]:
        """What amplitudes are relative to, and whole numbers: each makes up for how those before were rounded."""
        every = list(zip(self.square, self.right, strict=True))
        exact = [solved(square.copy(), right.copy()) for square, right in every]
        largest = np.concatenate([np.abs(one).max(axis=2) for one in exact], axis=1)
        found = np.empty((self.right.shape[3], *largest.shape), dtype=np.int8)
        size = self.right.shape[2]
        for number, (square, right) in enumerate(every):
            mine = slice(number * size, (number + 1) * size)

            def kept(function: int, amplitudes: np.ndarray, mine: slice = mine) -> np.ndarray:
                limit = largest[function, mine]
                # What makes up for others may go beyond the largest by as much as they were off.
                held = np.clip(amplitudes.T, -limit, limit)
                found[:, function, mine] = coded_amplitudes(held, limit)
                return decoded_amplitudes(found[:, function, mine], limit).T

            solved(square, right, kept)
        return largest, found
