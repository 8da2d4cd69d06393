"""Many spectra of light as a few, each times a number that is not negative, as exact as colours need it.

A non-negative matrix factorisation: the few begin as spectra that the light itself has somewhere, corners of the cone
in which all others lie, and move from there. What counts is what the light shows: tristimulus values of reflectances,
for the CIE 1931 and 1964 observers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from ...spectral.axis_letters import Wavelengths
from ...spectral.colour_library import colour_science
from ...spectral.difference import delta_e_xyz
from ...spectral.observers import Observer, observer

#: What the reduction may cost: ΔE94 of reflectances, the 99th percentile over the light.
BUDGET_DELTA_E94 = 0.25
#: No light is reduced to more spectra than these; what that costs is said.
MOST_SPECTRA = 8
# Directions of the colours that are smaller than this share of the largest are rounding.
_RANK = 1e-6
# The non-negative fit: exchanges a spectrum at the most, exchanges that may fail in a row, and what is 0.
_EXCHANGES, _FULL_EXCHANGES, _ROUNDING = 20, 3, 1e-10
# How often the spectra and their shares are improved in turn.
_TURNS = 40
# A white without some tristimulus value has none to compare; this share of its Y stands in for it.
_LEAST_WHITE = 1e-6


@cache
def reflectances() -> tuple[Float[np.ndarray, "R M"], Float[np.ndarray, " M"]]:
    """What the light is judged by, and wavelengths in nm: the perfect diffuser and the 24 patches of a ColorChecker."""
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
    """Matrices with XYZ = M[r] @ light, for light sampled at `wavelengths_nm`, thrown back by surface r.

    As `Observer.weights` has it, but not normalised: the light is linear between its samples and held beyond them, the
    observer is zero beyond its table. Without surfaces the light is seen itself (R = 1).
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
    # Hat functions: what each sample of the light makes of itself on the grid, its ends held.
    hats = np.stack([np.interp(grid, wavelengths_nm, row) for row in np.eye(wavelengths_nm.size)], axis=-1)
    return np.einsum("rm,cm,ml->rcl", factors, functions, hats, optimize=True)


@dataclass(frozen=True, eq=False)
class Reduction:
    """K spectra for many.

    Parameters
    ----------
    spectra : (K,L), not negative, at `wavelengths_nm`.
    delta_e94 : of the light that they were chosen by, the 99th percentile, and the largest, over reflectances.
    """

    spectra: Float[np.ndarray, "K L"]
    wavelengths_nm: Wavelengths
    delta_e94: tuple[float, float] = (0.0, 0.0)

    def shares(self, samples: Float[np.ndarray, "n L"]) -> Float[np.ndarray, "n K"]:
        """Numbers, not negative, with samples ≈ shares @ spectra, nearest in tristimulus values of reflectances."""
        metric = _metric(self.wavelengths_nm)
        return _non_negative(samples @ metric.T, self.spectra @ metric.T)

    def at_peak_one(self) -> Reduction:
        """The same spectra, the largest sample of each 1."""
        return replace(self, spectra=self.spectra / self.spectra.max(axis=1, keepdims=True))


def reduced(
    samples: Float[np.ndarray, "n L"],
    wavelengths_nm: Wavelengths,
    budget_delta_e94: float = BUDGET_DELTA_E94,
    most: int = MOST_SPECTRA,
) -> Reduction:
    """The fewest spectra that show all of `samples`, each of which counts the same, within the budget.

    The mean alone where that will do; else one more at a time, the sample that is farthest from what those before it
    can mix, and all of them improved. The error is ΔE94 of each of the `reflectances` under one sample's light and
    what stands for it, in Lab relative to the mean light's white at that sample's luminance; of each sample the worst.

    Parameters
    ----------
    samples : light, not negative, at least one with a luminance.
    most : spectra, at which it ends over the budget.
    """
    luminance = samples @ xyz_of_samples(observer("1931_2"), wavelengths_nm)[0, 1]
    seen = samples[luminance > 0.0] / luminance[luminance > 0.0, None]
    metric = _metric(wavelengths_nm)
    wanted = seen @ metric.T
    found = _judged(Reduction(seen.mean(axis=0)[None], wavelengths_nm), seen)
    spectra, rest = np.empty((0, seen.shape[1])), wanted
    while found.delta_e94[0] > budget_delta_e94 and len(spectra) < min(most, len(seen)):
        farthest = int(np.argmax(np.sum(rest**2, axis=1)))
        spectra = np.concatenate([spectra, seen[farthest, None]])
        tried = Reduction(spectra, wavelengths_nm)
        if len(spectra) > 1:
            tried = _judged(_improved(tried, seen), seen)
            found = tried if tried.delta_e94 < found.delta_e94 else found
        spectra = tried.spectra
        rest = wanted - tried.shares(seen) @ (spectra @ metric.T)
    return found


def _improved(found: Reduction, seen: np.ndarray) -> Reduction:
    """The spectra moved, in turn with their shares, to where they mix all others better (Cichocki and Phan 2009)."""
    spectra = found.spectra.copy()
    for _ in range(_TURNS):
        shares = Reduction(spectra, found.wavelengths_nm).shares(seen)
        gram, towards = shares.T @ shares, shares.T @ seen
        for k in range(len(spectra)):
            if gram[k, k] > 0.0:
                at = np.maximum(spectra[k] + (towards[k] - gram[k] @ spectra) / gram[k, k], 0.0)
                spectra[k] = at if at.any() else spectra[k]
    return Reduction(spectra, found.wavelengths_nm)


def _judged(found: Reduction, seen: np.ndarray, shares: np.ndarray | None = None) -> Reduction:
    errors = delta_e94(seen, found, found.shares(seen) if shares is None else shares)
    return replace(found, delta_e94=(float(np.percentile(errors, 99.0)), float(errors.max())))


def delta_e94(
    samples: Float[np.ndarray, "n L"], found: Reduction, shares: Float[np.ndarray, "n K"]
) -> Float[np.ndarray, " n"]:
    """For each sample the worst of the reflectances and observers; samples of one luminance."""
    worst = np.zeros(len(samples))
    for name in ("1931_2", "1964_10"):
        matrices = xyz_of_samples(observer(name), found.wavelengths_nm, *reflectances())
        white = matrices[0] @ samples.mean(axis=0)
        white = np.maximum(white, _LEAST_WHITE * white[1])
        truth = np.einsum("rcl,nl->nrc", matrices, samples, optimize=True)
        shown = np.einsum("nk,rck->nrc", shares, matrices @ found.spectra.T, optimize=True)
        worst = np.maximum(worst, delta_e_xyz(truth, shown, white).max(axis=1))
    return worst


def _metric(wavelengths_nm: Wavelengths) -> Float[np.ndarray, "Q L"]:
    """Rows whose scalar products with light are all that the reflectances show of it, as few as there can be."""
    return _metric_of(wavelengths_nm.tobytes())


@cache
def _metric_of(key: bytes) -> Float[np.ndarray, "Q L"]:
    wavelengths_nm = np.frombuffer(key)
    rows = np.concatenate(
        [
            xyz_of_samples(observer(name), wavelengths_nm, *reflectances()).reshape(-1, wavelengths_nm.size)
            for name in ("1931_2", "1964_10")
        ]
    )
    _, singular, directions = np.linalg.svd(rows, full_matrices=False)
    kept = singular > _RANK * singular[0]
    return singular[kept, None] * directions[kept]


def _non_negative(wanted: Float[np.ndarray, "n Q"], parts: Float[np.ndarray, "K Q"]) -> Float[np.ndarray, "n K"]:
    """The least squares of wanted - x @ parts over x >= 0: block principal pivoting (Kim and Park 2011, algorithm 2).

    Which numbers are 0 is guessed for all rows at once, and where signs disagree the guess is exchanged; a row that
    does not settle is left to the slower active sets of Lawson and Hanson.
    """
    lengths = np.sqrt(np.sum(parts**2, axis=1))
    parts = parts / lengths[:, None]
    gram, towards = parts @ parts.T, wanted @ parts.T
    rows, count = towards.shape
    found, free = np.zeros((rows, count)), towards > 0.0
    rounding = _ROUNDING * np.abs(towards).max(axis=1, initial=0.0, keepdims=True)
    fewest, tries = np.full(rows, count + 1), np.full(rows, _FULL_EXCHANGES)
    left = np.arange(rows)
    for _ in range(_EXCHANGES * count):
        codes = free[left] @ (1 << np.arange(count))
        slopes = np.empty((left.size, count))
        for code in np.unique(codes):
            here = codes == code
            some = (code >> np.arange(count) & 1).astype(bool)
            at = np.zeros((int(here.sum()), count))
            at[:, some] = np.linalg.lstsq(gram[np.ix_(some, some)], towards[left[here]][:, some].T, rcond=None)[0].T
            found[left[here]] = at
            slopes[here] = at @ gram - towards[left[here]]
        wrong = np.where(free[left], found[left] < -rounding[left], slopes < -rounding[left])
        number = wrong.sum(axis=1)
        fewer = number < fewest[left]
        fewest[left] = np.minimum(fewest[left], number)
        tries[left] = np.where(fewer, _FULL_EXCHANGES, tries[left] - 1)
        last = np.zeros_like(wrong)
        last[np.arange(left.size), count - 1 - np.argmax(wrong[:, ::-1], axis=1)] = True
        free[left] ^= np.where((tries[left] > 0)[:, None], wrong, wrong & last)
        left = left[number > 0]
        if not left.size:
            break
    for row in left:
        found[row] = nnls(parts.T, wanted[row])[0]
    return np.maximum(found, 0.0) / lengths
