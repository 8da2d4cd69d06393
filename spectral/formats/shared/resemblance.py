"""Resemblance of spectra to published tables, and as surfaces the colours that are stated beside them.

Tables are the CIE's observers and illuminants, lamps and charts, as colour-science has them. A column of numbers
without a word may be one of them. What it resembles is one sign of what it is (`decisions`); where it stands on the
scale of the publication, or a power of ten beside it, that is another.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ...colour_library import Group, colour_tables
from ...illuminants import illuminant
from ...observers import observer
from ..registry import StatedColour

Kind = Literal["sensitivity", "emission", "reflectance"]
# Tables of colour-science by what they hold.
_GROUPS: dict[Kind, tuple[Group, ...]] = {
    "sensitivity": ("MSDS_CMFS", "SDS_LEFS", "MSDS_CAMERA_SENSITIVITIES"),
    "emission": ("SDS_ILLUMINANTS", "SDS_LIGHT_SOURCES"),
    "reflectance": ("SDS_COLOURCHECKERS",),
}

# Range where every table has samples, nm; the fewest samples and the narrowest range by which a table is recognised.
_WINDOW, _FEWEST, _NARROWEST = (400.0, 700.0), 12, 150.0
# The most that shape may differ: root mean square of what is left, over that of the values. Published digits and
# interpolation cost a few thousandths.
_ALIKE = 0.005
# A table flatter than this has no shape to be known by: every grey resembles the equal-energy illuminant.
_FLAT = 0.05
_SAME_SCALE = 1e-3
# Lines of mercury in every fluorescent lamp, nm, and others that lamps have; how near a line's samples are, and how far
# what a line may reach. Finer samples are averaged over the width of a lamp's line in a spectrometer; steps coarser
# than the last are too few places for a sign.
_MERCURY = (404.7, 435.8, 546.1)
_OTHERS = (488.0, 543.0, 578.0, 587.0, 611.0, 631.0, 650.0, 707.0)
_NEAR, _REACH, _LINE_WIDTH, _COARSEST = 3.0, 12.0, 5.0, 6.0
# Factor by which strong lines stand out from anything far from all lines; and shares of the line at 436 nm which the
# others reach: 0.28 to 0.6 and 0.28 to 2.4 in lamps, the same at coarse steps but for their places.
_STANDS_OUT = 10.0
_SHARES = ((0.15, 1.5), (0.2, 5.0))
_FEWEST_PLACES = 30
# Wavelengths at which luminances are compared.
_GRID_NM = np.arange(400.0, 701.0, 10.0)


class Likeness(NamedTuple):
    """Resemblance of a spectrum: the kind of table, its name, and the factor between the two.

    published : whether it is on the scale of the publication, or a power of ten beside it.
    """

    kind: Kind
    name: str
    factor: float
    published: bool


class _Published(NamedTuple):
    kinds: tuple[Kind, ...]
    names: tuple[str, ...]
    values: Float[np.ndarray, "R N"]
    flat: tuple[bool, ...]


def likenesses(grid_nm: Float[np.ndarray, "L"], values: Float[np.ndarray, "N L"]) -> list[Likeness | None]:
    """Find for each spectrum the published table that it resembles most, None where it resembles none.

    A sign that guesses a quantity from shape may be found by chance in fewer than 1 of 10,000 noises of a file's own
    statistics. A dozen samples and more that all keep to the shape of a table are; a grey of a chart has no shape, and
    noise of little contrast has its numbers at many levels: it is known only beside spectra of a chart that have one.
    """
    order = np.argsort(grid_nm, kind="stable")
    grid_nm, values = grid_nm[order], values[:, order]
    inside = (grid_nm >= _WINDOW[0]) & (grid_nm <= _WINDOW[1])
    nodes = grid_nm[inside]
    if nodes.size < _FEWEST or np.ptp(nodes) < _NARROWEST or nodes.size > 2000:
        return [None] * len(values)
    seen = values[:, inside]
    known = _published(nodes.tobytes())
    if not known.names:
        return [None] * len(values)
    usable = np.asarray(np.isfinite(seen).all(axis=1) & (np.abs(seen) < 1e150).all(axis=1))
    seen = np.where(usable[:, None], seen, 0.0)
    largest = np.asarray(np.abs(seen).max(axis=1))
    usable = usable & (largest > 0.0)
    seen = seen / np.where(usable, largest, 1.0)[:, None]
    squares = np.where(usable, (seen * seen).sum(axis=1), 1.0)
    own = (known.values**2).sum(axis=1)
    products = seen @ known.values.T
    left = np.sqrt(np.maximum(1.0 - products**2 / np.outer(squares, own), 0.0))
    left = np.where(products > 0.0, left, 1.0)
    found: list[Likeness | None] = []
    flat = np.zeros(len(values), dtype=bool)
    for row, best in enumerate(left.argmin(axis=1).tolist()):
        if not usable[row] or left[row, best] > _ALIKE:
            found.append(None)
            continue
        factor = float(products[row, best] / own[best] * largest[row])
        if known.kinds[best] == "reflectance" and _scale(factor) is None:
            found.append(None)  # another surface of that hue
            continue
        flat[row] = known.flat[best]
        published = abs(math.log10(factor) - round(math.log10(factor))) < _SAME_SCALE / math.log(10.0)
        found.append(Likeness(known.kinds[best], known.names[best], factor, published))
    of_charts = any(like and like.kind == "reflectance" and not plain for like, plain in zip(found, flat, strict=True))
    return [like if of_charts or not plain else None for like, plain in zip(found, flat, strict=True)]


def _scale(factor: float) -> float | None:
    """1 or 100, what reflectances of a chart are multiplied with; None of anything else."""
    return next((scale for scale in (1.0, 100.0) if abs(factor / scale - 1.0) < 10.0 * _SAME_SCALE), None)


@lru_cache(maxsize=16)
def _published(grid: bytes) -> _Published:
    """Return every published table at these wavelengths, less those that do not cover them or have no shape there."""
    nodes = np.frombuffer(grid)
    kinds, names, rows, flat = [], [], [], []
    for kind, name, nm, values in _tables():
        if nm[0] > nodes[0] + 1e-6 or nm[-1] < nodes[-1] - 1e-6:
            continue
        there = np.interp(nodes, nm, values)
        shapeless = bool(there.std() < _FLAT * there.mean())
        if not there.max() > 0.0 or (kind != "reflectance" and shapeless):
            continue
        flat.append(shapeless)
        kinds.append(kind)
        names.append(name)
        rows.append(there)
    return _Published(tuple(kinds), tuple(names), np.array(rows).reshape(len(rows), nodes.size), tuple(flat))


@lru_cache(maxsize=1)
def _tables() -> tuple[tuple[Kind, str, np.ndarray, np.ndarray], ...]:
    """Kind, name, wavelengths (L,) in nm and values (L,) of every published table."""
    found: list[tuple[Kind, str, np.ndarray, np.ndarray]] = []
    for kind, groups in _GROUPS.items():
        for group in groups:
            for name, (nm, values) in colour_tables(group).items():
                found.extend((kind, name, nm, column) for column in values.reshape(len(nm), -1).T)
    return tuple(found)


def has_mercury_lines(grid_nm: Float[np.ndarray, "L"], values: Float[np.ndarray, "N L"]) -> Bool[np.ndarray, "N"]:
    """Tell which spectra peak where mercury shines, at 405, 436 and 546 nm, as high as only its lamps do.

    A sign of light, and so one that fewer than 1 in 10,000 noises may have: heavy tails, correlated neighbours, steps
    of a converter, and spikes on something smooth. What is compared is how far a cell of 5 nm is from the straight line
    between its neighbours: a lamp is smooth between its lines, and noise is as rough everywhere. Spikes fall on any of
    78 cells: three of them on those of the lines in 1 of 80,000 cases, and where there are more, some are elsewhere.
    """
    placed = _places(np.ascontiguousarray(grid_nm, dtype=np.float64).tobytes())
    values = np.asarray(values, dtype=np.float64)
    if placed is None:
        return np.zeros(len(values), dtype=bool)
    largest = np.abs(values).max(axis=1, keepdims=True)
    standing = (values / np.where(largest > 0.0, largest, 1.0)) @ placed.weights.T
    away = standing[:, placed.away]
    # The flank of a line beside is no line.
    beside = np.pad(standing, ((0, 0), (1, 1)))
    peaks = np.where(standing > 0.5 * np.maximum(beside[:, 2:], beside[:, :-2]), standing, 0.0)
    violet, blue, green = peaks[:, placed.lines].T
    smooth = np.minimum(blue, green) > _STANDS_OUT * np.maximum(away.max(axis=1), 0.0)
    of_mercury = violet > 0.5 * np.abs(away).max(axis=1)
    for line, (least, most) in zip((violet, green), _SHARES, strict=True):
        of_mercury &= (line > least * blue) & (line < most * blue)
    return smooth & of_mercury & (np.median(np.abs(away), axis=1) > 0.0)


class _Places(NamedTuple):
    """Weights (P,L) of what a cell stands out from its neighbours, the places of the lines, and those away from all."""

    weights: Float[np.ndarray, "P L"]
    lines: list[int]
    away: Bool[np.ndarray, "P"]


@lru_cache(maxsize=16)
def _places(grid: bytes) -> _Places | None:
    """Find where samples are compared with their neighbours on this grid; None where it does not reach or resolve the
    lines.
    """
    nodes = np.frombuffer(grid)
    inside = np.flatnonzero((nodes >= 380.0) & (nodes <= 780.0))
    if not 12 <= inside.size <= 5000:
        return None
    # Finer samples in cells of a line's width, coarser ones each in its own.
    cells = np.round((nodes[inside] - _MERCURY[1]) / _LINE_WIDTH)
    of_cells = np.equal.outer(np.unique(cells), cells)
    averages = np.zeros((len(of_cells), nodes.size))
    averages[:, inside] = of_cells / of_cells.sum(axis=1, keepdims=True)
    nm = averages @ nodes
    share = (nm[1:-1] - nm[:-2]) / (nm[2:] - nm[:-2])
    weights = averages[1:-1] - (1.0 - share)[:, None] * averages[:-2] - share[:, None] * averages[2:]
    distance = np.abs(nm[1:-1, None] - np.array(_MERCURY + _OTHERS))
    lines = len(_MERCURY)
    away = distance.min(axis=1) > _REACH
    fine = float(np.median(np.diff(nm))) <= _COARSEST
    if not (fine and (distance[:, :lines].min(axis=0) <= _NEAR).all() and np.count_nonzero(away) >= _FEWEST_PLACES):
        return None
    return _Places(weights, distance[:, :lines].argmin(axis=0).tolist(), away)


def is_above_noise(values: Float[np.ndarray, "L"]) -> bool:
    """Tell whether a spectrum is more than a detector's noise about a level: bright somewhere and dark elsewhere, with
    neighbours that are more alike than those of noise.

    In white noise of any kind, squared differences of neighbours' ranks are twice their squared deviations from the
    mean (von Neumann's ratio, by Bartels); four standard deviations below, or below 0.2 in few samples, it is in fewer
    than 1 of 10,000. Correlated noise is lower, and a level with little contrast.
    """
    if values.size < _FEWEST or not values.min() < 0.5 * values.max():
        # A few numbers that somebody wrote are no noise of a detector.
        return bool(values.min() < 0.5 * values.max())
    ranks = np.unique(values, return_inverse=True)[1].astype(np.float64)
    ratio = (np.diff(ranks) ** 2).sum() / ((ranks - ranks.mean()) ** 2).sum()
    return bool(ratio < max(2.0 - 8.0 / math.sqrt(values.size), 0.2))


class Luminances(NamedTuple):
    """The Y that samples state, of the perfect diffuser 100, and that over the Y of their spectra as surfaces."""

    stated: tuple[float, ...]
    ratios: tuple[float, ...]

    @property
    def ratio(self) -> float | None:
        """The median ratio, None where no sample tells."""
        return float(np.median(self.ratios)) if self.ratios else None

    @property
    def of_surfaces(self) -> tuple[float, ...]:
        """The stated luminances that are those of the spectra, as surfaces."""
        return tuple(y for y, ratio in zip(self.stated, self.ratios, strict=True) if 0.7 < ratio < 1.4)

    @property
    def mostly_of_surfaces(self) -> bool:
        """True if more than half of the samples that tell have the luminance of their spectra, as surfaces."""
        return 2 * len(self.of_surfaces) > len(self.ratios)


def luminances(
    grids: Iterable[np.ndarray], fractions: Iterable[np.ndarray], stated: Iterable[tuple[StatedColour, ...]]
) -> Luminances:
    """Luminances by Lab or by XYZ, whichever is nearer to the spectra: XYZ may be on another scale.

    Parameters
    ----------
    grids, fractions, stated : per sample wavelengths (L,) in nm, values (L,) as fractions of 1, and the colours beside.
    """
    found: dict[str, list[tuple[float, float]]] = {"XYZ": [], "Lab": []}
    for grid, values, colours in zip(grids, fractions, stated, strict=True):
        there = np.isfinite(values) & np.isfinite(grid)
        if not colours or np.count_nonzero(there) < 2 or grid[there].min() > 450 or grid[there].max() < 650:
            continue
        order = np.argsort(grid[there])
        computed = float(100.0 * _weights() @ np.interp(_GRID_NM, grid[there][order], values[there][order]))
        for colour in colours:
            luminance = float(colour.values[1] if colour.space == "XYZ" else _luminance(colour.values[0]))
            if max(luminance, computed) >= 1.0:
                found[colour.space].append((luminance, max(luminance, 1e-3) / max(computed, 1e-3)))
    pairs = [pairs for pairs in found.values() if pairs]
    nearest = min(pairs, key=lambda pairs: abs(np.log(np.median([ratio for _, ratio in pairs]))), default=[])
    return Luminances(tuple(y for y, _ in nearest), tuple(ratio for _, ratio in nearest))


@cache
def _weights() -> np.ndarray:
    """(L,) of Y, of the perfect diffuser 1; under the equal-energy light, which tells factors of ten."""
    return observer("1931_2").weights(illuminant("E"), _GRID_NM)[1]


def _luminance(lightness: float) -> float:
    """Y of CIELAB's L*, of the perfect diffuser 100."""
    return 100.0 * ((lightness + 16.0) / 116.0) ** 3 if lightness > 8.0 else lightness / 9.033
