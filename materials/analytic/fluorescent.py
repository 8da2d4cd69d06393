"""Fluorescent matt surfaces: part of the light is emitted at longer wavelengths, equally in all directions."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.bispectral import Bispectral
from ...spectral.folding import Folding
from ...spectral.palette import DonaldsonPalette
from ..core.brdf import Brdf, Lobe, eval_lit
from ..core.fast import Fast
from ..core.points import Points
from ..factored.pack import FactoredBrdf, matt_brdf


class FluorescentBrdf(Brdf):
    """A BRDF with fluorescence: emission at other wavelengths than the incident ones.

    `eval` is the part that keeps its wavelength. The rest is `emission_factor(wi, wo)` times `bispectral.emission` of
    the light, which the reference adds at every wavelength.
    """

    bispectral: Bispectral  # pyright: ignore[reportIncompatibleVariableOverride]

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Fold reflection and emission into XYZ."""
        emitted = self.emission_factor(points.wi, points.wo)[:, None] * folding.emitted(self.bispectral)
        return super().xyz(points, folding) + emitted

    @abc.abstractmethod
    def emission_factor(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "..."]:
        """Evaluate the emission's distribution over directions, 1/sr, without the cosine; 0 below the horizon."""

    @abc.abstractmethod
    def own_form(self, budget: float = 0.5) -> Fast:
        """Return the fast form, emission included, which a fit of `eval` would lose."""

    def lobes(self) -> tuple[Lobe, ...]:
        """Raise an error: a sum of lobes over reflected wavelengths would omit the emission."""
        found, expected = type(self).__name__, "its `own_form()`"
        raise InputError("a fluorescent surface is not fitted", field="brdf", found=found, expected=expected)


@dataclass(frozen=True, eq=False)
class FluorescentLambert(FluorescentBrdf):
    """f_r(lambda_in, lambda_out) = D / pi: perfectly diffuse at every pair of wavelengths.

    Parameters
    ----------
    bispectral : the Donaldson matrix D.
    """

    NAME: ClassVar[str] = "fluorescent_lambert"
    isotropic = True

    bispectral: Bispectral

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(L,) wavelengths of the outgoing light."""
        return self.bispectral.reflectance.wavelengths_nm

    def parameters(self) -> dict[str, np.ndarray]:
        """Return the parameters that rebuild this surface: `wavelengths_nm` (Lo,) out, `excitation_nm` (Li,) in,
        `donaldson` (Lo,Li).
        """
        surface = self.bispectral
        return {
            "wavelengths_nm": surface.wavelengths_out_nm,
            "excitation_nm": surface.wavelengths_in_nm,
            "donaldson": surface.matrix,
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> FluorescentLambert:
        """Return the surface whose `parameters()` these are."""
        return cls(Bispectral(*(parameters[name] for name in ("excitation_nm", "wavelengths_nm", "donaldson"))))

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Return the diagonal of D over pi, 1/sr: the reflection without fluorescence."""
        value = self.bispectral.reflectance.samples / np.pi
        return eval_lit(lambda lit, _: np.broadcast_to(value, (len(lit), value.size)), value.size, wi, wo)

    def emission_factor(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "..."]:
        """Return 1 / pi."""
        wi, wo = np.broadcast_arrays(wi, wo)
        return np.where((wi[..., 2] > 0) & (wo[..., 2] > 0), 1.0 / np.pi, 0.0)

    def own_form(self, budget: float = 0.5) -> FactoredBrdf:
        """Return one constant term, exact, whose single spectrum folds with the full matrix."""
        return matt_brdf(np.array([1.0 / np.pi]), DonaldsonPalette.of_surface(self.bispectral))
