"""Coefficients of light between surfaces: relative to the spectra of lights, or of radiance.

Where every surface keeps each wavelength, light of a spectrum s that met reflectances of the product r is s r: J
coefficients of r, apart for each of K spectra, KJ fields. Where one fluoresces they are of s r itself, at Y = 1 of the
perfect diffuser (`regions`); once light has met a surface it matters no more which light it is of, and J fields do.
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
    """F fields of a basis of J coefficients.

    spectra : K, of lights. reference_lux : a perfect diffuser that receives this has Y = 1. radiant : whether they are
    of radiance.
    """

    basis: SpectralBasis
    spectra: tuple[Spectrum, ...]
    observer: Observer
    reference_lux: float
    radiant: bool = False

    @property
    def kinds(self) -> int:
        """F / J: K where lights are apart."""
        return 1 if self.radiant else len(self.spectra)

    @property
    def fields(self) -> int:
        """F."""
        return self.kinds * self.basis.size

    def sent(self, reflected: Float[np.ndarray, "n L"]) -> list[Float[np.ndarray, "n J"]]:
        """Compute the emission of surfaces under 1 lux of each spectrum; reflected : at the basis' wavelengths."""
        if self.radiant:
            return [self.basis.project(reflected * power) for power in self._powers]
        return [self.basis.project(reflected)] * len(self.spectra)

    def joined(self, each: Sequence[Float[np.ndarray, "n J"]]) -> Float[np.ndarray, "n F"]:
        """Fields of what has become of each spectrum."""
        if self.radiant:
            return sum(each[1:], start=each[0])
        return each[0] if len(each) == 1 else np.concatenate(each, axis=1)

    def rows(self, each: Sequence[Float[np.ndarray, "n J"]]) -> Float[np.ndarray, "Kn F"]:
        """Return the same, a row for each number of each spectrum."""
        if self.radiant:
            return np.concatenate(each)
        found = np.zeros((len(each), len(each[0]), len(each), self.basis.size))
        for k, one in enumerate(each):
            found[k, :, k] = one
        return found.reshape(-1, self.fields)

    @cached_property
    def to_xyz(self) -> Float[np.ndarray, "F 3"]:
        """Convert them to XYZ."""
        return self.folds(np.ones(len(self.basis.wavelengths_nm)))

    @cached_property
    def most_y(self) -> Float[np.ndarray, " F"]:
        """Y that 1 of each, of any sign, may have after surfaces that send out no more than arrives."""
        size = np.abs(self.basis.synthesis)
        if not self.radiant:
            return np.concatenate([one[1] @ size for one in self._weights]) / self.reference_lux
        return best_seen(self.observer, self.basis.wavelengths_nm) @ size / self.reference_lux

    def folds(
        self, surface: Float[np.ndarray, "*n L"], illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "*n F M3"]:
        """Make the maps from arriving coefficients to leaving XYZ, exact at each wavelength of the basis.

        surface : reflectances. illuminants : M, each in place of all spectra; None is their own.

        Raises
        ------
        InputError : an illuminant where coefficients are of radiance: it excites anew.
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
        """`sent` by one that fluoresces: radiance, of lights at their own resolution."""
        nm, seen_by = self.basis.wavelengths_nm, self.observer
        return [self.basis.project(surface.radiance(one, nm) / seen_by.luminous(one)) for one in self.spectra]

    def glowing_fold(
        self, surface: Bispectral, illuminants: Sequence[Spectrum | None] = (None,)
    ) -> Float[np.ndarray, "J M3"]:
        """`folds` of one that fluoresces."""
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
        """Powers of each spectrum, Y = 1."""
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
