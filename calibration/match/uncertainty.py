"""Uncertainty of differences, propagated from the repeatability of the instrument.

Readings scatter by a covariance in CIELAB, small enough for CIELAB to be linear over it. That of a difference is the
sum of both sides'. Near a match a colour difference is not linear in CIELAB, so its standard deviation is integrated
over the scatter by Gauss-Hermite quadrature in three dimensions: exact for polynomials up to the 15th degree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.axis_letters import Lab, White
from ...spectral.difference import xyz_from_lab
from ...spectral.formula import Formula
from ...spectral.sample import Sample

#: Coverage factor: about 95 % of a normal distribution (JCGM 100:2008, 6.3).
COVERAGE = 2.0
#: Readings that a scatter is told from, at least; below `WELL_KNOWN` the scatter itself is known to a quarter or worse.
FEWEST, WELL_KNOWN = 3, 10
# Nodes along each axis.
_NODES = 8


@dataclass(frozen=True)
class Repeatability:
    """Scatter of single readings.

    sigma : ΔE*ab, root mean square about their mean, equal in L*, a* and b*; None if readings determine it.
    repeated : readings of one sample, which determine the scatter under each light; None if it is stated.
    """

    sigma: float | None = None
    repeated: Sample | None = None

    def __post_init__(self) -> None:
        if self.sigma is not None and not 0.0 < self.sigma < np.inf:
            raise InputError("not a repeatability", field="repeatability", found=self.sigma, expected="a ΔE*ab above 0")
        if self.repeated is not None and len(self.repeated.readings) < FEWEST:
            raise InputError(
                "too few readings to tell what they scatter by",
                file=self.repeated.source,
                found=f"{len(self.repeated.readings)}",
                expected=f"{FEWEST} readings of one thing at least, {WELL_KNOWN} or more to know it well",
            )

    def covariance(self, light: str, eye: str) -> Float[np.ndarray, "3 3"]:
        """Covariance of one reading, in CIELAB."""
        if self.repeated is None:
            assert self.sigma is not None
            return np.eye(3) * (self.sigma**2 / 3.0)
        return np.cov(self.repeated.labs(light, eye), rowvar=False)

    @property
    def words(self) -> str:
        """Source of the repeatability, in words."""
        if self.repeated is None:
            return f"instrument's repeatability ΔE*ab {self.sigma:g} (root mean square), as stated"
        count = len(self.repeated.readings)
        known = "" if count >= WELL_KNOWN else f"; from so few, known to {50 / np.sqrt(2 * (count - 1)) * 2:.0f} % only"
        return f"instrument's repeatability from {count} readings of {self.repeated.name}{known}"


@dataclass(frozen=True, eq=False)
class Spread:
    """k = 2 times the standard deviations of a difference: lightness, a, b, chroma, hue, and of ΔE by formula."""

    lightness: float
    a: float
    b: float
    chroma: float
    hue: float
    delta_e: dict[str, float]


def scatter(standard: Sample, sample: Sample, known: Repeatability, light: str, eye: str) -> Float[np.ndarray, "3 3"]:
    """Compute the covariance of sample minus standard.

    The mean of n readings of a side has 1 / n of a reading's covariance; a stated colour is assumed exact.
    """
    shares = sum(1.0 / len(side.readings) for side in (standard, sample) if side.readings)
    return known.covariance(light, eye) * shares


def spread(
    standard: Lab, sample: Lab, white: White, covariance: Float[np.ndarray, "3 3"], formulas: tuple[Formula, ...]
) -> Spread:
    """Propagate the scatter of one pair of colours (3,) whose difference scatters by `covariance`."""
    sigma = np.sqrt(np.diag(covariance))
    first = xyz_from_lab(np.asarray(standard, dtype=np.float64), white)

    def by(one: Formula) -> Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, " n"]]:
        return lambda labs: one(np.broadcast_to(first, labs.shape), xyz_from_lab(labs, white), white)

    found = {one.name: deviation_of(by(one), sample, covariance) for one in formulas}
    along, across = _axes(standard)
    return Spread(
        COVERAGE * float(sigma[0]),
        COVERAGE * float(sigma[1]),
        COVERAGE * float(sigma[2]),
        COVERAGE * float(np.sqrt(along @ covariance @ along)),
        COVERAGE * float(np.sqrt(across @ covariance @ across)),
        found,
    )


def deviation_of(
    figure: Callable[[Float[np.ndarray, "n 3"]], Float[np.ndarray, " n"]],
    sample: Lab,
    covariance: Float[np.ndarray, "3 3"],
) -> float:
    """Compute k = 2 times the standard deviation of a figure of CIELAB (n, 3) -> (n,) scattered about a sample (3,)."""
    weights, offsets = _scattered(covariance)
    return COVERAGE * _deviation(figure(sample + offsets), weights)


def _axes(standard: Lab) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors of chroma and hue at a colour; those of a* and b* for a grey."""
    chroma = float(np.hypot(standard[1], standard[2]))
    cosine, sine = (1.0, 0.0) if chroma == 0.0 else (standard[1] / chroma, standard[2] / chroma)
    return np.array([0.0, cosine, sine]), np.array([0.0, -sine, cosine])


@cache
def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Return weights (n,) with sum 1, and points (n, 3), of a normal distribution of variance 1."""
    at, weight = np.polynomial.hermite_e.hermegauss(_NODES)
    weight = weight / weight.sum()
    points = np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.einsum("i,j,k->ijk", weight, weight, weight).ravel(), points


def _scattered(covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    weights, points = _nodes()
    # A covariance of few readings has eigenvalues of nought, which rounding may put below it.
    values, vectors = np.linalg.eigh(covariance)
    return weights, points * np.sqrt(np.maximum(values, 0.0)) @ vectors.T


def _deviation(values: np.ndarray, weights: np.ndarray) -> float:
    mean = weights @ values
    return float(np.sqrt(weights @ (values - mean) ** 2))
