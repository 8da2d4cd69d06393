"""Statistics of a batch relative to its standard: mean offset, scatter, and drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...spectral.difference import xyz_from_lab
from ...spectral.formula import Formula
from .pairs import PairDifference

#: Samples that tell of a drift, at least.
FEWEST = 5


@dataclass(frozen=True, eq=False)
class Batch:
    """Statistics of a batch under one illuminant for one observer.

    mean, deviation (3,) : of sample minus standard, in L*, a* and b*. scatter : mean ΔE of the samples from their mean.
    per_sample, uncertain (3,) : trend per sample, and its uncertainty (95 %); None for fewer than `FEWEST` samples.
    """

    count: int
    mean: Float[np.ndarray, "3"]
    deviation: Float[np.ndarray, "3"]
    scatter: float
    per_sample: Float[np.ndarray, "3"] | None = None
    uncertain: Float[np.ndarray, "3"] | None = None

    @property
    def drifts(self) -> tuple[str, ...]:
        """Axes along which the trend exceeds its uncertainty."""
        if self.per_sample is None or self.uncertain is None:
            return ()
        return tuple(
            f"{axis} {step:+.3f} a sample"
            for axis, step, known in zip(("L*", "a*", "b*"), self.per_sample, self.uncertain, strict=True)
            if abs(step) > known
        )


def batch(found: Sequence[PairDifference], formula: Formula) -> Batch | None:
    """Compute statistics of samples in order of production, under the same conditions; None for fewer than two."""
    if len(found) < 2:
        return None
    labs = np.array([one.sample_lab for one in found])
    off = labs - found[0].standard_lab
    mean = labs.mean(axis=0)
    white, formula = found[0].white, formula.at(found[0].conditions.geometry)
    xyz = xyz_from_lab(labs, white)
    scatter = float(np.mean(formula(np.broadcast_to(xyz_from_lab(mean, white), xyz.shape), xyz, white)))
    slope, known = _trend(off) if len(found) >= FEWEST else (None, None)
    return Batch(len(found), off.mean(axis=0), off.std(axis=0, ddof=1), scatter, slope, known)


def _trend(values: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Fit slopes of straight lines to values in a row, and half the width of their 95 % intervals."""
    from scipy.stats import t

    count = len(values)
    at = np.arange(count) - 0.5 * (count - 1)
    square = float(at @ at)
    slope = at @ values / square
    rest = values - values.mean(axis=0) - at[:, None] * slope
    error = np.sqrt((rest**2).sum(axis=0) / (count - 2) / square)
    return slope, float(t.ppf(0.975, count - 2)) * error
