"""Palettes: the spectra that a surface's terms are multiplied with, the only spectral part of a fast form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths
from .basis import SpectralBasis
from .bispectral import Bispectral
from .folding import Folding
from .projection import tent_means
from .spectrum import Spectrum
from .wavelengths import interpolation_matrix, is_finer


@dataclass(frozen=True, eq=False)
class Palette:
    """P entries of R spectra each; a term r of entry p is multiplied with spectrum (p, r).

    Parameters
    ----------
    values : (P,R,J) coefficients in `basis`, 1/sr. A uniform material has one entry, a texture one per texel or colour.
    basis : of J coefficients.

    Raises
    ------
    InputError : the coefficients are not finite, or as many as the basis has.

    Examples
    --------
    >>> from metamer.spectral.illuminants import illuminant
    >>> from metamer.spectral.observers import observer
    >>> grey = Palette.of(np.full((1, 81), 0.18))
    >>> grey.folded(Folding(observer("1931_2"), [illuminant("D65")]))[0, 0, 1].round(6).item()
    0.18
    """

    values: Float[np.ndarray, "P R J"]
    basis: SpectralBasis

    def __post_init__(self) -> None:
        shape = np.shape(self.values)
        if len(shape) != 3 or shape[2] != self.basis.size:
            raise InputError(
                "spectral factor does not fit the basis",
                field="values",
                found=shape,
                expected=f"(entries, terms, {self.basis.size})",
            )
        if not np.all(np.isfinite(self.values)):
            raise InputError("spectra are not finite", field="values", found="NaN or infinity", expected="numbers")

    @classmethod
    def of(cls, spectra: Float[np.ndarray, "R J"], basis: SpectralBasis | None = None) -> Palette:
        """Make a palette of one entry of R spectra; without a basis they are samples on the working wavelengths."""
        return cls(np.asarray(spectra)[None], SpectralBasis.sampled() if basis is None else basis)

    @property
    def entries(self) -> int:
        """Number P of entries."""
        return self.values.shape[0]

    @property
    def rank(self) -> int:
        """Number R of terms of an entry."""
        return self.values.shape[1]

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:
        """(L,) of the basis."""
        return self.basis.wavelengths_nm

    @property
    def samples(self) -> Float[np.ndarray, "P R L"]:
        """Spectra at every wavelength of the basis, without fluorescence."""
        return self.basis.reconstruct(self.values)

    def folded(self, folding: Folding) -> Float[np.ndarray, "P R M3"]:
        """Fold each spectrum into XYZ under each of M lights; the result has no wavelengths."""
        return self.values @ folding.coefficients(self.basis)

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "P R L"]:
        """Compute the radiance of each spectrum under `light`, as `SpectralBasis.radiance`, in the light's own unit."""
        return self.values @ self.basis.radiance(light, wavelengths_nm)

    def in_basis(self, basis: SpectralBasis) -> Palette:
        """Return the same spectra projected into another basis, through the wavelengths of that basis."""
        samples = self.samples
        if not np.array_equal(self.wavelengths_nm, basis.wavelengths_nm):
            samples = samples @ interpolation_matrix(self.wavelengths_nm, basis.wavelengths_nm).T
        return replace(self, values=basis.project(samples), basis=basis)

    def stored(self) -> dict[str, Any]:
        """Return its names and arrays for a file; `from_stored` reads them back."""
        kept: dict[str, Any] = {"basis": self.basis.name}
        kept["spectral"] = self.values[0] if self.entries == 1 else self.values
        kept["wavelengths_nm"] = self.wavelengths_nm
        if not self.basis.is_sampled:
            kept |= {"analysis": self.basis.analysis, "synthesis": self.basis.synthesis}
        return kept

    @staticmethod
    def from_stored(kept: Mapping[str, Any]) -> Palette:
        """Return the palette, of any kind, whose `stored()` this is; KeyError if a field is missing."""
        wavelengths_nm, values = kept["wavelengths_nm"], np.asarray(kept["spectral"])
        values = values if values.ndim == 3 else values[None]
        if "donaldson" in kept:
            surface = Bispectral(kept["excitation_nm"], wavelengths_nm, kept["donaldson"])
            return replace(DonaldsonPalette.of_surface(surface), values=values)
        basis = SpectralBasis.sampled(wavelengths_nm)
        if "analysis" in kept:
            basis = SpectralBasis(kept["basis"], wavelengths_nm, kept["analysis"], kept["synthesis"])
        return Palette(values, basis)


@dataclass(frozen=True, eq=False)
class DonaldsonPalette(Palette):
    """Palette of a fluorescent surface: one entry and one term, which folds with its full Donaldson matrix.

    No basis of reflectances can represent it. In `basis`, coefficient 1 is the surface itself; its spectrum is the
    matrix's diagonal, without fluorescence.
    """

    bispectral: Bispectral

    @classmethod
    def of_surface(cls, bispectral: Bispectral) -> DonaldsonPalette:
        """Return the palette of one surface."""
        kept = bispectral.reflectance.samples[:, None]
        # Black all through, it has no analysis.
        analysis = kept / max(float(np.sum(kept * kept)), np.finfo(float).tiny)
        basis = SpectralBasis("fluorescent", bispectral.reflectance.wavelengths_nm, analysis, kept)
        return cls(np.ones((1, 1, 1)), basis, bispectral)

    def folded(self, folding: Folding) -> Float[np.ndarray, "1 1 M3"]:
        """Compute XYZ of the surface under each light, emission included; exact."""
        each = [self.bispectral.fold(light, folding.observer) for light in folding.lights]
        return self.values * folding.scale * np.concatenate(each)

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "1 1 L"]:
        """Compute pi times the radiance of a diffuse surface under `light`, in the light's own unit."""
        return self.values * self.bispectral.radiance(light, wavelengths_nm)

    def in_basis(self, basis: SpectralBasis) -> Palette:
        """Return this palette unchanged: it already folds to three numbers per light."""
        return self

    def stored(self) -> dict[str, Any]:
        """Return the fields of every palette, with `excitation_nm` (Li,) and `donaldson` (L,Li)."""
        surface = self.bispectral
        kept: dict[str, Any] = {"basis": self.basis.name, "spectral": self.values[0]}
        kept |= {"wavelengths_nm": self.wavelengths_nm, "excitation_nm": surface.wavelengths_in_nm}
        return kept | {"donaldson": surface.matrix}


@dataclass(frozen=True, eq=False)
class SentPalette(Palette):
    """Palette of the radiance of entries under one light, at fine wavelengths, as reflectances under equal energy.

    It contains the lines of the light, so that at coarser wavelengths it is averaged, not interpolated.
    """

    @classmethod
    def of_power(
        cls, palette: Palette, power: Float[np.ndarray, " L"], wavelengths_nm: Float[np.ndarray, " L"]
    ) -> SentPalette:
        """Make the palette of a spectral power at `wavelengths_nm`, which may be negative."""
        if isinstance(palette, DonaldsonPalette):
            samples = palette.values * (palette.bispectral.on(wavelengths_nm) @ power)
        else:
            samples = palette.samples @ interpolation_matrix(palette.wavelengths_nm, wavelengths_nm).T * power
        return cls(samples, SpectralBasis.sampled(wavelengths_nm))

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "P R L"]:
        """Implement `Palette.radiance`."""
        own = self.wavelengths_nm
        sent = self.values * light.resampled(own).samples
        if not is_finer(own, wavelengths_nm):
            return sent @ interpolation_matrix(own, wavelengths_nm).T
        return np.apply_along_axis(lambda one: tent_means(one, own, wavelengths_nm), -1, sent)
