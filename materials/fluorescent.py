"""Matt surfaces that fluoresce: part of the light comes back at longer wavelengths, in all directions alike."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ..spectral.basis import SpectralBasis
from ..spectral.bispectral import Bispectral
from ..spectral.errors import InputError
from ..spectral.fluorescent_basis import FluorescentBasis
from ..spectral.folding import Folding
from .axes import Axis
from .brdf import Brdf, Lobe, eval_lit
from .factors import FactorPack, FitError
from .protocol import LIGHTS, sphere_protocol

# Last nodes of theta_h, theta_d and phi_d.
_ENDS = {"theta_h": np.pi / 2, "theta_d": np.pi / 2, "phi_d": np.pi}


class FluorescentBrdf(Brdf):
    """A BRDF beside which light leaves at other wavelengths than it came in.

    `eval` is the part that keeps its wavelength. The rest is `emission_factor(wi, wo)` times `bispectral.emission` of
    the light: the reference adds it up at every wavelength.
    """

    bispectral: Bispectral  # pyright: ignore[reportIncompatibleVariableOverride]

    def xyz(
        self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"], folding: Folding
    ) -> Float[np.ndarray, "N M3"]:
        """What keeps its wavelength, and the emission."""
        return super().xyz(wi, wo, folding) + self.emission_factor(wi, wo)[:, None] * folding.emitted(self.bispectral)

    @abc.abstractmethod
    def emission_factor(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "..."]:
        """How the emission is spread over directions, 1/sr, without the cosine; zero on or below the horizon."""

    @abc.abstractmethod
    def packs(self) -> tuple[FactorPack, ...]:
        """Factors of this material, emission included, which a fit of `eval` would lose."""

    def lobes(self) -> tuple[Lobe, ...]:
        """Refused: a sum of lobes over reflected wavelengths leaves the emission out."""
        raise InputError(
            "a fluorescent surface is not fitted", field="brdf", found=type(self).__name__, expected="its own `packs()`"
        )


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
        """(L,) of the light that leaves."""
        return self.bispectral.reflectance.wavelengths_nm

    def parameters(self) -> dict[str, np.ndarray]:
        """What rebuilds this surface: `wavelengths_nm` (Lo,) out, `excitation_nm` (Li,) in, `donaldson` (Lo,Li)."""
        surface = self.bispectral
        return {
            "wavelengths_nm": surface.wavelengths_out_nm,
            "excitation_nm": surface.wavelengths_in_nm,
            "donaldson": surface.matrix,
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> FluorescentLambert:
        """The surface whose `parameters()` these are."""
        return cls(Bispectral(*(parameters[name] for name in ("excitation_nm", "wavelengths_nm", "donaldson"))))

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
        """Exact factors: one constant term, whose one coefficient folds with the full matrix."""
        axes = tuple(Axis(name, 2, end) for name, end in _ENDS.items())
        factors = (np.full((2, 1), 1.0 / np.pi), np.ones((2, 1)), np.ones((2, 1)))
        return (FluorescentPack("hd", axes, factors, np.ones((1, 1)), FluorescentBasis.of(self.bispectral)),)

    def measured_packs(self, pixels: int = 64) -> tuple[tuple[FactorPack, ...], FitError]:
        """`packs`, and how far they are from every wavelength of the matrix, in ΔE94 on the sphere of `protocol`."""
        sphere = sphere_protocol(pixels)
        (pack,) = self.packs()
        error = sphere.compare_lights(sphere.references(self, LIGHTS), sphere.samples((pack,), LIGHTS), LIGHTS)
        return (replace(pack, error=error),), error


@dataclass(frozen=True)
class FluorescentPack(FactorPack):
    """A pack in a `FluorescentBasis`, which no basis of reflectances can stand in for."""

    def folded(self, folding: Folding) -> Float[np.ndarray, "R M3"]:
        """The full matrix, under each light."""
        each = [self.fold(light, folding.observer) for light in folding.lights]
        return folding.scale * np.concatenate(each, axis=1)

    def in_basis(self, basis: SpectralBasis) -> FactorPack:
        """This pack as it is: it already folds into three numbers a light."""
        return self
