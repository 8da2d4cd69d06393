"""A basis of one fluorescent surface: one coefficient, and what it looks like depends on the light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .axis_letters import Wavelengths
from .basis import SpectralBasis
from .bispectral import Bispectral
from .observers import Observer
from .spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class FluorescentBasis(SpectralBasis):
    """Coefficient 1 is the surface itself; `fold` and `radiance` take its full Donaldson matrix.

    Whoever only folds coefficients with a light, as the renderers do, needs to know nothing of fluorescence.
    `synthesis` is the part that keeps its wavelength, and so is what `reconstruct` and `operator` speak of.
    """

    bispectral: Bispectral

    @classmethod
    def of(cls, bispectral: Bispectral) -> FluorescentBasis:
        """The basis of one surface."""
        kept = bispectral.reflectance.samples[:, None]
        # Black all through, it has no analysis.
        analysis = kept / max(float(np.sum(kept * kept)), np.finfo(float).tiny)
        return cls("fluorescent", bispectral.reflectance.wavelengths_nm, analysis, kept, bispectral)

    def fold(self, light: Spectrum, observer: Observer) -> Float[np.ndarray, "3 J"]:
        """XYZ of the surface under `light`, (3,1); Y of the perfect diffuser is 1."""
        return self.bispectral.fold(light, observer)[:, None]

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "J L"]:
        """pi times the radiance that leaves a diffuse surface under `light`, (1,L), in the light's own unit."""
        return self.bispectral.radiance(light, wavelengths_nm)[None]
