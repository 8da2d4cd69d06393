"""Mip levels of clustered BTFs: means of texels, clustered anew.

Weights of different clusters are not comparable, and have no mean. But all texels are vectors of one shared space, and
the mean of texels is exactly the mean of their vectors. These means are clustered again, into fewer clusters on every
level, since they differ less and less.
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
    """H x W texels of one mip level, each a weighted sum of its cluster's mean and components.

    number (H,W) : cluster of each texel. weights (T,c1) : of the cluster's mean (1) and components, texels in row-major
    order; float32. table (k,V,Lt,c1,J) : f_r cos(theta_i), 1/sr, of means and components; float32.
    """

    number: Integer[np.ndarray, "H W"]
    weights: Float[np.ndarray, "T c1"]
    table: Float[np.ndarray, "k V Lt c1 J"]

    @cached_property
    def largest(self) -> Float[np.ndarray, "k c1"]:
        """Largest magnitude of each mean and component; 1 if all its values are 0."""
        found = np.abs(self.table).max(axis=(1, 2, 4))
        return np.where(found > 0.0, found, 1.0).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Span:
    """Space of all texels: n functions, orthonormal in the perceptual metric, about one mean.

    rows (k,c1,n) : coefficients of each cluster's mean and components. tabled : makes the table of a `TexelLevel` from
    such rows.
    """

    rows: Float[np.ndarray, "k c1 n"]
    tabled: Callable[[Float[np.ndarray, "q c1 n"]], Float[np.ndarray, "q V Lt c1 J"]]


def with_mean(weights: Integer[np.ndarray, "H W c"]) -> Float[np.ndarray, "T c1"]:
    """Prepend the weight of the cluster's mean, 1, to the weights of each texel; float32."""
    mean = np.ones((*weights.shape[:2], 1), np.float32)
    found = np.concatenate([mean, weights.astype(np.float32)], axis=2)
    return found.reshape(-1, found.shape[2])


def coarser(
    number: Integer[np.ndarray, "H W"], weights: Integer[np.ndarray, "H W c"], span: Span
) -> tuple[TexelLevel, ...]:
    """Make the coarser levels, half as many texels each way, down to one; see `svbrdf.texels.levels_of`."""
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
    """Cluster the texels of one level: cluster numbers, weights, and coefficients of means and components."""
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
