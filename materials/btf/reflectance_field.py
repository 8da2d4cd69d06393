"""Reflectance fields: for each texel and view a function of the direction of light.

Meseth, Mueller and Klein 2003 (section 4): the images of a view under all lights are fitted on their own; other views
are interpolated among three. A kind of field defines its functions, in numpy and in GLSL, and how they gather
environment light.
"""

from __future__ import annotations

import abc
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ..core.terms import TermShader
from .hemisphere import Hemisphere
from .images import BtfImages
from .light_basis import LightFunctions, light_functions


@dataclass(frozen=True, eq=False)
class ReflectanceField(abc.ABC):
    """f_r cos(theta_i), 1/sr, of H x W texels from V views; subclasses are frozen dataclasses.

    KIND : name in files. ARRAYS : names of its arrays. views, lights : measured directions. basis : of J coefficients.
    """

    KIND: ClassVar[str]
    ARRAYS: ClassVar[tuple[str, ...]]

    views: Hemisphere
    lights: Hemisphere
    basis: SpectralBasis

    @property
    @abc.abstractmethod
    def height(self) -> int:
        """H."""

    @property
    @abc.abstractmethod
    def width(self) -> int:
        """W."""

    @abc.abstractmethod
    def at(
        self,
        view: Int[np.ndarray, " N"],
        row: Int[np.ndarray, " N"],
        column: Int[np.ndarray, " N"],
        light: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N J"]:
        """Evaluate texels in measured views, under light no lower than the lowest measured (`Hemisphere.held`)."""

    @abc.abstractmethod
    def coarser(self) -> tuple[ReflectanceField, ...]:
        """Return the coarser mip levels, half as many texels each way, down to one; computed on first use."""

    def levels(self, filtered: bool) -> tuple[ReflectanceField, ...]:
        """Return all levels, or this field alone without filtering."""
        return (self, *(self.coarser() if filtered else ()))

    @abc.abstractmethod
    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `at`; it includes field_texels.glsl and defines what that requires.

        filtered : with all levels, one after the other.
        """

    @abc.abstractmethod
    def gathering_shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `gathered`; it includes field_gathering.glsl and defines what that requires."""

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        arrays = {name: getattr(self, name) for name in self.ARRAYS}
        return arrays | {"views": self.views.directions, "lights": self.lights.directions}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> Self:
        """Return the field whose `stored()` this is."""
        arrays: dict[str, Any] = {name: np.asarray(kept[name]) for name in cls.ARRAYS}
        hemispheres = {name: Hemisphere(np.asarray(kept[name])) for name in ("views", "lights")}
        return cls(**hemispheres, basis=basis, **arrays)

    @property
    def nbytes(self) -> int:
        """Bytes of its arrays."""
        return sum(getattr(self, name).nbytes for name in self.ARRAYS)

    @property
    @abc.abstractmethod
    def bytes_per_texel(self) -> int:
        """Bytes of a texel over all views."""

    @cached_property
    def functions(self) -> LightFunctions:
        """Light functions, with the weights (`hats`) that approximate each of the B terms of `gathered`.

        By default the terms are the values under the measured lights, and the functions approximate the hats of these.
        """
        return light_functions(self.lights)

    def gathered(
        self, view: Int[np.ndarray, " N"], row: Int[np.ndarray, " N"], column: Int[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N B J"]:
        """Compute the B terms of texels in measured views under environment light."""
        found = np.empty((len(view), len(self.lights), self.basis.size))
        for number, light in enumerate(self.lights.directions):
            found[:, number] = self.at(view, row, column, np.broadcast_to(light, (len(view), 3)))
        return found

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Evaluate all texels under a measured light in a measured view, 1/sr."""
        row, column = (axis.ravel() for axis in np.indices((self.height, self.width)))
        to_light = np.broadcast_to(self.lights.directions[light], (len(row), 3))
        return self.at(np.full(len(row), view), row, column, to_light).reshape(self.height, self.width, -1)

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Yield the values of each texel in all views and lights; texels are row-major indices."""
        view, light = (axis.ravel() for axis in np.indices((len(self.views), len(self.lights))))
        to_light = self.lights.directions[light]
        for texel in texels:
            row, column = (np.full(len(view), one) for one in divmod(int(texel), self.width))
            yield self.at(view, row, column, to_light).reshape(len(self.views), len(self.lights), -1)


def registered_view(images: BtfImages, view: int) -> Float[np.ndarray, "Lt T J"]:
    """Read all registered images of a view, texels in row-major order.

    Raises
    ------
    InputError : an image that is not finite.
    """
    found = np.empty((len(images.lights), images.height * images.width, images.basis.size), dtype=np.float32)
    for light in range(len(images.lights)):
        found[light] = images.registered(view, light).reshape(found.shape[1:])
        if not np.isfinite(found[light]).all():
            where = f"image of view {view}, light {light}"
            raise InputError("a BTF that is not finite", field=where, found="NaN or infinity", expected="numbers")
    return found
