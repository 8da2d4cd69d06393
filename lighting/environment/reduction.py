"""Reduction of many light spectra to non-negative combinations of a few, within a colour difference.

A non-negative matrix factorisation, initialised with spectra of the light itself near the corners of the cone that
contains all others. Errors are measured in the tristimulus values of reflectances under the light, for the CIE 1931 and
1964 observers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float

from ...spectral.axis_letters import Wavelengths
from ...spectral.colour_library import colour_science
from ...spectral.difference import delta_e_xyz
from ...spectral.observers import Observer, observer

#: Error budget of the reduction: ΔE94, largest over reflectances, 99th percentile over samples of the light.
BUDGET_DELTA_E94 = 0.25
#: Largest number of spectra of a reduction; the remaining error is reported.
MOST_SPECTRA = 8
# Singular values of the colours below this share of the largest are rounding.
_RANK = 1e-6
# Non-negative fit: largest number of exchanges per spectrum, full exchanges that may fail in a row, and the share
# treated as 0.
_EXCHANGES, _FULL_EXCHANGES, _ROUNDING = 20, 3, 1e-10
# Largest number of alternations of spectra and shares, and the change, relative to the largest sample, at which they
# stop.
_TURNS, _SETTLED = 30, 1e-5
# Largest distance from the mean at which a spectrum begins, relative to that of its sample.
_REACH = 4.0
_OBSERVERS = ("1931_2", "1964_10")
# Floor of a white's tristimulus values, as a share of its Y: Lab divides by them.
_LEAST_WHITE = 1e-6


@cache
def reflectances() -> tuple[Float[np.ndarray, "R M"], Float[np.ndarray, " M"]]:
    """Return the test reflectances, the perfect diffuser and the 24 patches of a ColorChecker, and their wavelengths,
    nm.
    """
    chart = colour_science().SDS_COLOURCHECKERS["BabelColor Average"]
    wavelengths_nm = np.arange(380.0, 731.0, 10.0)
    patches = [np.interp(wavelengths_nm, one.wavelengths, one.values) for one in chart.values()]
    return np.stack([np.ones(wavelengths_nm.size), *patches]), wavelengths_nm


def xyz_of_samples(
    seen_by: Observer,
    wavelengths_nm: Wavelengths,
    surfaces: Float[np.ndarray, "R M"] | None = None,
    surfaces_nm: Float[np.ndarray, " M"] | None = None,
) -> Float[np.ndarray, "R 3 L"]:
    """Return matrices with XYZ = M[r] @ light, for light sampled at `wavelengths_nm` and reflected by surface r.

    As `Observer.weights`, but not normalised: the light is linear between its samples and constant beyond them, the
    observer is zero beyond its table. Without surfaces the light itself is seen (R = 1).
    """
    low, high = seen_by.wavelengths_nm[[0, -1]]
    grid = np.union1d(seen_by.wavelengths_nm, wavelengths_nm)
    grid = grid[(grid >= low) & (grid <= high)]
    steps = np.diff(grid)
    widths = 0.5 * (np.concatenate([steps, [0.0]]) + np.concatenate([[0.0], steps]))
    functions = np.stack([np.interp(grid, seen_by.wavelengths_nm, one) for one in seen_by.cmfs.T]) * widths
    if surfaces is None or surfaces_nm is None:
        factors = np.ones((1, grid.size))
    else:
        factors = np.stack([np.interp(grid, surfaces_nm, one) for one in surfaces])
    # Hat functions: each sample of the light on the grid, its ends held.
    hats = np.stack([np.interp(grid, wavelengths_nm, row) for row in np.eye(wavelengths_nm.size)], axis=-1)
    return np.einsum("rm,cm,ml->rcl", factors, functions, hats, optimize=True)


@dataclass(frozen=True, eq=False)
class Reduction:
    """Basis of K spectra that replaces many.

    Parameters
    ----------
    spectra : (K,L), not negative, at `wavelengths_nm`.
    delta_e94 : 99th percentile over the samples of the light used to choose them, and the largest; of each sample the
        worst reflectance.
    """

    spectra: Float[np.ndarray, "K L"]
    wavelengths_nm: Wavelengths
    delta_e94: tuple[float, float] = (0.0, 0.0)

    def shares(self, samples: Float[np.ndarray, "n L"]) -> Float[np.ndarray, "n K"]:
        """Fit non-negative shares with samples ≈ shares @ spectra, nearest in tristimulus values of reflectances."""
        towards = _metric(self.wavelengths_nm).towards
        return _non_negative(samples @ towards.T, self.spectra @ towards.T)

    def at_peak_one(self) -> Reduction:
        """Return the spectra scaled to a largest sample of 1."""
        return replace(self, spectra=self.spectra / self.spectra.max(axis=1, keepdims=True))


def fewest_spectra(
    samples: Float[np.ndarray, "n L"],
    wavelengths_nm: Wavelengths,
    levels: Float[np.ndarray, " n"] | None = None,
    budget_delta_e94: float = BUDGET_DELTA_E94,
    most: int = MOST_SPECTRA,
) -> Reduction:
    """Find the fewest spectra that reproduce all of `samples`, equally weighted, within the budget.

    The mean alone if that suffices; else the number that suffices without the sign constraint, increased by one until
    non-negative spectra suffice. The error is ΔE94 of each of the `reflectances` under a sample's light and under its
    reproduction, in Lab relative to the mean light's white; of each sample the worst.

    Parameters
    ----------
    samples : light, not negative, at least one with a luminance.
    levels : luminance at which each is seen, relative to white; None for 1.
    most : largest number of spectra, even if over the budget.
    """
    luminance = samples @ xyz_of_samples(observer("1931_2"), wavelengths_nm)[0, 1]
    some = luminance > 0.0
    even = samples[some] / luminance[some, None]
    seen = even if levels is None else even * levels[some, None]
    metric = _metric(wavelengths_nm)
    wanted = seen @ metric.towards.T
    found = _judged(Reduction(seen.mean(axis=0)[None], wavelengths_nm), seen)
    if found.delta_e94[0] <= budget_delta_e94:
        return found
    most = min(most, len(seen))
    for count in range(min(_fewest(metric, wanted, budget_delta_e94), most), most + 1):
        starts = [_corners(even, even @ metric.towards.T, count)]
        if len(found.spectra) == count - 1 > 1:
            shown = found.shares(seen) @ (found.spectra @ metric.towards.T)
            worst = int(np.argmax(metric.delta_e94(wanted, shown)))
            starts.insert(0, np.concatenate([found.spectra, seen[worst, None] / seen[worst].max()]))
        for begun in starts:
            tried = _judged(_improved(Reduction(begun, wavelengths_nm), seen), seen)
            found = tried if tried.delta_e94 < found.delta_e94 else found
            if found.delta_e94[0] <= budget_delta_e94:
                return found
    return found


def _fewest(metric: _Metric, wanted: np.ndarray, budget_delta_e94: float) -> int:
    """Count the spectra needed within the budget without the sign constraint: a lower bound for non-negative ones."""
    left, singular, right = np.linalg.svd(wanted, full_matrices=False)
    for count in range(2, singular.size):
        shown = (left[:, :count] * singular[:count]) @ right[:count]
        if np.percentile(metric.delta_e94(wanted, shown), 99.0) <= budget_delta_e94:
            return count
    return max(2, singular.size)


def _corners(seen: np.ndarray, wanted: np.ndarray, count: int) -> np.ndarray:
    """Choose initial spectra: the sample farthest from the mean, then repeatedly the one farthest from the affine hull
    of those before; all are moved away from the mean until a wavelength reaches 0.
    """
    chosen = [int(np.argmax(np.sum((wanted - wanted.mean(axis=0)) ** 2, axis=1)))]
    rest = wanted - wanted[chosen[0]]
    while len(chosen) < count:
        farthest = int(np.argmax(np.sum(rest**2, axis=1)))
        chosen.append(farthest)
        away = rest[farthest]
        squared = float(away @ away)
        if squared > 0.0:
            rest = rest - np.outer(rest @ away / squared, away)
    corners, middle = seen[chosen], seen.mean(axis=0)
    inward = middle - corners
    reach = np.divide(middle, inward, out=np.full_like(inward, _REACH), where=inward > 0.0).min(axis=1)
    return np.maximum(middle + np.clip(reach, 1.0, _REACH)[:, None] * (corners - middle), 0.0)


def _improved(found: Reduction, seen: np.ndarray) -> Reduction:
    """Refine spectra and shares by alternating least squares (hierarchical, Cichocki and Phan 2009)."""
    spectra = found.spectra.copy()
    for _ in range(_TURNS):
        shares = Reduction(spectra, found.wavelengths_nm).shares(seen)
        gram, towards, before = shares.T @ shares, shares.T @ seen, spectra.copy()
        for k in range(len(spectra)):
            if gram[k, k] > 0.0:
                at = np.maximum(spectra[k] + (towards[k] - gram[k] @ spectra) / gram[k, k], 0.0)
                spectra[k] = at if at.any() else spectra[k]
        if np.abs(spectra - before).max() <= _SETTLED * spectra.max():
            break
    return Reduction(spectra, found.wavelengths_nm)


def _judged(found: Reduction, seen: np.ndarray) -> Reduction:
    metric = _metric(found.wavelengths_nm)
    errors = metric.delta_e94(seen @ metric.towards.T, found.shares(seen) @ (found.spectra @ metric.towards.T))
    return replace(found, delta_e94=(float(np.percentile(errors, 99.0)), float(errors.max())))


@dataclass(frozen=True, eq=False)
class _Metric:
    """Projection of a light onto the tristimulus values of all reflectances, in the fewest coordinates.

    towards (Q,L) : coordinates from a light. rows (O, 3 R, Q) : tristimulus values from coordinates, for each observer.
    """

    towards: Float[np.ndarray, "Q L"]
    rows: Float[np.ndarray, "O V Q"]

    def delta_e94(self, truth: Float[np.ndarray, "n Q"], shown: Float[np.ndarray, "n Q"]) -> Float[np.ndarray, " n"]:
        """Compute the largest ΔE94 over reflectances and observers for each light, given by its coordinates."""
        worst = np.zeros(len(truth))
        for rows in self.rows:
            true, kept = ((numbers @ rows.T).reshape(len(numbers), -1, 3) for numbers in (truth, shown))
            white = true[:, 0].mean(axis=0)
            white = np.maximum(white / white[1], _LEAST_WHITE)
            worst = np.maximum(worst, delta_e_xyz(true, kept, white).max(axis=1))
        return worst


def _metric(wavelengths_nm: Wavelengths) -> _Metric:
    return _metric_of(wavelengths_nm.tobytes())


@cache
def _metric_of(key: bytes) -> _Metric:
    wavelengths_nm = np.frombuffer(key)
    matrices = [xyz_of_samples(observer(name), wavelengths_nm, *reflectances()) for name in _OBSERVERS]
    rows = np.concatenate([one.reshape(-1, wavelengths_nm.size) for one in matrices])
    left, singular, right = np.linalg.svd(rows, full_matrices=False)
    kept = singular > _RANK * singular[0]
    return _Metric(singular[kept, None] * right[kept], left[:, kept].reshape(len(_OBSERVERS), -1, int(kept.sum())))


def _non_negative(wanted: Float[np.ndarray, "n Q"], parts: Float[np.ndarray, "K Q"]) -> Float[np.ndarray, "n K"]:
    """Minimise the squares of wanted - x @ parts over x >= 0: block principal pivoting (Kim and Park 2011, algorithm
    2).

    The set of zeros is guessed for all rows at once and exchanged where signs disagree; a row that does not converge is
    left to the slower active-set method of Lawson and Hanson.
    """
    lengths = np.sqrt(np.sum(parts**2, axis=1))
    parts = parts / lengths[:, None]
    gram, towards = parts @ parts.T, wanted @ parts.T
    rows, count = towards.shape
    # Pseudo-inverse for each set of free coefficients.
    choices = (np.arange(1 << count)[:, None] >> np.arange(count) & 1).astype(bool)
    both = choices[:, :, None] & choices[:, None]
    solving = np.linalg.pinv(np.where(both, gram, 0.0), hermitian=True) * both
    found, free = np.zeros((rows, count)), towards > 0.0
    rounding = _ROUNDING * np.abs(towards).max(axis=1, initial=0.0, keepdims=True)
    fewest, tries = np.full(rows, count + 1), np.full(rows, _FULL_EXCHANGES)
    left = np.arange(rows)
    for _ in range(_EXCHANGES * count):
        now, at = free[left], towards[left]
        found[left] = solved = (solving[now @ (1 << np.arange(count))] @ at[:, :, None])[:, :, 0]
        wrong = np.where(now, solved < -rounding[left], solved @ gram - at < -rounding[left])
        number = wrong.sum(axis=1)
        fewer = number < fewest[left]
        fewest[left] = np.minimum(fewest[left], number)
        tries[left] = np.where(fewer, _FULL_EXCHANGES, tries[left] - 1)
        last = np.zeros_like(wrong)
        last[np.arange(left.size), count - 1 - np.argmax(wrong[:, ::-1], axis=1)] = True
        free[left] = now ^ np.where((tries[left] > 0)[:, None], wrong, wrong & last)
        left = left[number > 0]
        if not left.size:
            break
    for row in left:
        from scipy.optimize import nnls

        found[row] = nnls(parts.T, wanted[row])[0]
    return np.maximum(found, 0.0) / lengths
