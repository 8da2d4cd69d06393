"""Simulated reading of a material's original data by a 45:0 instrument: its curve, and its XYZ under any light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...spectral.folding import Folding
from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum
from ..core.brdf import Brdf
from ..core.points import Points
from ..effect_coating.off_specular import ANGLES, effect_of, towards
from ..records.record_colour import annular_45_0, radiance_factor_45_0

#: Geometry of the reading: lit at 45 degrees all around, seen along the normal.
GEOMETRY = "45a:0"


@dataclass(frozen=True, eq=False)
class InstrumentReading:
    """Simulated reading of a material by an annular 45:0 instrument.

    Parameters
    ----------
    wavelengths_nm, factor : (L,) radiance factor without fluorescence, at the data's own wavelengths.
    brdf : the data if they fluoresce; None if the factor is complete.
    around : radiance factors at `off_specular.ANGLES` (3, L), for metals and effect coatings; None for others.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    factor: Float[np.ndarray, " L"]
    brdf: Brdf | None = None
    around: Float[np.ndarray, "3 L"] | None = None

    @classmethod
    def of(cls, brdf: Brdf) -> InstrumentReading:
        """Return the reading of a material's original data."""
        around = None
        if effect_of(brdf):
            around = np.pi * np.asarray(brdf.eval(*towards(ANGLES)), dtype=np.float64)
        return cls(brdf.wavelengths_nm, radiance_factor_45_0(brdf), brdf if brdf.bispectral else None, around)

    def xyz(self, light: Spectrum, eye: Observer) -> Float[np.ndarray, "3"]:
        """Compute XYZ under a light, emission included; the perfect diffuser has Y = 1.

        Raises `InputError` as `Observer.weights` does.
        """
        if self.brdf is None:
            return eye.weights(light, self.wavelengths_nm) @ self.factor
        return self.brdf.xyz(Points(*annular_45_0()), Folding(eye, [light], np.pi)).mean(axis=0)

    def xyz_around(self, light: Spectrum, eye: Observer) -> Float[np.ndarray, "n 3"]:
        """Compute XYZ at each of `off_specular.ANGLES`, for metals and effect coatings; none for others."""
        if self.around is None:
            return np.zeros((0, 3))
        return self.around @ eye.weights(light, self.wavelengths_nm).T
