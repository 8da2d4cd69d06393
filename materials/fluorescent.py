"""Matt surfaces that fluoresce: part of the light comes back at longer wavelengths, in all directions alike."""

from __future__ import annotations

import abc
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..spectral.basis import SpectralBasis
from ..spectral.bispectral import Bispectral
from ..spectral.fluorescent_basis import FluorescentBasis
from .brdf import Brdf, eval_lit
from .factors import Axis, FactorPack

# Last nodes of theta_h, theta_d and phi_d.
_ENDS = {"theta_h": np.pi / 2, "theta_d": np.pi / 2, "phi_d": np.pi}


class FluorescentBrdf(Brdf):
    """A BRDF beside which light leaves at other wavelengths than it came in.

    `eval` is the part that keeps its wavelength. The rest is `emission_factor(wi, wo)` times `bispectral.emission` of
    the light: the reference adds it up at every wavelength.
    """

    bispectral: Bispectral

    @abc.abstractmethod
    def emission_factor(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "..."]:
        """How the emission is spread over directions, 1/sr, without the cosine; zero on or below the horizon."""


@dataclass(frozen=True, eq=False)
class FluorescentLambert(FluorescentBrdf):
    """f_r(lambda_in, lambda_out) = D / pi: perfectly diffuse at every pair of wavelengths.

    Parameters
    ----------
    bispectral : the Donaldson matrix D.
    """

    bispectral: Bispectral
    isotropic = True

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.bispectral.reflectance.wavelengths_nm

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """The diagonal of D over pi, 1/sr: what keeps its wavelength."""
        value = self.bispectral.reflectance.samples / np.pi
        return eval_lit(lambda lit, _: np.broadcast_to(value, (len(lit), value.size)), value.size, wi, wo)

    def emission_factor(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "..."]:
        """1 / pi."""
        wi, wo = np.broadcast_arrays(wi, wo)
        return np.where((wi[..., 2] > 0) & (wo[..., 2] > 0), 1.0 / np.pi, 0.0)

    def packs(self) -> tuple[FactorPack, ...]:
        """Factors of this material, exact: one constant term, whose one coefficient folds with the full matrix."""
        axes = tuple(Axis(name, 2, end) for name, end in _ENDS.items())
        factors = (np.full((2, 1), 1.0 / np.pi), np.ones((2, 1)), np.ones((2, 1)))
        return (FluorescentPack("hd", axes, factors, np.ones((1, 1)), FluorescentBasis.of(self.bispectral)),)


@dataclass(frozen=True)
class FluorescentPack(FactorPack):
    """A pack in a `FluorescentBasis`, which no basis of reflectances can stand in for."""

    def in_basis(self, basis: SpectralBasis) -> FactorPack:
        """This pack as it is: it already folds into three numbers a light."""
        return self
