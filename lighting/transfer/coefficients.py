"""Coefficients of light between surfaces: relative to the spectra of lights, or of radiance.

Without fluorescence, light of a spectrum s after reflectances of the product r is s r, stored as J coefficients of r
for each of K spectra: KJ fields. With fluorescence, coefficients are of the radiance itself, at Y = 1 of the perfect
diffuser (`regions`); after the first surface the light's origin does not matter, and J fields suffice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.observers import Observer
from ...spectral.radiance_basis import sent_by
from ...spectral.spectrum import Spectrum
from .regions import best_seen


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Layout of F fields in a basis of J coefficients.

    spectra : K, of lights. reference_lux : illuminance at which a perfect diffuser has Y = 1. radiant : whether
    coefficients are of radiance.
    """

    basis: SpectralBasis
    spectra: tuple[Spectrum, ...]
    observer: Observer
    reference_lux: float
    radiant: bool = False

    @property
    def kinds(self) -> int:
        """F / J: K if lights are kept apart, else 1."""
        return 1 if self.radiant else len(self.spectra)

    @property
    def fields(self) -> int:
        """Number of fields, F."""
        return self.kinds * self.basis.size

    def sent(self, reflected: Float[np.ndarray, "n L"]) -> list[Float[np.ndarray, "n J"]]:
        """Compute the radiosity of surfaces under 1 lux of each spectrum; reflected : reflectances at the basis's
        wavelengths.
        """
        if self.radiant:
            return [self.basis.project(reflected * power) for power in self._powers]
        return [self.basis.project(reflected)] * len(self.spectra)

    def joined(self, each: Sequence[Float[np.ndarray, "n J"]]) -> Float[np.ndarray, "n F"]:
        """Combine coefficients of each spectrum into fields."""
        if self.radiant:
            return sum(each[1:], start=each[0])
        return each[0] if len(each) == 1 else np.concatenate(each, axis=1)

    def rows(self, each: Sequence[Float[np.ndarray, "n J"]]) -> Float[np.ndarray, "Kn F"]:
        """Return the same as a matrix with K n rows, one for each spectrum and each of its n elements."""
        if self.radiant:
            return np.concatenate(each)
        found = np.zeros((len(each), len(each[0]), len(each), self.basis.size))
        for k, one in enumerate(each):
            found[k, :, k] = one
        return found.reshape(-1, self.fields)

    @cached_property
    def to_xyz(self) -> Float[np.ndarray, "F 3"]:
        """Matrix from fields to XYZ."""
        return self.folds(np.ones(len(self.basis.wavelengths_nm)))

    @cached_property
    def most_y(self) -> Float[np.ndarray, " F"]:
        """Largest Y of a field of size 1, of either sign, after passive surfaces."""
        size = np.abs(self.basis.synthesis)
        if not self.radiant:
            return np.concatenate([one[1] @ size for one in self._weights]) / self.reference_lux
        return best_seen(self.observer, self.basis.wavelengths_nm) @ size / self.reference_lux

    def folds(
        self, surface: Float[np.ndarray, "*n L"], illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "*n F M3"]:
        """Return the matrices from incident coefficients to reflected XYZ, exact at each wavelength of the basis.

        surface : reflectances. illuminants : M, each replacing all spectra; None keeps them.

        Raises
        ------
        InputError : an illuminant for coefficients of radiance, since it changes the excitation.
        """
        if self.radiant:
            self._check_own(illuminants)
            weights = np.concatenate([self._seen] * len(illuminants))[None] / self.reference_lux
        else:
            each = [[own if one is None else self._observed(one) for one in illuminants] for own in self._weights]
            weights = np.stack([np.concatenate(one) for one in each]) / self.reference_lux
        lights = np.einsum("kml,lj->lkjm", weights, self.basis.synthesis)
        found = surface @ lights.reshape(len(self.basis.synthesis), -1)
        return found.reshape(*surface.shape[:-1], -1, weights.shape[1])

    def glowing(self, surface: Bispectral) -> list[Float[np.ndarray, " J"]]:
        """Compute `sent` for a fluorescent surface: radiance, from lights at their own resolution."""
        nm, seen_by = self.basis.wavelengths_nm, self.observer
        return [self.basis.project(surface.radiance(one, nm) / seen_by.luminous(one)) for one in self.spectra]

    def glowing_fold(
        self, surface: Bispectral, illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "J M3"]:
        """Return `folds` for a fluorescent surface."""
        self._check_own(illuminants)
        matrix = surface.narrow(self.basis.wavelengths_nm)
        seen = (sent_by(matrix.T, self._seen) @ self.basis.synthesis).T / self.reference_lux
        return np.concatenate([seen] * len(illuminants), axis=1)

    def _check_own(self, illuminants: Sequence[Spectrum | None]) -> None:
        if any(one is not None for one in illuminants):
            words = "a state of its own for each: `Relighting.lit_by`"
            found = "another illuminant"
            raise InputError("fluorescence is of one light", field="illuminants", found=found, expected=words)

    @cached_property
    def _powers(self) -> list[Float[np.ndarray, " L"]]:
        """Spectral power of each light at Y = 1."""
        nm = self.basis.wavelengths_nm
        return [one.averaged(nm).samples / self.observer.luminous(one) for one in self.spectra]

    @cached_property
    def _seen(self) -> Float[np.ndarray, "3 L"]:
        return self.observer.sensitivity(self.basis.wavelengths_nm)

    @cached_property
    def _weights(self) -> list[Float[np.ndarray, "3 L"]]:
        return [self._observed(one) for one in self.spectra]

    def _observed(self, lamp: Spectrum) -> Float[np.ndarray, "m L"]:
        return self.observer.weights(lamp, self.basis.wavelengths_nm)
