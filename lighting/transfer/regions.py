"""Diffuse reflection of regions: groups of sites with the same reflectance.

With radiosity B (S sites, J coefficients), c_(k+1) = O G c_k, where G is the irradiance operator (`operator`) and O the
reflection operator of a region. Relative to the spectra of lights O = A^T diag(rho) B (`SpectralBasis.operator`), and
c_0 = rho E_0.

With fluorescence, coefficients cannot be relative to a light, since fluorescent emission is no multiple of its spectrum
(`spectral.radiance_basis`). They are of spectral power, Y = 1 for the perfect diffuser: c_0 = E_0 A^T D s, with the
light at its own resolution, and O = A^T D B, with D the Donaldson matrix of a region; XYZ is cmf^T B c, the same for
all lights.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.observers import Observer
from ...spectral.radiance_basis import radiance_operators
from ...spectral.spectrum import Spectrum

# Number of runs of sites above which operators are gathered per site, as for textures.
_MANY = 256


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions without fluorescence, with coefficients relative to the spectra of K lights.

    region (S,) : region of each site, among R. reflectances (R,L) : of each region, at the wavelengths of `basis`, in
        [0, 1).

    Raises
    ------
    InputError : a reflectance below 0, or of 1 or more, for which interreflection diverges.
    """

    region: Int[np.ndarray, " S"]
    reflectances: Float[np.ndarray, "R L"]
    basis: SpectralBasis

    def __post_init__(self) -> None:
        low, high = float(self.reflectances.min(initial=0.0)), float(self.reflectances.max(initial=0.0))
        if low < 0.0 or not high < 1.0:
            found = f"{low:.3g} to {high:.3g}"
            words = "0 to below 1 at every wavelength"
            raise InputError(
                "surfaces that reflect what they cannot", field="reflectances", found=found, expected=words
            )

    @property
    def largest(self) -> float:
        """Largest reflectance at any wavelength."""
        return float(self.reflectances.max(initial=0.0))

    def most_y(
        self, coefficients: Float[np.ndarray, "S K J"], seen_y: Float[np.ndarray, " S"], reference_lux: float
    ) -> Float[np.ndarray, " S"]:
        """Return the upper bound of Y after further bounces: `seen_y`."""
        return seen_y

    def first(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "S K J"]:
        """Return c_0 for an illuminance by each of K spectra."""
        return lux[:, :, None] * self.basis.project(self.reflectances)[self.region][:, None, :]

    def reflected(self, arriving: Float[np.ndarray, "S K J"]) -> Float[np.ndarray, "S K J"]:
        """Return O times the light incident at each site."""
        if self.basis.is_sampled:
            return arriving * self.reflectances[self.region][:, None, :]
        return _times(self._operators, self.region, self._runs, arriving)

    @cached_property
    def _operators(self) -> Float[np.ndarray, "R J J"]:
        return self.basis.operator(self.reflectances)

    @cached_property
    def _runs(self) -> list[tuple[slice, int]]:
        return _runs(self.region)


@dataclass(frozen=True, eq=False)
class RadiantRegions:
    """Regions with fluorescence, with coefficients of radiance; K lights may be summed.

    region (S,) : region of each site, among R. surfaces : of each region; a non-fluorescent one is
        `Bispectral.diagonal`.
    lights : K. basis : of radiances, as from `radiant.basis_for`.

    Raises
    ------
    InputError : a surface that returns all power of some band or more, for which interreflection diverges.
    """

    region: Int[np.ndarray, " S"]
    surfaces: tuple[Bispectral, ...]
    lights: tuple[Spectrum, ...]
    observer: Observer
    basis: SpectralBasis

    def __post_init__(self) -> None:
        if not self.largest < 1.0:
            found, words = f"{self.largest:.3g} of the power of a band", "below 1 at every wavelength"
            raise InputError("surfaces that send out what they cannot", field="surfaces", found=found, expected=words)

    @cached_property
    def largest(self) -> float:
        """Largest power yield of any surface at any wavelength."""
        return max((float(surface.power_yield.max()) for surface in self.surfaces), default=0.0)

    @cached_property
    def _first(self) -> Float[np.ndarray, "R K J"]:
        """Coefficients of the first reflection of each region under 1 lux of each light."""
        nm, seen_by = self.basis.wavelengths_nm, self.observer
        each = [[one.radiance(light, nm) / seen_by.luminous(light) for light in self.lights] for one in self.surfaces]
        return self.basis.project(np.array(each))

    @cached_property
    def _operators(self) -> Float[np.ndarray, "R J J"]:
        matrices = [surface.narrow(self.basis.wavelengths_nm) for surface in self.surfaces]
        return radiance_operators(self.basis, matrices)

    @cached_property
    def _runs(self) -> list[tuple[slice, int]]:
        return _runs(self.region)

    def first(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "S K J"]:
        """Return c_0 for an illuminance by each of the K lights."""
        return lux[:, :, None] * self._first[self.region]

    def reflected(self, arriving: Float[np.ndarray, "S K J"]) -> Float[np.ndarray, "S K J"]:
        """Return O times the light incident at each site."""
        return _times(self._operators, self.region, self._runs, arriving)

    def folds(self) -> list[Float[np.ndarray, "3 J"]]:
        """Return the matrices from coefficients to XYZ, one for each light, all equal."""
        seen = self.observer.sensitivity(self.basis.wavelengths_nm)
        fold = seen if self.basis.is_sampled else seen @ self.basis.synthesis
        return [fold] * len(self.lights)

    def most_y(
        self, coefficients: Float[np.ndarray, "S K J"], seen_y: Float[np.ndarray, " S"], reference_lux: float
    ) -> Float[np.ndarray, " S"]:
        """Return the upper bound of Y after further bounces: all power at the wavelength of highest sensitivity, as a
        dye may shift it.
        """
        best = best_seen(self.observer, self.basis.wavelengths_nm)
        each = best if self.basis.is_sampled else best @ self.basis.synthesis
        return coefficients.sum(axis=1) @ each / reference_lux


def best_seen(observer: Observer, wavelengths_nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, " L"]:
    """Return the Y of spectral power at each wavelength if it were shifted to the highest sensitivity, as a dye may
    do.
    """
    widths = np.gradient(wavelengths_nm)
    return widths * float((observer.sensitivity(wavelengths_nm)[1] / widths).max())


def _runs(region: Int[np.ndarray, " S"]) -> list[tuple[slice, int]]:
    """Return runs of consecutive sites of the same region, and that region."""
    edges = [0, *(np.flatnonzero(np.diff(region)) + 1).tolist(), len(region)]
    return [(slice(a, b), int(region[a])) for a, b in itertools.pairwise(edges) if a < b]


def _times(
    operators: Float[np.ndarray, "R J J"],
    region: Int[np.ndarray, " S"],
    runs: list[tuple[slice, int]],
    arriving: Float[np.ndarray, "S K J"],
) -> Float[np.ndarray, "S K J"]:
    """Multiply each site's operator with the light incident there."""
    if len(runs) > _MANY:
        return np.einsum("ski,sji->skj", arriving, operators.astype(arriving.dtype)[region])
    found = np.empty_like(arriving)
    for mine, number in runs:
        # One product for the whole run.
        sites, operator = arriving[mine], operators[number].T.astype(arriving.dtype)
        found[mine] = (sites.reshape(-1, sites.shape[2]) @ operator).reshape(sites.shape)
    return found
