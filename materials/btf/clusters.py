"""Local PCA: clusters of vectors, each with its own principal components.

Kambhatla and Leen 1997's vector-quantised PCA, as used by Mueller, Meseth and Klein 2004 (section 3): a vector belongs
to the cluster whose components leave the smallest residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

# Vectors that beginnings are tried on, how many beginnings, and rounds of each; rounds of the best with all vectors.
_TRIED, _BEGINNINGS, _SHORT, _LONG = 4096, 3, 3, 10
# Rounds end where one leaves so small a share less.
_ENOUGH = 2e-3


@dataclass(frozen=True, eq=False)
class Clusters:
    """N vectors in k clusters of c components.

    number (N,) : cluster of each vector. origin (k,G), axes (k,c,G) : mean and components, orthonormal in the metric of
    the vectors; zero rows if a cluster has fewer. weights (N,c) : coordinates along the components.
    """

    number: Int[np.ndarray, " N"]
    origin: Float[np.ndarray, "k G"]
    axes: Float[np.ndarray, "k c G"]
    weights: Float[np.ndarray, "N c"]


def clustered(vectors: Float[np.ndarray, "N G"], clusters: int, components: int, seed: int = 0) -> Clusters:
    """Cluster vectors into at most `clusters` clusters, no more than there are distinct vectors, and none empty.

    A cluster that runs empty restarts at the vector with the largest residual.
    """
    draw = np.random.default_rng(seed)
    tried = vectors[np.sort(draw.permutation(len(vectors))[:_TRIED])]
    clusters = min(clusters, len(np.unique(tried, axis=0)))
    components = min(components, vectors.shape[1])
    beginnings = [_begun(tried, clusters, components, draw) for _ in range(_BEGINNINGS if clusters > 1 else 1)]
    _, origin, axes = min(beginnings, key=lambda one: one[0])
    best, least = (origin, axes), np.inf
    for _ in range(_LONG):
        left = _left(vectors, origin, axes)
        after = float(left.min(axis=1).sum())
        if least < np.inf and not least - after > _ENOUGH * least:
            break
        best, least = (origin, axes), after
        origin, axes = _components(vectors, _filled(left), clusters, components, draw)
    # Keep the best round, without clusters that ended without vectors.
    origin, axes = best
    used, number = np.unique(nearest(vectors, origin, axes), return_inverse=True)
    origin, axes = origin[used], axes[used]
    return Clusters(number, origin, axes, weights_of(vectors, number, origin, axes))


def _begun(
    tried: Float[np.ndarray, "N G"], clusters: int, components: int, draw: np.random.Generator
) -> tuple[float, Float[np.ndarray, "k G"], Float[np.ndarray, "k c G"]]:
    """Run a few rounds from random vectors; return the sum of squared residuals, means and components."""
    left = _squares(tried, tried[draw.permutation(len(tried))[:clusters]])
    origin, axes = _components(tried, left.argmin(axis=1), clusters, components, draw)
    for _ in range(_SHORT):
        left = _left(tried, origin, axes)
        origin, axes = _components(tried, left.argmin(axis=1), clusters, components, draw)
    return float(left.min(axis=1).sum()), origin, axes


def weights_of(
    vectors: Float[np.ndarray, "N G"],
    number: Int[np.ndarray, " N"],
    origin: Float[np.ndarray, "k G"],
    axes: Float[np.ndarray, "k c G"],
) -> Float[np.ndarray, "N c"]:
    """Project vectors onto the components of their clusters."""
    found = np.zeros((len(vectors), axes.shape[1]), dtype=vectors.dtype)
    for cluster in np.unique(number):
        here = number == cluster
        found[here] = (vectors[here] - origin[cluster]) @ axes[cluster].T
    return found


def nearest(
    vectors: Float[np.ndarray, "N G"], origin: Float[np.ndarray, "k G"], axes: Float[np.ndarray, "k c G"]
) -> Int[np.ndarray, " N"]:
    """Assign each vector to the cluster with the smallest residual."""
    return _left(vectors, origin, axes).argmin(axis=1)


def _filled(left: Float[np.ndarray, "N k"]) -> Int[np.ndarray, " N"]:
    """Assign each vector to its best cluster, and to each empty cluster the vector with the largest residual."""
    number, off = left.argmin(axis=1), left.min(axis=1).copy()
    count = np.bincount(number, minlength=left.shape[1])
    for empty in np.flatnonzero(count == 0):
        spare = np.where(count[number] > 1, off, -np.inf)
        worst = int(spare.argmax())
        if spare[worst] <= 0.0:
            break
        count[number[worst]] -= 1
        number[worst], off[worst] = empty, 0.0
        count[empty] = 1
    return number


def _components(
    vectors: Float[np.ndarray, "N G"],
    number: Int[np.ndarray, " N"],
    clusters: int,
    components: int,
    draw: np.random.Generator,
) -> tuple[Float[np.ndarray, "k G"], Float[np.ndarray, "k c G"]]:
    """Compute means and principal components; zero rows if a cluster has too few vectors for all of them."""
    size = vectors.shape[1]
    origin = np.zeros((clusters, size), dtype=vectors.dtype)
    axes = np.zeros((clusters, components, size), dtype=vectors.dtype)
    for cluster in range(clusters):
        mine = vectors[number == cluster]
        if not len(mine):
            mine = vectors[draw.integers(len(vectors))][None]
        origin[cluster] = mine.mean(axis=0)
        if not components:
            continue
        directions = principal(mine - origin[cluster], components)
        axes[cluster, : len(directions)] = directions
    return origin, axes


def principal(off: Float[np.ndarray, "n G"], components: int) -> Float[np.ndarray, "c G"]:
    """Compute at most `components` principal components of centred vectors, largest first; zeros beyond the rank."""
    squares, directions = np.linalg.eigh(off.T @ off)
    directions = directions[:, ::-1][:, :components].T
    # An eigenvector's sign is rounding's choice: its largest entry is positive.
    largest = np.abs(directions).argmax(axis=1)
    sign = np.sign(directions[np.arange(len(directions)), largest])
    some = squares[::-1][:components] > 1e-12 * max(float(squares[-1]), np.finfo(np.float32).tiny)
    return directions * (sign * some)[:, None]


def _left(
    vectors: Float[np.ndarray, "N G"], origin: Float[np.ndarray, "k G"], axes: Float[np.ndarray, "k c G"]
) -> Float[np.ndarray, "N k"]:
    """Compute the squared residual of each vector in each cluster."""
    found = _squares(vectors, origin)
    for cluster in range(len(origin)):
        along = (vectors - origin[cluster]) @ axes[cluster].T
        found[:, cluster] -= np.einsum("nc,nc->n", along, along)
    return np.maximum(found, 0.0)


def _squares(vectors: Float[np.ndarray, "N G"], about: Float[np.ndarray, "k G"]) -> Float[np.ndarray, "N k"]:
    """Compute squared distances to each of k points."""
    own = np.einsum("ng,ng->n", vectors, vectors)[:, None]
    return np.maximum(own - 2.0 * vectors @ about.T + np.einsum("kg,kg->k", about, about), 0.0)
