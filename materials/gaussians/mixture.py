"""Mixtures with axes of their own: for light on the sphere, and for tabulated distributions of half vectors."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ..core.spherical_gaussian import Gaussians

_STEPS = 40
# A lobe of less than this share of the whole is let go.
_LEAST_SHARE = 1e-6
# Sharpness that the search stays between, and how far amplitudes may move from where it begins, in ln.
_SHARPNESS, _MOVED = (0.1, 1e6), 12.0


def expected_mixture(
    to: Float[np.ndarray, "m 3"], weight: Float[np.ndarray, " m"], count: int, sharpest: float
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"], Float[np.ndarray, "m n"]]:
    """Axes, sharpness and memberships of at most `count` lobes by expectation maximisation.

    A von Mises-Fisher mixture: Banerjee, Dhillon, Ghosh and Sra 2005. to : unit directions, of which each counts by
    its weight > 0. sharpest : that a lobe may become. A membership (m, n) is the share of a direction's weight that a
    lobe holds; they sum to 1.
    """
    axis, sharpness = _starts(to, weight, count, sharpest)
    shares, member = np.full(len(axis), 1.0 / len(axis)), np.ones((len(to), len(axis)))
    for _ in range(_STEPS):
        apart = np.sum((to[:, None] - axis) ** 2, axis=-1)
        # ln of the normalised Gaussian, so that nothing far off underflows to nowhere.
        density = np.log(shares * sharpness / -np.expm1(-2.0 * sharpness)) - 0.5 * sharpness * apart
        member = np.exp(density - density.max(axis=1, keepdims=True))
        member /= member.sum(axis=1, keepdims=True)
        held = member * weight[:, None]
        sums = held.T @ to
        amount, length = held.sum(axis=0), np.linalg.norm(sums, axis=1)
        alive = (amount > _LEAST_SHARE * weight.sum()) & (length > 0.0)
        axis, mean = sums[alive] / length[alive, None], length[alive] / amount[alive]
        shares, member = amount[alive] / amount[alive].sum(), member[:, alive]
        # Banerjee et al. 2005, eq. 4.4.
        sharpness = np.clip(mean * (3.0 - mean**2) / np.maximum(1.0 - mean**2, 1e-12), 1e-3, sharpest)
    return axis, sharpness, member / member.sum(axis=1, keepdims=True)


def _starts(to: np.ndarray, weight: np.ndarray, count: int, sharpest: float) -> tuple[np.ndarray, np.ndarray]:
    """Directions to begin from, each where the most weight is farthest from those before."""
    chosen = [int(np.argmax(weight))]
    away = np.full(len(to), np.inf)
    while len(chosen) < min(count, len(to)):
        away = np.minimum(away, np.sum((to - to[chosen[-1]]) ** 2, axis=1))
        if not (weight * away).max() > 0.0:
            break
        chosen.append(int(np.argmax(weight * away)))
    return to[chosen], np.full(len(chosen), min(30.0, sharpest))


def fit_tabulated(
    half: Float[np.ndarray, "m 3"],
    density: Float[np.ndarray, " m"],
    solid_angle: Float[np.ndarray, " m"],
    count: int,
    importance: Float[np.ndarray, " m"] | None = None,
) -> Gaussians:
    """Lobes (n,) with free axes for a tabulated distribution of half vectors, by L-BFGS-B.

    Wang et al. 2009, section 4.2. Lobes come in order of sharpness.

    Parameters
    ----------
    half : unit half vectors, z >= 0. density : D there, >= 0. solid_angle : that each stands for, sr.
    count : at most so many lobes. importance : of an error there, >= 0; None: the same everywhere.

    Raises
    ------
    InputError : no lobes, a density that is none, or nothing but zeros.
    """
    if count < 1:
        raise InputError("no lobes", field="count", found=count, expected="1 or more")
    if not (np.isfinite(density).all() and (density >= 0.0).all() and density.max() > 0.0):
        raise InputError("not a distribution", field="density", expected="finite numbers >= 0, one of them above 0")
    there = density > 0.0
    mass = (density * solid_angle)[there]
    axis, sharpness, member = expected_mixture(half[there], mass, count, _SHARPNESS[1])
    top = (mass @ member) * sharpness / (-2.0 * np.pi * np.expm1(-2.0 * sharpness))
    weights = solid_angle * (1.0 if importance is None else importance)
    # So that the least possible cost is of the order of 1.
    scale = float(weights @ density**2)
    begin = np.concatenate([axis.ravel(), np.log(sharpness), np.log(top)])
    number = len(axis)

    def cost(at: np.ndarray) -> tuple[float, np.ndarray]:
        free, log_sharpness, log_top = at[: 3 * number].reshape(-1, 3), at[3 * number : 4 * number], at[4 * number :]
        length = np.linalg.norm(free, axis=1, keepdims=True)
        towards, sharp = free / length, np.exp(log_sharpness)
        apart = 0.5 * np.sum((half[:, None] - towards) ** 2, axis=-1)
        each = np.exp(log_top - sharp * apart)
        left = weights * (each.sum(axis=1) - density)
        pulled = left[:, None] * each
        # d value / d axis = value lambda h, of which only what is across the axis turns it.
        turn = (pulled.T @ half) * sharp[:, None]
        turn = (turn - np.sum(turn * towards, axis=1, keepdims=True) * towards) / length
        slope = np.concatenate([turn.ravel(), -(pulled * apart).sum(axis=0) * sharp, pulled.sum(axis=0)])
        return float(left @ (each.sum(axis=1) - density)) / scale, 2.0 * slope / scale

    bounds = [(-2.0, 2.0)] * (3 * number) + [tuple(np.log(_SHARPNESS))] * number
    bounds += [(one - _MOVED, one + _MOVED) for one in np.log(top)]
    from scipy.optimize import minimize

    found = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 500}).x
    free = found[: 3 * number].reshape(-1, 3)
    order = np.argsort(found[3 * number : 4 * number])
    axis = free / np.linalg.norm(free, axis=1, keepdims=True)
    return Gaussians(axis[order], np.exp(found[3 * number : 4 * number])[order], np.exp(found[4 * number :])[order])
