"""The smooth part of a slice: a cosine bent by polynomials, laid beneath the highlights."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..core.environment_form import bends

# Rounds of reweighting, and what counts as far above, of the slice's median.
_ROUNDS, _FAR = 8, 0.02
# Of the mean square of a polynomial: what holds those that the directions do not tell apart.
_RIDGE = 1.0e-9


def smooth_part(
    directions: Float[np.ndarray, "S 3"], angles: Float[np.ndarray, " S"], f_r: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Coefficients of `bends` that f_r is nearest to, where it does not rise above them: a highlight does not count.

    Weighted by solid angle and cosine; by reweighted least squares on the mean over C, and with the last weights for
    each of the C numbers. A slice that is a polynomial is found exactly. Where half of all directions send nothing
    nothing is smooth.
    """
    basis = bends(directions)
    seen = angles * directions[:, 2]
    mean = f_r.mean(axis=1)
    order = np.argsort(mean, kind="stable")
    within = np.cumsum(seen[order])
    median = mean[order[np.searchsorted(within, 0.5 * within[-1])]]
    scale = _FAR * abs(median)
    if scale == 0.0:
        return np.zeros((basis.shape[1], f_r.shape[1]))
    off = mean - median
    weight = seen
    for _ in range(_ROUNDS):
        # A highlight that is too far above for its square to be a number counts for nothing, as it should.
        with np.errstate(over="ignore"):
            weight = seen / (1.0 + (np.maximum(off, 0.0) / scale) ** 2) ** 2
        off = mean - basis @ _solved(basis, weight, mean[:, None])[:, 0]
    return _solved(basis, weight, f_r)


def body_part(
    directions: Float[np.ndarray, "S 3"], angles: Float[np.ndarray, " S"], f_r: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Coefficients of `bends` that f_r, which has no highlight, is nearest to; its integral is theirs."""
    return _solved(bends(directions), angles * directions[:, 2], f_r)


def _solved(
    basis: Float[np.ndarray, "S 9"], weight: Float[np.ndarray, " S"], values: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Weighted least squares."""
    weighted = basis * weight[:, None]
    normal = weighted.T @ basis
    return np.linalg.solve(normal + _RIDGE * np.diag(np.diag(normal)), weighted.T @ values)
