"""What a 45:0 instrument reads of a material's original data: its curve, and its XYZ under any light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..spectral.bispectral import Bispectral
from ..spectral.observers import Observer
from ..spectral.spectrum import Spectrum
from .brdf import Brdf
from .fluorescent import FluorescentBrdf
from .records.record_colour import annular_45_0, radiance_factor_45_0

#: How the reading is taken: lit at 45 degrees all around, seen along the normal.
GEOMETRY = "45a:0"


@dataclass(frozen=True, eq=False)
class Reading:
    """A material as an annular 45:0 instrument meets it.

    Parameters
    ----------
    wavelengths_nm, factor : (L,) radiance factor of what keeps its wavelength, at the data's own wavelengths.
    surface, spread : of a fluorescent material, its Donaldson matrix and pi times its emission factor; else None, 0.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    factor: Float[np.ndarray, " L"]
    surface: Bispectral | None = None
    spread: float = 0.0

    @classmethod
    def of(cls, brdf: Brdf) -> Reading:
        """The reading of a material's original data."""
        factor = radiance_factor_45_0(brdf)
        if not isinstance(brdf, FluorescentBrdf):
            return cls(brdf.wavelengths_nm, factor)
        spread = float(np.pi * brdf.emission_factor(*annular_45_0()).mean())
        return cls(brdf.wavelengths_nm, factor, brdf.bispectral, spread)

    def xyz(self, light: Spectrum, eye: Observer) -> Float[np.ndarray, "3"]:
        """XYZ under a light; the perfect diffuser has Y = 1. Raises `InputError` as `Observer.weights` does."""
        xyz = eye.weights(light, self.wavelengths_nm) @ self.factor
        return xyz if self.surface is None else xyz + self.spread * self.surface.fold_emission(light, eye)
