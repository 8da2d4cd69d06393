"""Matt surfaces with a measured spectrum at every texel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from ..analytic.lambert import Lambert
from ..core.points import Points
from ..core.surface import Surface
from .texels import look_up
from .texture_form import TextureForm, texture_form

# Points per block of spectra: four texels of each are held.
_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class SpectralTexture(Surface):
    """f_r = rho(u, v) / pi: perfectly diffuse at every point, linear between the middles of texels (`texels`).

    Parameters
    ----------
    wavelengths_nm : (L,) nm, ascending.
    texture : (H,W,L) rho as measured, not clipped.

    Raises
    ------
    InputError : a texture of another shape, or without texels.
    """

    NAME: ClassVar[str] = "spectral_texture"
    uses_uv: ClassVar[bool] = True
    isotropic = True

    wavelengths_nm: Float[np.ndarray, " L"]
    texture: np.ndarray

    def __post_init__(self) -> None:
        expected = f"(H, W, {len(self.wavelengths_nm)})"
        if self.texture.ndim != 3 or self.texture.shape[2] != len(self.wavelengths_nm) or not self.texture.size:
            raise InputError("not a texture", field="texture", found=self.texture.shape, expected=expected)

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate rho / pi at the point itself, without averaging over the footprint. See `Surface.at`."""
        assert points.uv is not None
        lit = (points.wi[:, 2] > 0) & (points.wo[:, 2] > 0)
        out = np.zeros((len(points), len(self.wavelengths_nm)))
        for start in range(0, len(out), _BLOCK):
            rows = slice(start, start + _BLOCK)
            out[rows] = look_up(self.texture, points.uv[rows]) * (lit[rows, None] / np.pi)
        return out

    def average(self) -> Lambert:
        """Return the surface of the mean reflectance.

        Raises
        ------
        InputError : a mean outside [0, 1].
        """
        mean = self.texture.mean(axis=(0, 1), dtype=np.float64)
        return Lambert(Spectrum.sampled(self.wavelengths_nm, mean, "reflectance"))

    def own_form(self, budget: float = 0.5) -> TextureForm:
        """Make a form of few terms that keeps every texel within the budget; see `texture_form`."""
        return texture_form(self.wavelengths_nm, self.texture, budget)

    def parameters(self) -> dict[str, np.ndarray]:
        """Return the parameters that rebuild this surface."""
        return {"wavelengths_nm": self.wavelengths_nm, "texture": self.texture}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> SpectralTexture:
        """Return the surface whose `parameters()` these are."""
        return cls(np.asarray(parameters["wavelengths_nm"], dtype=np.float64), np.asarray(parameters["texture"]))
