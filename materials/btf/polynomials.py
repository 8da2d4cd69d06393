"""Reflectance fields as biquadratic polynomials in the light's x and y, one byte per coefficient.

Meseth, Mueller and Klein 2003 (section 4.1, RFP) use for each view the polynomials of Malzbender, Gelb and Wolters
2001, f_r cos(theta_i) = a x^2 + b y^2 + c x y + d x + e y + f, stored as in that paper: a byte each, with a scale and
an offset, here one of each for each view and coefficient. They are sums of six functions, so that environment light
needs only its integral under each of these.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Int, UInt8

from ..core.terms import TermShader
from ..svbrdf.texels import levels_of
from .hemisphere import Hemisphere
from .images import BtfImages
from .light_basis import LightFunctions, nearest
from .reflectance_field import ReflectanceField, registered_view
from .texels import folded, in_fours

_STEPS = 255
#: x^2, y^2, xy, x, y and 1.
MONOMIALS = 6


def monomials(light: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 6"]:
    """Evaluate x^2, y^2, xy, x, y and 1 of directions."""
    x, y, _ = np.moveaxis(light, -1, 0)
    return np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=-1)


@dataclass(frozen=True, eq=False)
class Polynomials(ReflectanceField):
    """Polynomial for each view, texel and coefficient.

    codes (V,H,W,6,J) : integers, in steps (V,6,J), 1/sr, above lowest (V,6,J); at coarser levels their means.
    """

    KIND: ClassVar[str] = "rfp"
    ARRAYS: ClassVar[tuple[str, ...]] = ("codes", "steps", "lowest")

    codes: UInt8[np.ndarray, "V H W 6 J"] | Float[np.ndarray, "V H W 6 J"]
    steps: Float[np.ndarray, "V 6 J"]
    lowest: Float[np.ndarray, "V 6 J"]

    @property
    def height(self) -> int:
        """H."""
        return self.codes.shape[1]

    @property
    def width(self) -> int:
        """W."""
        return self.codes.shape[2]

    @property
    def bytes_per_texel(self) -> int:
        """Bytes over all views: six for each view and coefficient."""
        return self.codes.nbytes // (self.height * self.width)

    def at(
        self,
        view: Int[np.ndarray, " N"],
        row: Int[np.ndarray, " N"],
        column: Int[np.ndarray, " N"],
        light: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N J"]:
        """Implement `ReflectanceField.at`."""
        return np.einsum("nm,nmj->nj", monomials(light), self.gathered(view, row, column))

    @cached_property
    def functions(self) -> LightFunctions:
        """Light functions fitted to the six monomials, clamped below the lowest light and 0 below the horizon."""
        return nearest(self.lights, _over_the_sphere)

    def gathered(
        self, view: Int[np.ndarray, " N"], row: Int[np.ndarray, " N"], column: Int[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N 6 J"]:
        """Return the coefficients of the polynomials."""
        return self.codes[view, row, column] * self.steps[view] + self.lowest[view]

    def coarser(self) -> tuple[Polynomials, ...]:
        """Implement `ReflectanceField.coarser`: the mean of polynomials is the polynomial of their means."""
        return self._coarser

    @cached_property
    def _coarser(self) -> tuple[Polynomials, ...]:
        return tuple(replace(self, codes=codes) for codes in self._means())

    def _means(self) -> list[Float[np.ndarray, "V _ _ 6 J"]]:
        """Compute the means of the codes, in half precision as the GPU has them: off by 1/16 of a step at most."""
        shape = (self.height, self.width, math.prod(self.codes.shape[3:]))
        views = [levels_of(codes.reshape(shape).astype(np.float32))[1:] for codes in self.codes]
        return [
            np.stack([mean.astype(np.float16).reshape(*mean.shape[:2], *self.codes.shape[3:]) for mean in level])
            for level in zip(*views, strict=True)
        ]

    def shader(self, filtered: bool = False) -> TermShader:
        """Implement `ReflectanceField.shader`; codes are whole numbers in half precision."""
        return self._shader("polynomial_texels.glsl", filtered)

    def gathering_shader(self, filtered: bool = False) -> TermShader:
        """Implement `ReflectanceField.gathering_shader`."""
        return self._shader("polynomial_gathering.glsl", filtered)

    def _shader(self, file: str, filtered: bool) -> TermShader:
        return TermShader(Path(__file__).with_name(file), {}, self._filtered if filtered else self._textures)

    @cached_property
    def _filtered(self) -> dict[str, np.ndarray]:
        codes = [in_fours(level.codes) for level in (self, *self._coarser)]
        return self._textures | {"codes": folded(np.concatenate(codes))}

    @cached_property
    def _textures(self) -> dict[str, np.ndarray]:
        return {
            "codes": folded(in_fours(self.codes)),
            "steps": folded(in_fours(self.steps, np.float32)),
            "lowest": folded(in_fours(self.lowest, np.float32)),
        }


def polynomials(images: BtfImages, heard: Callable[[float], None] = lambda share: None) -> Polynomials:
    """Fit polynomials to registered images by least squares, each view and coefficient on its own.

    heard : receives the fraction of the work done, from 0 to 1.

    Raises
    ------
    InputError : images that are not finite.
    """
    inverse = np.linalg.pinv(monomials(images.lights.directions))
    views, size = len(images.views), images.basis.size
    codes = np.empty((views, images.height, images.width, MONOMIALS, size), dtype=np.uint8)
    steps, lowest = np.empty((2, views, MONOMIALS, size))
    for view in range(views):
        values = registered_view(images, view)
        found = np.tensordot(inverse, values, axes=1)
        lowest[view] = found.min(axis=1)
        span = found.max(axis=1) - lowest[view]
        steps[view] = np.where(span > 0.0, span, 1.0) / _STEPS
        whole = np.rint((found - lowest[view][:, None]) / steps[view][:, None])
        codes[view] = whole.astype(np.uint8).transpose(1, 0, 2).reshape(codes.shape[1:])
        heard((view + 1) / views)
    return Polynomials(images.views, images.lights, images.basis, codes, steps, lowest)


def _over_the_sphere(lights: Hemisphere, directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 6"]:
    held, share = lights.held(directions)
    return monomials(held) * share[:, None]
