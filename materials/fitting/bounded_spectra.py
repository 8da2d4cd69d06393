"""Nearest spectra that keep packs within their bounds, with fixed factors: a convex, always feasible problem.

With the factors fixed, shading is linear in the spectra, the cost of all errors is quadratic, and the bounds are half
spaces that contain black. Half spaces are added at violations found by a search, until it finds none (Kelley 1960's
cutting planes). Each problem is one of least distance: Lawson and Hanson 1974, Solving Least Squares Problems, chapter
23.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular

from ..factored.pack import FactorPack
from .bounds import Bounds, Violations
from .joint import JointProblem
from .visible_samples import SeenSamples

# Most searches.
_ROUNDS = 20
# Most half spaces that a search adds.
_PLACES = 300
# Pull towards the spectra as they were, as a share of each one's curvature.
_PULL = 1e-2
# The least pull, as a share of the largest curvature: spectra that samples hardly show stay as they were.
_LEAST_PULL = 1e-9
# Weight of a change at guards, relative to one beyond their limits: pictures hardly show those places, and nothing
# else keeps spectra from leaving the bounds there by more than they did anywhere.
_STAY = 3e-5
# Samples per block of the curvature.
_BLOCK = 2048


def within_bounds(
    packs: tuple[FactorPack, ...], samples: SeenSamples, bounds: Bounds, violations: Violations | None = None
) -> tuple[tuple[FactorPack, ...], bool]:
    """Find the nearest spectra within `bounds`; return the packs, and whether the last search found no violation.

    violations : current violations (`Bounds.violations`), if known.
    """
    violations = bounds.violations(packs) if violations is None else violations
    if not len(violations):
        return packs, True
    problem = JointProblem(packs, samples)
    state = problem.factors()
    terms, spectra = problem.terms(state), problem.spectra(state)
    curvature = _curvature(terms, samples)
    pull = np.maximum(_PULL * np.diag(curvature), _LEAST_PULL * np.diag(curvature).max())
    curvature[np.diag_indices_from(curvature)] += pull
    lower = cholesky(curvature, lower=True, check_finite=False)
    free = spectra.reshape(-1)
    planes, least = np.empty((0, free.size)), np.empty(0)
    for _ in range(_ROUNDS):
        rows, limits = _half_spaces(violations, packs, samples, bounds)
        planes, least = np.vstack([planes, rows]), np.concatenate([least, limits])
        found, active = _least_distance(lower, free, planes, least)
        planes, least = planes[active], least[active]
        packs = problem.packs_of(problem.with_spectra(state, found.reshape(spectra.shape)))
        violations = bounds.violations(packs)
        if not len(violations):
            return packs, True
    return packs, False


def _curvature(terms: Float[np.ndarray, "N R"], samples: SeenSamples) -> Float[np.ndarray, "RS RS"]:
    """Compute the second derivatives of half the cost of errors, in all spectra jointly."""
    rank, size = terms.shape[1], samples.targets.shape[1]
    (a, b), (c, d) = np.triu_indices(rank), np.triu_indices(size)
    found = np.zeros((len(a), len(c)))
    for start in range(0, len(terms), _BLOCK):
        rows = slice(start, start + _BLOCK)
        seen = samples.sensitivity[:, :, rows]
        colour = np.einsum("kcn,kcn->cn", seen[:, c], seen[:, d])
        colour[c == d] += samples.base_weight[rows]
        found += (terms[rows][:, a] * terms[rows][:, b]).T @ colour.T
    whole = np.empty((rank, rank, size, size))
    whole[a[:, None], b[:, None], c, d] = whole[b[:, None], a[:, None], c, d] = found
    whole[a[:, None], b[:, None], d, c] = whole[b[:, None], a[:, None], d, c] = found
    whole = whole.transpose(0, 2, 1, 3).reshape(rank * size, rank * size)
    count = len(samples.guards)
    if count:
        there = terms[-count:]
        lengths = np.pi**2 / samples.synthesis.shape[1] * samples.synthesis @ samples.synthesis.T
        whole += np.kron((_STAY * samples.guards * there.T) @ there, lengths)
    return whole


def _half_spaces(
    violations: Violations, packs: tuple[FactorPack, ...], samples: SeenSamples, bounds: Bounds
) -> tuple[Float[np.ndarray, "M RS"], Float[np.ndarray, " M"]]:
    """Return rows and limits of `rows @ spectra >= limits`, one for each violation."""
    some = slice(0, _PLACES)
    wi, wo, at = violations.wi[some], violations.wo[some], violations.wavelength[some]
    geometry = np.hstack([pack.values(wi, wo) for pack in packs])
    rows = np.pi * (geometry[:, :, None] * samples.synthesis[:, at].T[:, None, :]).reshape(len(wi), -1)
    low, high = bounds.limits[:, at]
    below = violations.low[some]
    return np.where(below, 1.0, -1.0)[:, None] * rows, np.where(below, low, -high)


def _least_distance(
    lower: Float[np.ndarray, "n n"], free: Float[np.ndarray, " n"], planes: Float[np.ndarray, "m n"], least: np.ndarray
) -> tuple[Float[np.ndarray, " n"], np.ndarray]:
    """Find the point with planes @ x >= least of least cost from `free`, and the mask of the active half spaces."""
    from scipy.optimize import nnls

    lengths = np.maximum(np.linalg.norm(planes, axis=1), 1e-100)
    planes, least = planes / lengths[:, None], least / lengths
    leaning = solve_triangular(lower, planes.T, lower=True, check_finite=False)
    short = least - planes @ free
    scale = max(float(np.abs(short).max()), 1e-100)
    system = np.vstack([leaning, short / scale])
    target = np.zeros(len(system))
    target[-1] = 1.0
    weights, _ = nnls(system, target, maxiter=20 * system.shape[1])
    left = system @ weights - target
    if not left[-1] < 0.0:
        # Black is inside of every half space: rounding alone leads here.
        return np.zeros_like(free), weights > 0
    moved = -left[:-1] / left[-1] * scale
    return free + solve_triangular(lower.T, moved, lower=False, check_finite=False), weights > 0
