"""One axis of a pack fitted to scattered samples: its factor as a linear least-squares problem.

With all other factors fixed, a sample touches the two nodes beside it, so that the normal equations are block
tridiagonal (R x R blocks; cyclic on a periodic axis) and a banded Cholesky factorisation solves them. A proximal term
pulls the factor towards its current value and penalises differences of the change between neighbouring nodes: the
problem is positive definite, the objective never rises, and a node without samples moves only with its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solveh_banded

#: Most samples of a block.
BLOCK = 512
# The proximal pull, as a share of the mean curvature of each term's nodes. Less of it fits noise between the samples.
_PULL = 1e-3
# Cost of a difference between neighbours' changes, relative to that of a change itself. Less of it fits noise, too.
_STIFFNESS = 100.0
# The least pull: keeps a system without any data solvable; its reciprocal is far from overflow.
_TINY = 1e-100


@dataclass(frozen=True, eq=False)
class AxisSamples:
    """Places of N samples on one axis of n nodes.

    below : the node below each sample. fraction : of the way from there to the next node, 0 to 1.
    order : permutation that sorts the samples by interval; edges : start of each interval in that order.
    """

    size: int
    periodic: bool
    below: Int[np.ndarray, " N"]
    fraction: Float[np.ndarray, " N"]
    order: Int[np.ndarray, " N"]
    edges: Int[np.ndarray, " n"]

    @classmethod
    def of(cls, position: Float[np.ndarray, " N"], size: int, periodic: bool) -> AxisSamples:
        """Locate samples at positions in units of nodes, 0 to size - 1 (`Axis.position`)."""
        below = np.minimum(position.astype(np.intp), size - 2)
        order = np.argsort(below, kind="stable")
        edges = np.searchsorted(below[order], np.arange(size))
        return cls(size, periodic, below, position - below, order, edges)

    def interpolated(self, factor: Float[np.ndarray, "n R"]) -> Float[np.ndarray, "N R"]:
        """Interpolate the factor at every sample, linear between nodes."""
        step = np.diff(factor, axis=0).take(self.below, axis=0)
        step *= self.fraction[:, None]
        step += factor.take(self.below, axis=0)
        return step

    def blocks(self) -> Iterator[tuple[int, slice]]:
        """Yield each interval's rows of `order` in blocks small enough for the cache, with the interval."""
        for interval, (start, end) in enumerate(pairwise(self.edges.tolist())):
            for first in range(start, end, BLOCK):
                yield interval, slice(first, min(first + BLOCK, end))

    def step(
        self,
        factor: Float[np.ndarray, "n R"],
        sums: Float[np.ndarray, "m 3 R R"],
        right: Float[np.ndarray, "m 2 R"],
        rounding: Float[np.ndarray, "m R"],
    ) -> Float[np.ndarray, "n R"]:
        """Solve for the change of a factor that is optimal with all else fixed, up to the proximal term.

        Parameters
        ----------
        factor : current value.
        sums : for each of the m = n - 1 intervals: curvature summed over its samples; the same times their fraction h
            of the way to the upper node; the same times h squared.
        right : half the negative gradient, summed times 1 - h and times h.
        rounding : upper bound of the rounding error of `sums`, which is added to the curvature of either node.
        """
        size, rank = factor.shape
        diagonal, gradient = np.zeros((size, rank, rank)), np.zeros((size, rank))
        beside = sums[:, 1] - sums[:, 2]
        diagonal[:-1] = sums[:, 0] - sums[:, 1] - beside
        diagonal[1:] += sums[:, 2]
        own = np.arange(rank)
        diagonal[:-1, own, own] += rounding
        diagonal[1:, own, own] += rounding
        gradient[:-1] = right[:, 0]
        gradient[1:] += right[:, 1]
        if self.periodic:
            diagonal[0] += diagonal[-1]
            gradient[0] += gradient[-1]
            diagonal, gradient = diagonal[:-1], gradient[:-1]
        count = len(gradient)
        pull = np.maximum(_PULL * np.einsum("nrr->nr", diagonal).mean(axis=0), _TINY)
        # Steps differ little from node to node.
        neighbours = np.full(count, 2.0)
        if not self.periodic:
            neighbours[[0, -1]] = 1.0
        diagonal[:, own, own] += pull * (1.0 + _STIFFNESS * neighbours[:, None])
        beside[:, own, own] -= _STIFFNESS * pull
        found = _solved_blocks(diagonal, beside, gradient, self.periodic)
        return np.vstack([found, found[:1]]) if self.periodic else found


def _solved_blocks(
    diagonal: Float[np.ndarray, "n R R"],
    beside: Float[np.ndarray, "m R R"],
    right: Float[np.ndarray, "n R"],
    cyclic: bool,
) -> Float[np.ndarray, "n R"]:
    """Solve a symmetric positive definite block system; beside[k] is below diagonal[k], cyclic or not.

    A cycle is folded, nodes 0, n-1, 1, n-2, ...: neighbours are then at most two blocks apart.
    """
    size, rank = right.shape
    place = np.arange(size)
    if cyclic:
        place = np.where(2 * np.arange(size) < size, 2 * np.arange(size), 2 * (size - np.arange(size)) - 1)
    reach = 3 if cyclic else 2
    blocks = np.zeros((size, reach, rank, rank))
    blocks[place, 0] = diagonal
    one, other = np.arange(len(beside)), (np.arange(len(beside)) + 1) % size
    low, high = np.minimum(place[one], place[other]), np.maximum(place[one], place[other])
    # Every block beside the diagonal is symmetric: which of the two is above does not matter. Two nodes meet twice.
    np.add.at(blocks, (low, high - low), beside)
    stacked = blocks.reshape(size, reach * rank, rank)
    offset = np.arange(rank)[None, :] + np.arange(reach * rank)[:, None]
    inside = offset < reach * rank
    band = np.where(inside, stacked[:, np.minimum(offset, reach * rank - 1), np.arange(rank)[None, :]], 0.0)
    band = np.moveaxis(band, 1, 0).reshape(reach * rank, size * rank)
    sorted_right = np.empty_like(right)
    sorted_right[place] = right
    found = solveh_banded(band, sorted_right.reshape(-1), overwrite_ab=True, lower=True, check_finite=False)
    return found.reshape(size, rank)[place]
