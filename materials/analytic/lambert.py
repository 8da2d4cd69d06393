"""The perfectly diffuse surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...spectral.palette import Palette
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..core.surface import SumOfTerms, constant_term
from ..factored.pack import FactoredBrdf, matt_brdf
from .model import AnalyticBrdf


@dataclass(frozen=True, eq=False)
class Lambert(AnalyticBrdf):
    """f_r = rho / pi (Lambert 1760), so that the albedo is rho for every direction of the light.

    Parameters
    ----------
    reflectance : rho, (L,) in [0, 1].

    Examples
    --------
    >>> grey = Lambert(Spectrum.sampled([400.0, 700.0], [0.5, 0.5]))
    >>> up = np.array([0.0, 0.0, 1.0])
    >>> (np.pi * grey.eval(up, up)).tolist()
    [0.5, 0.5]
    """

    NAME: ClassVar[str] = "lambert"
    isotropic = True

    reflectance: Spectrum

    def __post_init__(self) -> None:
        self._set(_value=self._checked_reflectance("reflectance") / np.pi)

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Return one reflectance, for the tests that every model must pass."""
        ramp = np.linspace(0.0, 1.0, len(wavelengths_nm))
        return (cls(Spectrum.sampled(wavelengths_nm, ramp)),)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.broadcast_to(self._value, (len(wi), len(self._value)))

    @property
    def sum_of_terms(self) -> SumOfTerms:
        """One constant term: `Surface.sum_of_terms`."""
        return constant_term(self._value)

    def own_form(self, budget: float = 0.5) -> FactoredBrdf:
        """Return one constant term, exact in every direction; its spectrum is projected to the working wavelengths."""
        shown = self.reflectance.projected(WORKING_WAVELENGTHS_NM).samples[None] / np.pi
        return matt_brdf(np.ones(1), Palette.of(shown), "half")
