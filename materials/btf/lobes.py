"""Cosine lobes: the reflection of one texel in one view under each light, in a few numbers.

Meseth, Mueller and Klein 2003 (eq. 1) write f_r cos(theta_i) of a view as rho_d + rho_s sum of k lobes (t_j . l)^n_j,
and fit them by the Levenberg-Marquardt method, started at the principal directions of the data. Here t_j is a unit axis
with an amplitude of its own, the start is orthogonal matching pursuit over lobes at the measured lights, and thousands
of fits are batched: one array operation for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .lobe_amplitudes import solved
from .quantisation import LEAST, MOST

# Exponents to begin at.
_EXPONENTS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
# Fits side by side: their derivatives lie in a processor's cache.
_BLOCK = 512
# Steps at most, and the share of the squares below which a step is the last.
_STEPS, _ENOUGH = 12, 2e-3
# Initial damping, and its factors after a step that helped, and after one that did not.
_DAMPING, _EASED, _HARDENED = 1e-2, 0.25, 8.0
# The largest change of ln n, and of an axis (its tangent), in a step.
_LONGEST = 0.7
# Ridge, relative to the mean of the diagonal: the data do not determine some unknowns.
_HELD = 1e-6
# Cosines at and below which a lobe is 0; above it, its logarithm is finite.
_DARK = np.float32(1e-6)


@dataclass(frozen=True, eq=False)
class CosineLobes:
    """Cosine lobes of N fits, rho + sum of k amplitudes times max(axis . l, 0)^exponent.

    diffuse (N,) : rho. amplitudes (N,k), of either sign. axes (N,k,3) : unit vectors, below the horizon too.
    exponents (N,k) : within the range that can be stored (`quantisation`).
    """

    diffuse: Float[np.ndarray, " N"]
    amplitudes: Float[np.ndarray, "N k"]
    axes: Float[np.ndarray, "N k 3"]
    exponents: Float[np.ndarray, "N k"]


def lobe_values(
    axes: Float[np.ndarray, "*N k 3"], exponents: Float[np.ndarray, "*N k"], lights: Float[np.ndarray, "Lt 3"]
) -> Float[np.ndarray, "*N k Lt"]:
    """Evaluate max(axis . l, 0)^exponent."""
    cosine = axes @ lights.T.astype(axes.dtype)
    np.maximum(cosine, 0.0, out=cosine)
    return cosine ** exponents[..., None]


def fitted_lobes(
    values: Float[np.ndarray, "N Lt"],
    weights: Float[np.ndarray, "N Lt"],
    lights: Float[np.ndarray, "Lt 3"],
    count: int,
) -> CosineLobes:
    """Fit `count` lobes to each of N rows of values under some lights, by weighted least squares.

    Each row is scaled by its largest value. Sums over lights are float32, steps float64.
    """
    directions = np.ascontiguousarray(lights.T, dtype=np.float32)
    table, axes, exponents = _table(lights)
    found = []
    for start in range(0, len(values), _BLOCK):
        rows = np.asarray(values[start : start + _BLOCK], dtype=np.float32)
        weigh = np.asarray(weights[start : start + _BLOCK], dtype=np.float32)
        size = np.abs(rows).max(axis=1, initial=0.0, keepdims=True)
        size = np.where(size > 0.0, size, np.float32(1.0))
        weigh = weigh / np.sqrt(np.mean(weigh * weigh, axis=1, keepdims=True))
        rows = rows / size
        chosen = _pursued(rows, weigh * weigh, table, count)
        linear, axis, log_n = _refined(rows, weigh, directions, axes[chosen], np.log(exponents[chosen]))
        found.append((linear * size, axis, np.exp(log_n)))
    linear, axis, exponent = (np.concatenate(part) for part in zip(*found, strict=True))
    return CosineLobes(linear[:, 0], linear[:, 1:], axis, exponent)


def _table(
    lights: Float[np.ndarray, "Lt 3"],
) -> tuple[Float[np.ndarray, "m Lt"], Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
    """Tabulate lobes of a few exponents at each light, with their axes and exponents."""
    axes = np.tile(lights, (len(_EXPONENTS), 1))
    exponents = np.repeat(_EXPONENTS, len(lights))
    return lobe_values(axes[:, None], exponents[:, None], lights)[:, 0].astype(np.float32), axes, exponents


def _pursued(
    values: Float[np.ndarray, "N Lt"], squares: Float[np.ndarray, "N Lt"], table: Float[np.ndarray, "m Lt"], count: int
) -> Int[np.ndarray, "N k"]:
    """Choose the initial lobes of the table by orthogonal matching pursuit, beside a constant."""
    total = squares.sum(axis=1, keepdims=True)
    own = squares @ (table * table).T - (squares @ table.T) ** 2 / total
    own = np.maximum(own, 1e-3 * total)
    chosen = np.zeros((len(values), 0), dtype=np.int64)
    functions = np.ones((len(values), 1, values.shape[1]), dtype=np.float32)
    while True:
        weighed = functions * squares[:, None]
        if chosen.shape[1] == count:
            return chosen
        gram = (weighed @ functions.swapaxes(1, 2)).astype(np.float64)
        gram[:, *np.diag_indices(gram.shape[1])] *= 1.0 + 1e-6
        linear = np.linalg.solve(gram, (weighed @ values[..., None]).astype(np.float64)).astype(np.float32)
        left = values - (functions * linear).sum(axis=1)
        gain = (left * squares) @ table.T
        gain *= np.abs(gain) / own
        np.put_along_axis(gain, chosen, -np.inf, axis=1)
        chosen = np.concatenate([chosen, gain.argmax(axis=1)[:, None]], axis=1)
        functions = np.concatenate([functions, table[chosen[:, -1]][:, None]], axis=1)


def _refined(
    values: Float[np.ndarray, "N Lt"],
    weights: Float[np.ndarray, "N Lt"],
    directions: Float[np.ndarray, "3 Lt"],
    axes: Float[np.ndarray, "N k 3"],
    log_n: Float[np.ndarray, "N k"],
) -> tuple[Float[np.ndarray, "N c"], Float[np.ndarray, "N k 3"], Float[np.ndarray, "N k"]]:
    """Refine all rows at once by the Levenberg-Marquardt method: rho and amplitudes (N,k+1), axes, ln n."""
    count = axes.shape[1]
    linear = _linear(values, weights, directions, axes, log_n)
    products = _products(values, weights, directions, linear, axes, log_n)
    damping = np.full(len(values), _DAMPING)
    # Rows that go on.
    on = np.arange(len(values))
    for _ in range(_STEPS):
        step = _step(products[on], damping[on])
        trial_linear = linear[on] + step[:, : count + 1]
        turn = np.clip(step[:, count + 1 : 3 * count + 1].reshape(-1, count, 2), -_LONGEST, _LONGEST)
        across = _tangents(axes[on])
        trial_axes = axes[on] + np.einsum("nka,nkax->nkx", turn, across)
        trial_axes /= np.linalg.norm(trial_axes, axis=2, keepdims=True)
        change = np.clip(step[:, 3 * count + 1 :], -_LONGEST, _LONGEST)
        trial_n = np.clip(log_n[on] + change, np.log(LEAST), np.log(MOST))
        after = _products(values[on], weights[on], directions, trial_linear, trial_axes, trial_n)
        less = products[on, -1, -1] - after[:, -1, -1]
        better = less > 0.0
        damping[on] *= np.where(better, _EASED, _HARDENED)
        last = better & (less < _ENOUGH * products[on, -1, -1])
        some = on[better]
        linear[some], axes[some], log_n[some] = trial_linear[better], trial_axes[better], trial_n[better]
        products[some] = after[better]
        on = on[~last & (damping[on] < 1e3)]
        if not len(on):
            break
    return linear, axes, log_n


def _linear(values, weights, directions, axes, log_n):
    """Fit rho and amplitudes of given lobes by least squares."""
    lobes = lobe_values(axes.astype(np.float32), np.exp(log_n).astype(np.float32), directions.T)
    rows = np.concatenate([np.ones_like(values)[:, None], lobes, values[:, None]], axis=1) * weights[:, None]
    return _step((rows @ rows.swapaxes(1, 2)).astype(np.float64), np.zeros(len(values)))


def _products(values, weights, directions, linear, axes, log_n):
    """Compute the Gram matrix over lights of all derivatives and, last, the residual."""
    count = axes.shape[1]
    size, lights = values.shape
    rows = np.empty((size, 4 * count + 2, lights), dtype=np.float32)
    rows[:, 0] = weights
    frames = np.concatenate([axes[:, :, None], _tangents(axes)], axis=2).astype(np.float32)
    exponents, amplitudes = np.exp(log_n).astype(np.float32), linear[:, 1:].astype(np.float32)
    missed = values - linear[:, :1].astype(np.float32)
    for lobe in range(count):
        cosine, first, second = (frames[:, lobe] @ directions).transpose(1, 0, 2)
        lit = cosine > _DARK
        cosine = np.maximum(cosine, _DARK)
        logarithm = np.log(cosine)
        value = np.exp(exponents[:, lobe, None] * logarithm)
        value *= lit
        missed -= amplitudes[:, lobe, None] * value
        value *= weights
        rows[:, 1 + lobe] = value
        value = value * (exponents * amplitudes)[:, lobe, None]
        rows[:, 3 * count + 1 + lobe] = value * logarithm
        value /= cosine
        rows[:, count + 1 + 2 * lobe] = value * first
        rows[:, count + 2 + 2 * lobe] = value * second
    rows[:, -1] = missed * weights
    return (rows @ rows.swapaxes(1, 2)).astype(np.float64)


def _step(products: Float[np.ndarray, "N m1 m1"], damping: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N m"]:
    """Solve the damped normal equations for the step."""
    square = np.ascontiguousarray(products[:, :-1, :-1].transpose(1, 2, 0))
    right = np.ascontiguousarray(products[:, :-1, -1:].transpose(1, 2, 0))
    every = np.arange(len(square))
    diagonal = square[every, every]
    square[every, every] += damping * diagonal + _HELD * diagonal.mean(axis=0) + np.finfo(np.float64).tiny
    return solved(square, right)[:, 0].T


def _tangents(axes: Float[np.ndarray, "N k 3"]) -> Float[np.ndarray, "N k 2 3"]:
    """Compute two unit vectors perpendicular to each axis (Duff et al. 2017)."""
    x, y, z = np.moveaxis(axes, -1, 0)
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    return np.stack([first, np.stack([b, sign + y * y * a, -y], axis=-1)], axis=2)
