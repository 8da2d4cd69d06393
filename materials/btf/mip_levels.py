"""BTFs from afar: coarser and coarser texels, clustered anew.

Weights of different clusters mean different things: there is no mean of them. But each texel is a vector of a space
that all share, and the mean of texels is the mean of their vectors, exactly. These means are brought into clusters of
their own, fewer on every level, for there is ever less that they differ by.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Integer

from ..svbrdf.texels import levels_of
from .clusters import clustered, principal

# Functions per block of means: intermediate results are in float64.
_AT_ONCE = 32
# Principal components of a level among which its clusters are searched.
_SPAN = 64


@dataclass(frozen=True, eq=False)
class TexelLevel:
    """H x W texels of one level: each a sum of what its cluster has.

    number (H,W) : of the clusters. weights (T,c1) : of each texel row by row, of its cluster's mean (1) and components;
    float32. table (k,V,Lt,c1,J) : f_r cos(theta_i), 1/sr, of means and components; float32.
    """

    number: Integer[np.ndarray, "H W"]
    weights: Float[np.ndarray, "T c1"]
    table: Float[np.ndarray, "k V Lt c1 J"]

    @cached_property
    def largest(self) -> Float[np.ndarray, "k c1"]:
        """Largest number of each mean and component; 1 where there is none."""
        found = np.abs(self.table).max(axis=(1, 2, 4))
        return np.where(found > 0.0, found, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Span:
    """The space of all that texels can be: n functions that are orthonormal as they are seen, about one mean.

    rows (k,c1,n) : of each cluster its mean and its components. tabled : of such rows the table of a `TexelLevel`.
    """

    rows: Float[np.ndarray, "k c1 n"]
    tabled: Callable[[Float[np.ndarray, "q c1 n"]], Float[np.ndarray, "q V Lt c1 J"]]


def with_mean(weights: Integer[np.ndarray, "H W c"]) -> Float[np.ndarray, "T c1"]:
    """Stack the weight of each texel's cluster mean, 1, and its weights; float32."""
    mean = np.ones((*weights.shape[:2], 1), np.float32)
    found = np.concatenate([mean, weights.astype(np.float32)], axis=2)
    return found.reshape(-1, found.shape[2])


def coarser(
    number: Integer[np.ndarray, "H W"], weights: Integer[np.ndarray, "H W c"], span: Span
) -> tuple[TexelLevel, ...]:
    """Means of texels over half as many each way, and so on, down to a single one; see `svbrdf.texels.levels_of`."""
    count, of_each = span.rows.shape[:2]
    made = [
        _clustered(means, max(1, count >> halved), of_each)
        for halved, means in enumerate(_means(_vectors(number, with_mean(weights), span.rows)), start=1)
    ]
    if not made:
        return ()
    # One table for all: the span's functions are computed once.
    table, found, first = span.tabled(np.concatenate([rows for _, _, rows in made])), [], 0
    for numbers, own, rows in made:
        found.append(TexelLevel(numbers, own, table[first : first + len(rows)]))
        first += len(rows)
    return tuple(found)


def _clustered(
    means: Float[np.ndarray, "H W n"], clusters: int, of_each: int
) -> tuple[Integer[np.ndarray, "H W"], Float[np.ndarray, "T c1"], Float[np.ndarray, "k c1 n"]]:
    """Number of the cluster, weights, and what clusters' means and components are of a level."""
    vectors = means.reshape(means.shape[0] * means.shape[1], means.shape[2])
    if not vectors.shape[1]:
        # All texels are the mean.
        only = np.concatenate([np.ones((len(vectors), 1)), np.zeros((len(vectors), of_each - 1))], axis=1)
        return np.zeros(means.shape[:2], np.int64), only.astype(np.float32), np.zeros((1, of_each, 0), np.float32)
    middle = vectors.mean(axis=0)
    axes = principal(vectors - middle, max(_SPAN, 2 * of_each))
    made = clustered((vectors - middle) @ axes.T, clusters, of_each - 1)
    parts = np.zeros((len(made.origin), of_each, len(axes)), dtype=np.float32)
    parts[:, 0], parts[:, 1 : 1 + made.axes.shape[1]] = made.origin, made.axes
    weights = np.zeros((len(vectors), of_each), dtype=np.float32)
    weights[:, 0], weights[:, 1 : 1 + made.axes.shape[1]] = 1.0, made.weights
    rows = parts @ axes
    rows[:, 0] += middle
    return made.number.reshape(means.shape[:2]), weights, rows


def _vectors(
    number: Integer[np.ndarray, "H W"], weights: Float[np.ndarray, "T c1"], rows: Float[np.ndarray, "k c1 n"]
) -> Float[np.ndarray, "H W n"]:
    flat = number.ravel()
    found = np.empty((len(flat), rows.shape[2]), dtype=np.float32)
    for cluster in np.unique(flat):
        here = flat == cluster
        found[here] = weights[here] @ rows[cluster]
    return found.reshape(*number.shape, rows.shape[2])


def _means(vectors: Float[np.ndarray, "H W n"]) -> list[Float[np.ndarray, "_ _ n"]]:
    """Compute the means of all levels but the first; float32."""
    if not vectors.shape[2]:
        return [level[..., :0].astype(np.float32) for level in levels_of(np.zeros((*vectors.shape[:2], 1)))[1:]]
    parts = [
        [level.astype(np.float32) for level in levels_of(vectors[..., start : start + _AT_ONCE])[1:]]
        for start in range(0, vectors.shape[2], _AT_ONCE)
    ]
    return [np.concatenate(some, axis=2) for some in zip(*parts, strict=True)]
