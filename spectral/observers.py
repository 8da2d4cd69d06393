"""CIE standard observers, and folding a light with one of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError, UnknownNameError
from .axis_letters import Wavelengths, White
from .colour_library import colour_tables
from .illuminants import as_light
from .spectrum import Spectrum
from .wavelengths import interpolation_matrix, is_finer, times_interpolation

#: Short name -> colour-science key.
OBSERVERS = {
    "1931_2": "CIE 1931 2 Degree Standard Observer",
    "1964_10": "CIE 1964 10 Degree Standard Observer",
    "2015_2": "CIE 2015 2 Degree Standard Observer",
    "2015_10": "CIE 2015 10 Degree Standard Observer",
}
#: Short names by the angle or the year alone, as people and files write them: observers of CIE 15, before CIE 170.
ANGLES = {"2": "1931_2", "1931": "1931_2", "10": "1964_10", "1964": "1964_10"}
#: Maximum luminous efficacy, lm/W (CIE 015:2018, K_m).
EFFICACY = 683.002
# Lights and wavelengths whose weights are kept: whatever is lit again and again asks for the same few.
_KEPT = 256


@dataclass(frozen=True, eq=False)
class Observer:
    """Colour-matching functions x-bar, y-bar, z-bar.

    Parameters
    ----------
    name : colour-science's key.
    wavelengths_nm : (L,) nm; outside, the functions are zero.
    cmfs : (L,3).
    """

    name: str
    wavelengths_nm: Float[np.ndarray, "L"]
    cmfs: Float[np.ndarray, "L 3"]

    def weights(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "3 L"]:
        """Compute the matrix with XYZ = weights @ r for r sampled on `wavelengths_nm`; Y of the perfect diffuser is 1.

        The integral includes every wavelength at which the light or the observer is tabulated, with the light (linear
        between its samples, clamped beyond them) and the observer, zero beyond its table, each at its own resolution; r
        is interpolated onto them and clamped. If r is finer than the observer's table, every sample of it counts, and
        its weight is linear between those wavelengths. Equals CIE 015:2018 eq. (7.1) with k chosen so that Y = 1 for r
        = 1.

        Raises
        ------
        InputError
            The light is no emission spectrum, has a single sample, does not overlap the observer's range, or is
            invisible to this observer.
        """
        if light.quantity != "emission" or light.samples.ndim != 1:
            raise InputError(
                "not a light",
                field="light",
                found=f"{light.quantity} of shape {light.samples.shape}",
                expected="one emission spectrum",
            )
        if light.wavelengths_nm.size < 2:
            raise InputError(
                "a light of one sample has no spectrum",
                field="light",
                found=f"{light.wavelengths_nm[0]:g} nm alone",
                expected="two wavelengths or more",
                hint="write a line as three samples 1 nm apart: 0, 1, 0",
            )
        low, high = light.wavelengths_nm[[0, -1]]
        if low >= self.wavelengths_nm[-1] or high <= self.wavelengths_nm[0]:
            raise InputError(
                "the light is not known where the observer sees",
                field="light",
                found=f"{low:g} to {high:g} nm",
                expected=f"some of {self.wavelengths_nm[0]:g} to {self.wavelengths_nm[-1]:g} nm",
            )
        values = (light.samples, light.wavelengths_nm, wavelengths_nm)
        return _weights(self, *(np.asarray(each, dtype=np.float64).tobytes() for each in values)).copy()

    def luminous(self, light: Spectrum) -> float:
        """Integrate y-bar times `light`, the divisor of `weights`: in the light's unit times nm, not lm."""
        return float(self._folded(light)[1][:, 1].sum())

    def sensitivity(self, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "3 L"]:
        """Compute the matrix of the integral of cmf times v = sensitivity @ v.

        v is linear between `wavelengths_nm`, zero beyond.
        """
        functions = self.cmfs * _trapezoid(self.wavelengths_nm)[:, None]
        return functions.T @ interpolation_matrix(wavelengths_nm, self.wavelengths_nm, "zero", "linear")

    def _folded(self, light: Spectrum, unit: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return the wavelengths of the tables of light and observer, and light / unit x cmf x step (n,3) there."""
        grid = np.union1d(self.wavelengths_nm, light.wavelengths_nm)
        grid = grid[(grid >= self.wavelengths_nm[0]) & (grid <= self.wavelengths_nm[-1])]
        power = interpolation_matrix(light.wavelengths_nm, grid, "hold", "linear") @ (light.samples / unit)
        functions = interpolation_matrix(self.wavelengths_nm, grid, "zero", "linear") @ self.cmfs
        return grid, (power * _trapezoid(grid))[:, None] * functions

    def white(self, light: object) -> White:
        """Compute XYZ (3,) of the perfect diffuser, Y = 1, under a light as of `illuminants.as_light`."""
        light = as_light(light)
        return self.weights(light, light.wavelengths_nm).sum(axis=1)


@lru_cache(maxsize=_KEPT)
def _weights(seen_by: Observer, samples: bytes, light_nm: bytes, to_nm: bytes) -> np.ndarray:
    """Compute `Observer.weights`, cached by the light's values, so that a light changed in place is a new one."""
    light, wavelengths_nm = Spectrum(np.frombuffer(samples), np.frombuffer(light_nm), "emission"), np.frombuffer(to_nm)
    # Relative to its peak, which cancels below: neither very large nor very small units leave float64.
    grid, folded = seen_by._folded(light, max(float(light.samples.max()), np.finfo(np.float64).tiny))
    luminous = folded[:, 1].sum()
    if not luminous > 0:
        raise InputError(
            "the light has zero power",
            field="light",
            found=f"Y = {luminous:g} for {seen_by.name}",
            expected="some power between 360 and 830 nm",
            hint="switch the light off in the scene instead",
        )
    if is_finer(wavelengths_nm, seen_by.wavelengths_nm):
        grid, folded = _refined(grid, folded, wavelengths_nm)
    return times_interpolation((folded / luminous).T, wavelengths_nm, grid)


def _refined(grid: np.ndarray, folded: np.ndarray, finer_nm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distribute an integral (n,3) over the wavelengths of a finer grid too; its sum, the white, does not change."""
    inside = finer_nm[(finer_nm > grid[0]) & (finer_nm < grid[-1])]
    both = np.union1d(grid, inside)
    density = (folded / _trapezoid(grid)[:, None]).T
    return both, np.stack([np.interp(both, grid, one) for one in density], axis=1) * _trapezoid(both)[:, None]


def _trapezoid(grid: np.ndarray) -> np.ndarray:
    """Compute quadrature weights (L,) of the trapezoid rule on an uneven grid."""
    steps = np.diff(grid)
    return 0.5 * (np.concatenate([steps, [0.0]]) + np.concatenate([[0.0], steps]))


def observer_name(name: str) -> str:
    """Return the short name of a standard observer, from that itself, colour-science's key, or its angle or year alone.

    >>> observer_name("10°"), observer_name("CIE 1931"), observer_name("cie 2015 10 degree standard observer")
    ('1964_10', '1931_2', '2015_10')
    """
    if not isinstance(name, str):
        raise InputError(
            "not the name of an observer", field="observer", found=repr(name)[:80], expected='a name, such as "1931_2"'
        )
    folded = name.strip().casefold()
    short = {key.casefold(): short for short, key in OBSERVERS.items()}.get(folded)
    short = short or ANGLES.get(folded.removeprefix("cie").rstrip("°").strip(), folded)
    if short not in OBSERVERS:
        raise UnknownNameError("observer", name, [*OBSERVERS, *OBSERVERS.values()])
    return short


def observer_title(name: str) -> str:
    """Return an observer's title, from its short name or colour-science's key; any other name stays.

    >>> observer_title("1964_10"), observer_title("CIE 1931 2 Degree Standard Observer")
    ('CIE 1964 10°', 'CIE 1931 2°')
    """
    return OBSERVERS.get(name, name).replace(" Degree Standard Observer", "°")


def observer(name: str) -> Observer:
    """Standard observer by short name ("1931_2", "1964_10", "2015_2", "2015_10"), by colour-science's key, or by angle
    or year ("2", "10°", "CIE 1931", "1964").

    >>> observer("1964_10").name
    'CIE 1964 10 Degree Standard Observer'
    """
    return _observer(observer_name(name))


@cache
def _observer(short: str) -> Observer:
    key = OBSERVERS[short]
    return Observer(key, *colour_tables("MSDS_CMFS")[key])
