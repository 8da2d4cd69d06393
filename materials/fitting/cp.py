"""CP decomposition of weighted tables: compressed first, then fitted with the weights of visible errors.

A table is (n_1, ..., n_d, S): d angles and S spectral coefficients, with one weight for each angle node. Two stages:

1. `CompressedTable`: the table times a separable approximation of the weights is compressed by higher-order SVD, its
small core is decomposed by alternating least squares, and the factors are expanded. Sweeps are cheap here. 2.
`weighted_cp`: alternating least squares on the table itself with the true weights, which are not separable.

Decompositions are passed as tensorly's `CPTensor`: weights (R,) and one factor (n, R) per mode. Inside the sweeps they
are plain lists of factors.

Both stages have a ridge on factors of balanced length, so that no pair of terms can grow and cancel without bound (the
two-factor degeneracy of CP), and extrapolate along the last move, which crosses swamps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

import numpy as np
from jaxtyping import Float
from tensorly.cp_tensor import CPTensor

from .tucker import compressed

# The factors (n, R) that sweeps work on: of one decomposition, or of several packs with terms of their own.
Factors = list[Float[np.ndarray, "_ _"]]

# Share of a tensor's energy that compression may lose: plenty for a start, which is refined on the table itself.
_ENERGY_LOST = 1e-8
# Keeps a system without any data solvable; its reciprocal is far from overflow.
_TINY = 1e-100


def khatri_rao(factors: Factors) -> Float[np.ndarray, "N R"]:
    """Column-wise Kronecker product of factors (n_m, R), N the product of all n_m; the first factor varies slowest."""
    # tensorly's gives the same bits, 2-3 times slower on a core's factors: a decomposition would take 23-28 % longer.
    return reduce(lambda a, b: (a[:, None, :] * b[None, :, :]).reshape(-1, a.shape[1]), factors)


def absorbed(decomposition: CPTensor) -> Factors:
    """Return the factors alone, with the weights multiplied into the first of them."""
    weights, (first, *others) = decomposition
    return [first * weights, *others]


def balanced(factors: Factors) -> Factors:
    """Return the same terms, each term's length shared equally among its factors."""
    lengths = np.stack([np.linalg.norm(factor, axis=0) for factor in factors])
    whole = np.prod(lengths, axis=0)
    share = whole ** (1.0 / len(factors))
    safe = np.where(whole > 0, lengths, 1.0)
    return [factor * np.where(whole > 0, share / n, 0.0) for factor, n in zip(factors, safe, strict=True)]


def term_lengths(factors: Factors) -> Float[np.ndarray, " R"]:
    """Compute the Euclidean norm of each term: the product of the norms of its columns."""
    return np.prod([np.linalg.norm(factor, axis=0) for factor in factors], axis=0)


def longest_first(factors: Factors) -> CPTensor:
    """Return the decomposition of these factors, terms in descending order of their length; all weights are 1."""
    order = np.argsort(-term_lengths(factors), kind="stable")
    return CPTensor((None, [factor[:, order] for factor in factors]))


def mttkrp(tensor: Float[np.ndarray, "..."], factors: Factors, mode: int) -> Float[np.ndarray, "n R"]:
    """Multiply the unfolding of a C-contiguous tensor along `mode` by the Khatri-Rao product of all other factors.

    By views of the tensor: the modes after `mode` or those before it are summed first, whichever leaves less.
    """
    # tensorly's `unfolding_dot_khatri_rao` copies the tensor for most modes, and takes 1.5 to 8 times as long.
    size = tensor.shape[mode]
    if mode == 0:
        return tensor.reshape(size, -1) @ khatri_rao(factors[1:])
    if mode == tensor.ndim - 1:
        return tensor.reshape(-1, size).T @ khatri_rao(factors[:-1])
    before, after = khatri_rao(factors[:mode]), khatri_rao(factors[mode + 1 :])
    if len(before) <= len(after):
        return np.einsum("bnr,br->nr", (tensor.reshape(-1, len(after)) @ after).reshape(len(before), size, -1), before)
    return np.einsum("rna,ar->nr", (before.T @ tensor.reshape(len(before), -1)).reshape(-1, size, len(after)), after)


def cp_als(
    tensor: Float[np.ndarray, "..."], start: CPTensor, sweeps: int, ridge: float, tolerance: float
) -> tuple[CPTensor, float]:
    """Decompose an unweighted (small) tensor by alternating least squares from a given start.

    Parameters
    ----------
    sweeps : over all modes, at most.
    ridge : pull of every term towards zero, as a share of the tensor's energy.
    tolerance : share of the energy at which sweeps end.

    Returns
    -------
    The decomposition, longest term first, and the residual sum of squares.
    """
    tensor = np.ascontiguousarray(tensor)
    energy = float(np.vdot(tensor, tensor))
    rank = start.rank
    shift = max(ridge * energy ** ((tensor.ndim - 1) / tensor.ndim), _TINY) * np.eye(rank)

    def sweep(factors: Factors) -> tuple[Factors, float]:
        factors = list(factors)
        matrix = right = np.empty(0)
        gram = [factor.T @ factor for factor in factors]
        for mode in range(tensor.ndim):
            matrix = reduce(np.multiply, [g for k, g in enumerate(gram) if k != mode])
            right = mttkrp(tensor, factors, mode)
            factors[mode] = np.linalg.solve(matrix + shift, right.T).T
            gram[mode] = factors[mode].T @ factors[mode]
        inner = float(np.sum(right * factors[-1]))
        return factors, energy - 2 * inner + float(np.sum(matrix * gram[-1]))

    factors, left = extrapolated_sweeps(sweep, absorbed(start), sweeps, tolerance * energy)
    return longest_first(factors), left


@dataclass(frozen=True, eq=False)
class CompressedTable:
    """Compressed table under separable weights, from which starts of any rank are computed.

    `roots`: square roots of the separable weights, one vector per angle.
    """

    core: Float[np.ndarray, "..."]
    bases: tuple[Float[np.ndarray, "_ _"], ...]
    roots: tuple[Float[np.ndarray, " _"], ...]

    @classmethod
    def of(cls, tensor: Float[np.ndarray, "*grid S"], roots: tuple[Float[np.ndarray, " _"], ...]) -> CompressedTable:
        """Compress tensor (n_1 .. n_d, S) times the outer product of `roots` by higher-order SVD."""
        scaled = tensor * reduce(np.multiply.outer, roots)[..., None]
        form = compressed(scaled, _ENERGY_LOST)
        return cls(form.core, form.bases, roots)

    def decomposed(self, rank: int, seed: int | tuple[int, ...], sweeps: int = 120) -> CPTensor:
        """Decompose the core into `rank` terms by `cp_als`, from a random start, and expand them to the table."""
        start = random_start(self.core, rank, np.random.default_rng(seed))
        found, _ = cp_als(self.core, start, sweeps, 1e-6, 1e-14)
        factors = [basis @ factor for basis, factor in zip(self.bases, absorbed(found), strict=True)]
        roots = (*self.roots, np.ones(len(factors[-1])))
        return CPTensor((None, [factor / root[:, None] for factor, root in zip(factors, roots, strict=True)]))


def random_start(tensor: Float[np.ndarray, "..."], rank: int, generator: np.random.Generator) -> CPTensor:
    """Draw `rank` terms of random factors, with about the tensor's own length in total."""
    length = np.linalg.norm(tensor) ** (1.0 / tensor.ndim)
    return CPTensor((None, [generator.standard_normal((n, rank)) * length / np.sqrt(n) for n in tensor.shape]))


class WeightedTable:
    """Table and weights, laid out once for the least-squares problems of every mode."""

    def __init__(self, tensor: Float[np.ndarray, "*grid S"], weights: Float[np.ndarray, "*grid"]) -> None:
        self.modes = weights.ndim
        self.energy = float(np.sum(weights * np.sum(tensor**2, axis=-1)))
        self._weights = [np.moveaxis(weights, m, 0).reshape(weights.shape[m], -1).copy() for m in range(self.modes)]
        weighted = np.moveaxis(weights[..., None] * tensor, -1, 0)
        self._targets = [
            np.moveaxis(weighted, m + 1, 1).reshape(len(weighted), weights.shape[m], -1).copy()
            for m in range(self.modes)
        ]

    def sweep(self, factors: Factors, ridge: float) -> tuple[Factors, float]:
        """Sweep once over all modes; return the factors and the weighted residual sum of squares."""
        factors = list(factors)
        rank = factors[0].shape[1]
        pairs = rest = np.empty(0)
        upper = np.triu_indices(rank)
        for mode in range(self.modes):
            rest = khatri_rao([factor for m, factor in enumerate(factors[:-1]) if m != mode])
            spectral = factors[-1]
            pairs = np.empty((factors[mode].shape[0], rank, rank))
            pairs[:, upper[0], upper[1]] = self._weights[mode] @ (rest[:, upper[0]] * rest[:, upper[1]])
            pairs[:, upper[1], upper[0]] = pairs[:, upper[0], upper[1]]
            matrix = pairs * (spectral.T @ spectral)
            right = np.einsum("snr,sr->nr", self._targets[mode] @ rest, spectral)
            # Relative to each row: weights span many decades between the middle of a highlight and its tail.
            scale = ridge * np.trace(matrix, axis1=1, axis2=2) / rank
            matrix += np.maximum(scale, _TINY)[:, None, None] * np.eye(rank)
            factors[mode] = np.linalg.solve(matrix, right[..., None])[..., 0]
        # The spectral mode shares one matrix among its rows: every node has one weight for all coefficients.
        last = factors[self.modes - 1]
        matrix = np.einsum("nrs,nr,ns->rs", pairs, last, last)
        right = np.einsum("snr,nr->sr", self._targets[self.modes - 1] @ rest, last)
        shift = ridge * max(np.trace(matrix) / rank, _TINY)
        factors[-1] = np.linalg.solve(matrix + shift * np.eye(rank), right.T).T
        left = (
            self.energy - 2.0 * float(np.sum(right * factors[-1])) + float(np.sum((factors[-1] @ matrix) * factors[-1]))
        )
        return factors, left


def weighted_cp(table: WeightedTable, start: CPTensor, sweeps: int) -> tuple[CPTensor, float]:
    """Decompose a table by alternating least squares with the true weights, from a given start.

    Parameters
    ----------
    sweeps : over all modes, at most.

    Returns
    -------
    The decomposition, longest term first, and the weighted residual sum of squares.
    """
    # Every row of a factor is pulled towards zero by a share of the mean curvature there; sweeps end at a share of the
    # table's weighted energy.
    ridge, enough = 1e-9, 1e-12 * table.energy
    factors, left = extrapolated_sweeps(lambda now: table.sweep(now, ridge), absorbed(start), sweeps, enough)
    return longest_first(factors), left


def extrapolated_sweeps(
    sweep: Callable[[Factors], tuple[Factors, float]],
    start: Factors,
    sweeps: int,
    enough: float,
    balance: Callable[[Factors], Factors] = balanced,
) -> tuple[Factors, float]:
    """Repeat `sweep` from points extrapolated along the last move, or from the last point itself after a worse one.

    Ends when the residual is at most `enough`, or when the last ten sweeps together gained less than a fiftieth of it.

    Parameters
    ----------
    sweep : improves factors; returns them with their residual.
    sweeps : at most.
    balance : normalises factors of the same terms, so that sweeps can be compared.

    Returns
    -------
    The factors, balanced, and their residual.
    """
    last = now = balance(start)
    least, stretch = np.inf, 0.0
    history: list[float] = []
    for _ in range(sweeps):
        found, left = sweep([f + stretch * (f - p) for f, p in zip(now, last, strict=True)])
        if left > least and stretch > 0.0:
            stretch = 0.0
            continue
        least = left
        last, now = now, balance(found)
        history.append(left)
        if left <= enough or (len(history) > 10 and history[-11] - left < 0.02 * left):
            break
        stretch = min(1.2 * stretch + 0.2, 4.0)
    return now, least
