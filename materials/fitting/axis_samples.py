"""One axis of a pack met with scattered samples: its factor as a linear least-squares problem.

With all other factors fixed, a sample touches the two nodes beside it, so that the normal equations are block
tridiagonal (R x R blocks; cyclic on a periodic axis) and a banded Cholesky factorisation solves them. A proximal term
pulls the factor towards what it is and lets it change little from node to node: the problem is positive definite, the
objective never rises, and a node that no sample touches moves only as its neighbours do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solveh_banded

# The proximal pull, as a share of the mean curvature of each term's nodes. Less of it fits noise between the samples.
_PULL = 1e-3
# How many times as much a difference between neighbours' changes costs as a change itself. Less of it fits noise, too.
_STIFFNESS = 100.0
# The least pull: keeps a system without any data solvable; its reciprocal is far from overflow.
_TINY = 1e-100


@dataclass(frozen=True, eq=False)
class AxisSamples:
    """Where N samples lie on one axis of n nodes.

    below : the node below each sample. fraction : of the way from there to the next node, 0 to 1.
    order : the samples in the order of their intervals; edges : where each interval begins in that order.
    """

    size: int
    periodic: bool
    below: Int[np.ndarray, " N"]
    fraction: Float[np.ndarray, " N"]
    order: Int[np.ndarray, " N"]
    edges: Int[np.ndarray, " n"]

    @classmethod
    def of(cls, position: Float[np.ndarray, " N"], size: int, periodic: bool) -> AxisSamples:
        """Samples at these positions, counted in nodes: 0 to size - 1 (`Axis.position`)."""
        below = np.minimum(position.astype(np.intp), size - 2)
        order = np.argsort(below, kind="stable")
        edges = np.searchsorted(below[order], np.arange(size))
        return cls(size, periodic, below, position - below, order, edges)

    def interpolated(self, factor: Float[np.ndarray, "n R"]) -> Float[np.ndarray, "N R"]:
        """The factor at every sample, linear between nodes."""
        step = np.diff(factor, axis=0).take(self.below, axis=0)
        step *= self.fraction[:, None]
        step += factor.take(self.below, axis=0)
        return step

    def best_factor(
        self,
        factor: Float[np.ndarray, "n R"],
        rest: Float[np.ndarray, "N R"],
        sensitivity: Float[np.ndarray, "N K S"],
        spectral: Float[np.ndarray, "S R"],
        base_weight: Float[np.ndarray, " N"],
        aim: Float[np.ndarray, "N R"],
    ) -> Float[np.ndarray, "n R"]:
        """The factor that is best with all else fixed, but for the proximal term.

        Parameters
        ----------
        factor : as it is now.
        rest : each term without this factor and its spectrum.
        sensitivity, base_weight : of `SeenSamples`; samples of `sensitivity` in the axis' own `order`.
        spectral : the terms' spectra.
        aim : half the gradient of the cost at a factor of zero, downhill.
        """
        size, rank = factor.shape
        diagonal, beside, right = np.zeros((size, rank, rank)), np.zeros((size - 1, rank, rank)), np.zeros((size, rank))
        high = self.fraction[self.order][:, None]
        aim, rest = aim.take(self.order, axis=0), rest.take(self.order, axis=0)
        one = rest * np.sqrt(base_weight[self.order])[:, None]
        shares = np.hstack([1.0 - high, high])
        # Interval by interval: what is worked on stays in the cache. Each row stands beside itself times its share of
        # the upper node; sums over the lower node's share 1 - h follow from those over 1, h and h squared.
        most = int(np.diff(self.edges).max(initial=0))
        seen = np.empty((most, sensitivity.shape[1], rank))
        colour = np.empty((most, sensitivity.shape[1], 2 * rank))
        simple = np.empty((most, 2 * rank))
        twice = np.tile(spectral.T @ spectral, (2, 2))
        for k in range(size - 1):
            rows = slice(self.edges[k], self.edges[k + 1])
            count = rows.stop - rows.start
            if count == 0:
                continue
            part, flat = colour[:count], simple[:count]
            np.matmul(sensitivity[rows].reshape(-1, len(spectral)), spectral, out=seen[:count].reshape(-1, rank))
            np.multiply(seen[:count], rest[rows, None, :], out=part[:, :, :rank])
            np.multiply(part[:, :, :rank], high[rows, None], out=part[:, :, rank:])
            flat[:, :rank] = one[rows]
            np.multiply(flat[:, :rank], high[rows], out=flat[:, rank:])
            part = part.reshape(-1, 2 * rank)
            found = part.T @ part + twice * (flat.T @ flat)
            all_of_it, once, upper = found[:rank, :rank], found[rank:, :rank], found[rank:, rank:]
            beside[k] = once - upper
            diagonal[k] += all_of_it - once - beside[k]
            diagonal[k + 1] += upper
            total = shares[rows].T @ aim[rows]
            right[k] += total[0]
            right[k + 1] += total[1]
        if self.periodic:
            diagonal[0] += diagonal[-1]
            right[0] += right[-1]
            diagonal, right = diagonal[:-1], right[:-1]
        now = factor[: len(right)]
        curvature = np.einsum("nrr->nr", diagonal)
        pull = np.maximum(_PULL * curvature.mean(axis=0), _TINY)
        own = np.arange(rank)
        diagonal[:, own, own] += pull
        right += pull * now
        # Steps differ little from node to node.
        stiff = _STIFFNESS * pull
        step = np.diff(now, axis=0, append=now[:1]) if self.periodic else np.diff(now, axis=0)
        count = len(step)
        beside[:, own, own] -= stiff
        following = (np.arange(count) + 1) % len(now)
        np.add.at(diagonal, (np.arange(count)[:, None], own, own), stiff)
        np.add.at(diagonal, (following[:, None], own, own), stiff)
        np.add.at(right, np.arange(count), -stiff * step)
        np.add.at(right, following, stiff * step)
        found = _solved_blocks(diagonal, beside, right, self.periodic)
        return np.vstack([found, found[:1]]) if self.periodic else found


def _solved_blocks(
    diagonal: Float[np.ndarray, "n R R"],
    beside: Float[np.ndarray, "m R R"],
    right: Float[np.ndarray, "n R"],
    cyclic: bool,
) -> Float[np.ndarray, "n R"]:
    """Solves a symmetric positive definite system of blocks; beside[k] stands below diagonal[k], cyclic or not.

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
