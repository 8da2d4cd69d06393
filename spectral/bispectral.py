"""Fluorescent surfaces: light absorbed at one wavelength and emitted at a longer one.

A Donaldson matrix D (Donaldson 1954; ASTM E2153) maps a light s to the radiance D s. The diagonal is an ordinary
reflectance and is treated as one. The rest is a sum over *bands of excitation*: entry [out, in] is spectral power at
`out` per unit of mean spectral power in the band around `in`. Power, not photons: a matrix of photon counts becomes one
of power when entry [out, in] is multiplied by lambda_in / lambda_out (`from_photons`).

The radiance of a fluorescent surface is not a multiple of the light, wavelength by wavelength: where the light is dark,
radiance over light is infinite. So it has no reflectance here. For direct light,

    XYZ = cmf^T D s / (y-bar . s)

is three numbers per surface and light (`Bispectral.fold`), exact, with the light at its own resolution; for indirect
light, see `radiance_basis`, whose coefficients are of radiance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths
from .observers import Observer
from .spectrum import Spectrum, check_values
from .wavelengths import interpolation_matrix, validated_wavelengths

#: Largest emission at a wavelength shorter than the absorbed one that passes for noise of the measurement.
ANTI_STOKES_TOLERANCE = 1e-3
# Matrices on other grids that are kept: some 2 MB each of a surface that fluoresces.
_KEPT = 64
# Gauss-Legendre nodes of an interval from 0 to 1: two are exact for the product of two straight lines.
_GAUSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)


@dataclass(frozen=True, eq=False)
class Bispectral:
    """A Donaldson matrix with its two wavelength axes.

    Parameters
    ----------
    wavelengths_in_nm : (Li,) of the absorbed light, ascending, two or more.
    wavelengths_out_nm : (Lo,) of the outgoing light; each is also one of `wavelengths_in_nm`, where the diagonal is.
    matrix : (Lo,Li) power for power, band for band (see the module's text); >= 0, the diagonal at most 1.

    Emission is linear between samples and 0 beyond them; each band of excitation weights the light by a tent over the
        neighbouring wavelengths, the outermost two extended by half a step. Excitation outside `wavelengths_in_nm` was
        not measured and is taken as 0.

    Raises
    ------
    InputError
        Not finite, negative, a reflectance above 1, emission at wavelengths shorter than absorbed by more than
        `ANTI_STOKES_TOLERANCE`, or more power out of a band than into it.

    Examples
    --------
    >>> nm = np.array([400.0, 500.0, 600.0])
    >>> dye = Bispectral(nm, nm, np.array([[0.2, 0, 0], [0.3, 0.5, 0], [0, 0, 0.9]]))
    >>> dye.reflectance.samples.tolist(), dye.power_yield.tolist()
    ([0.2, 0.5, 0.9], [0.5, 0.5, 0.9])
    """

    wavelengths_in_nm: Float[np.ndarray, "Li"]
    wavelengths_out_nm: Float[np.ndarray, "Lo"]
    matrix: Float[np.ndarray, "_ _"]

    def __post_init__(self) -> None:
        into, out = (
            validated_wavelengths(getattr(self, f), field=f) for f in ("wavelengths_in_nm", "wavelengths_out_nm")
        )
        matrix = np.array(self.matrix, dtype=np.float64)
        if matrix.shape != (out.size, into.size) or into.size < 2:
            raise InputError(
                "a Donaldson matrix does not fit its wavelengths",
                field="matrix",
                found=f"shape {matrix.shape}",
                expected=f"({out.size}, {into.size}): rows are what leaves, columns two or more bands that excite",
            )
        object.__setattr__(self, "wavelengths_in_nm", into)
        object.__setattr__(self, "wavelengths_out_nm", out)
        object.__setattr__(self, "matrix", matrix)
        missing = out[~np.isin(out, into)]
        if missing.size:
            raise InputError(
                "no reflectance where light leaves",
                field="wavelengths_out_nm",
                found=f"{missing[0]:g} nm",
                expected="each among wavelengths_in_nm",
            )
        _check_entries(matrix, into, out)
        check_values(self._diagonal, out, "reflectance", field="diagonal")
        power = self.power_yield
        if power.max() > 1.0 + 1e-6:
            raise InputError(
                "more power leaves than arrives",
                field="matrix",
                found=f"{power.max():.4g} of the light at {into[power.argmax()]:g} nm",
                expected="at most 1",
                hint="photon counts need `from_photons`, values per nm the width of a band",
            )

    @classmethod
    def from_photons(
        cls, wavelengths_in_nm: Wavelengths, wavelengths_out_nm: Wavelengths, matrix: Float[np.ndarray, "Lo Li"]
    ) -> Bispectral:
        """Convert a matrix of photon counts, out of a band per photon into it."""
        return cls(wavelengths_in_nm, wavelengths_out_nm, matrix * wavelengths_in_nm / wavelengths_out_nm[:, None])

    @classmethod
    def diagonal(cls, reflectance: Spectrum) -> Bispectral:
        """Return an ordinary surface as a Donaldson matrix, without fluorescence."""
        grid = reflectance.wavelengths_nm
        if reflectance.quantity != "reflectance" or reflectance.samples.ndim != 1:
            raise InputError(
                "not one reflectance",
                field="reflectance",
                found=f"{reflectance.quantity} of shape {reflectance.samples.shape}",
                expected="one reflectance spectrum",
            )
        return cls(grid, grid, np.diag(reflectance.samples))

    @cached_property
    def _own_column(self) -> np.ndarray:
        return np.searchsorted(self.wavelengths_in_nm, self.wavelengths_out_nm)

    @cached_property
    def _diagonal(self) -> np.ndarray:
        return self.matrix[np.arange(len(self._own_column)), self._own_column]

    @cached_property
    def reflectance(self) -> Spectrum:
        """Reflectance without fluorescence: the diagonal."""
        return Spectrum.sampled(self.wavelengths_out_nm, self._diagonal, "reflectance")

    @cached_property
    def reradiation(self) -> Float[np.ndarray, "Lo Li"]:
        """Fluorescent part: the matrix without its diagonal."""
        shifted = self.matrix.copy()
        shifted[np.arange(len(self._own_column)), self._own_column] = 0.0
        return shifted

    @cached_property
    def power_yield(self) -> Float[np.ndarray, " Li"]:
        """Fraction of the power of each band of excitation that is reflected or emitted, at any wavelength."""
        return self._yield(np.ones_like)

    @cached_property
    def photon_yield(self) -> Float[np.ndarray, " Li"]:
        """Fraction of the photons of each band that are reflected or emitted; above 1 the measurement is doubtful."""
        return self._yield(lambda wavelengths: wavelengths)

    def _yield(self, weight) -> np.ndarray:
        into, out = self.wavelengths_in_nm, self.wavelengths_out_nm
        ratio = (band_widths(out) * weight(out))[:, None] / (band_widths(into) * weight(into))
        found = (self.reradiation * ratio).sum(axis=0)
        found[self._own_column] += self._diagonal
        return found

    @cached_property
    def keeps_wavelengths(self) -> bool:
        """True for an ordinary surface, without fluorescence."""
        return not self.reradiation.any()

    def without_emission(self) -> Bispectral:
        """Return the same surface with its fluorescence taken away: the diagonal alone."""
        return Bispectral.diagonal(self.reflectance)

    def excitation(self, light: Spectrum) -> Float[np.ndarray, " Li"]:
        """Compute the mean spectral power of `light` in each band, integrated exactly at the light's own resolution.

        The light is linear between its samples and clamped beyond them, as everywhere: a lamp without ultraviolet needs
        zeros there, not an early end.
        """
        if light.quantity != "emission" or light.samples.ndim != 1:
            raise InputError("not a light", field="light", found=light.quantity, expected="one emission spectrum")
        source, into = light.wavelengths_nm, self.wavelengths_in_nm
        ends = _outer_edges(into)
        knots = np.union1d(source[(source > ends[0]) & (source < ends[1])], np.append(into, ends))
        steps = np.diff(knots)[:, None]
        at = (knots[:-1, None] + steps * _GAUSS).ravel()
        power = interpolation_matrix(source, at, "hold", "linear") @ light.samples
        tents = interpolation_matrix(into, at, "hold", "linear")
        return (power * np.repeat(0.5 * steps.ravel(), 2)) @ tents / band_widths(into)

    def emission(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, " L"]:
        """Compute the spectral power of fluorescence, in the light's own unit."""
        spread = interpolation_matrix(self.wavelengths_out_nm, wavelengths_nm, "zero", "linear")
        return spread @ (self.reradiation @ self.excitation(light))

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, " L"]:
        """Compute D s, fluorescence included: pi times the radiance of a diffuse surface, in the light's own unit."""
        kept = self._kept(wavelengths_nm) * light.averaged(wavelengths_nm).samples
        return kept if self.keeps_wavelengths else kept + self.emission(light, wavelengths_nm)

    def _kept(self, wavelengths_nm: Wavelengths) -> Float[np.ndarray, " L"]:
        return interpolation_matrix(self.wavelengths_out_nm, wavelengths_nm) @ self._diagonal

    def fold_emission(self, light: Spectrum, observer: Observer) -> Float[np.ndarray, "3"]:
        """Compute XYZ of the fluorescence; Y of the perfect diffuser under `light` is 1."""
        sensitivity = observer.sensitivity(self.wavelengths_out_nm)
        return sensitivity @ (self.reradiation @ self.excitation(light)) / observer.luminous(light)

    def fold(self, light: Spectrum, observer: Observer) -> Float[np.ndarray, "3"]:
        """Compute XYZ = cmf^T D s of the surface under `light`; Y of the perfect diffuser is 1, and may be exceeded."""
        kept = observer.weights(light, self.wavelengths_out_nm) @ self._diagonal
        return kept + self.fold_emission(light, observer)

    def on(self, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "L L"]:
        """Return the Donaldson matrix on one common grid; on the surface's own it is `matrix` itself.

        Excitation is distributed to the bands of the grid, so that D @ s is `radiance` wherever the grid resolves s.
        """
        into, out = self.wavelengths_in_nm, self.wavelengths_out_nm
        if np.array_equal(wavelengths_nm, into) and np.array_equal(wavelengths_nm, out):
            return self.matrix.copy()
        low, high = _outer_edges(into)
        share = np.where((wavelengths_nm < low) | (wavelengths_nm > high), 0.0, band_widths(wavelengths_nm))
        share[(wavelengths_nm == low) | (wavelengths_nm == high)] *= 0.5
        tents = interpolation_matrix(into, wavelengths_nm, "hold", "linear") * share[:, None] / band_widths(into)
        spread = interpolation_matrix(out, wavelengths_nm, "zero", "linear")
        return np.diag(self._kept(wavelengths_nm)) + spread @ self.reradiation @ tents.T

    def narrow(self, wavelengths_nm: Wavelengths) -> np.ndarray:
        """Return `on` (L,L), or only the diagonal (L,) of a surface without fluorescence; read-only."""
        return _narrow(self, wavelengths_nm.tobytes())


@lru_cache(maxsize=_KEPT)
def _narrow(surface: Bispectral, wavelengths_nm: bytes) -> np.ndarray:
    nm = np.frombuffer(wavelengths_nm)
    found = surface._kept(nm) if surface.keeps_wavelengths else surface.on(nm)
    found.flags.writeable = False
    return found


def fluorophore(
    reflectance: Spectrum,
    absorption: Float[np.ndarray, " L"],
    emission: Float[np.ndarray, " L"],
    photon_yield: float,
) -> Bispectral:
    """Make a dye in a matt base: fraction `absorption` (L,) of the light is absorbed, `photon_yield` of it re-emitted.

    Photons are distributed over `emission` (L,), of any scale, on the uniform wavelengths of `reflectance`. Emission at
    or below the absorbed wavelength is omitted, and the rest scaled to the yield: a pure substance with one fluorescent
    state (Kasha's rule), as in Glassner 1995, eq. 6.
    """
    grid = reflectance.wavelengths_nm
    spread = np.tril(np.repeat(np.asarray(emission, np.float64)[:, None], grid.size, axis=1), -1)
    total = spread.sum(axis=0)
    spread = np.divide(spread, total, out=np.zeros_like(spread), where=total > 0)
    photons = photon_yield * spread * np.asarray(absorption, np.float64)
    return Bispectral.from_photons(grid, grid, photons + np.diag(reflectance.samples))


def band_widths(wavelengths_nm: Wavelengths) -> Float[np.ndarray, " L"]:
    """Compute the width of the band around each sample, nm, midpoint to midpoint; the outermost are symmetric."""
    steps = np.diff(wavelengths_nm)
    return 0.5 * (np.append(steps[0], steps) + np.append(steps, steps[-1]))


def _outer_edges(wavelengths_nm: np.ndarray) -> tuple[float, float]:
    steps = np.diff(wavelengths_nm)
    return float(wavelengths_nm[0] - 0.5 * steps[0]), float(wavelengths_nm[-1] + 0.5 * steps[-1])


def _check_entries(matrix: np.ndarray, into: np.ndarray, out: np.ndarray) -> None:
    def refuse(problem: str, bad: np.ndarray, expected: str, hint: str | None = None) -> None:
        if bad.any():
            row, column = np.argwhere(bad)[0]
            found = f"{matrix[row, column]:g} from {into[column]:g} to {out[row]:g} nm"
            raise InputError(problem, field="matrix", found=found, expected=expected, hint=hint)

    refuse("re-radiation is not a number", ~np.isfinite(matrix), "finite values")
    refuse("re-radiation is negative", matrix < 0, ">= 0", "subtract the dark reading properly")
    refuse(
        "light leaves at a shorter wavelength than it was absorbed at",
        (out[:, None] < into) & (matrix > ANTI_STOKES_TOLERANCE),
        f"at most {ANTI_STOKES_TOLERANCE:g}",
        "rows are what leaves, columns what is absorbed; transpose the matrix",
    )
