"""Whether colours that are stated beside spectra are those of the spectra, taken as surfaces: by their luminance."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from ...illuminants import illuminant
from ...observers import observer
from ..reading import StatedColour

_GRID_NM = np.arange(400.0, 701.0, 10.0)


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
        """Whether more than half of the samples that tell have the luminance of their spectra, as surfaces."""
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
