"""Transfer tensors of one bounce in clusters of sites, each a smaller tensor: clustered tensor approximation.

Sun et al. 2007 (section 4.3): sites are put in clusters by clustered principal components (Sloan et al. 2003), and the
tensor of each cluster is compressed along its sites and its lights alone; regions, components and harmonics are few.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ....materials.btf.clusters import clustered as in_clusters

#: Components of a cluster's sites and of its lights; a cluster has about so many sites.
SITES, LIGHTS, A_CLUSTER = 32, 64, 1000
# Numbers that tensors are sketched as before they are put in clusters, and components of a cluster there.
_SKETCHED, _COMPONENTS = 64, 8


@dataclass(frozen=True, eq=False)
class Cluster:
    """sites (n,) : which. by_site (n,K), by_light (L,m) : orthonormal. core (K,m,R,P,B)."""

    sites: Int[np.ndarray, " n"]
    by_site: Float[np.ndarray, "n K"]
    by_light: Float[np.ndarray, "L m"]
    core: Float[np.ndarray, "K m R P B"]


@dataclass(frozen=True, eq=False)
class ClusteredTensor:
    """T1 of S sites; `error` is the squared error, relative."""

    clusters: tuple[Cluster, ...]
    count: int
    error: float

    @property
    def nbytes(self) -> int:
        """Bytes of the stored tensors."""
        return sum(one.by_site.nbytes + one.by_light.nbytes + one.core.nbytes for one in self.clusters)

    def lit(self, light: Float[np.ndarray, "K L"]) -> Float[np.ndarray, "S R P K B"]:
        """Compute the light in each harmonic by way of each region and component, of each of K fields of light."""
        _, _, regions, parts, bands = self.clusters[0].core.shape
        found = np.empty((self.count, regions, parts, len(light), bands), dtype=np.float32)
        for one in self.clusters:
            of_light = (light @ one.by_light).astype(np.float32)
            core = np.einsum("nmrps,km->nrpks", one.core, of_light, optimize=True)
            found[one.sites] = (one.by_site @ core.reshape(len(core), -1)).reshape(-1, *core.shape[1:])
        return found


def clustered_tensor(
    one: Float[np.ndarray, "S R P L B"],
    clusters: int | None = None,
    sites: int = SITES,
    lights: int = LIGHTS,
    seed: int = 0,
) -> ClusteredTensor:
    """T1 (`TransferTensors.one`) in clusters; None has one for each `A_CLUSTER` sites, as the paper's scenes have."""
    count = len(one)
    clusters = max(1, round(count / A_CLUSTER)) if clusters is None else clusters
    number = _number(one, clusters, seed)
    found, lost, energy = [], 0.0, 0.0
    for cluster in np.unique(number):
        mine = np.flatnonzero(number == cluster)
        # (n, L, R P B): light before what is not compressed.
        block = np.moveaxis(one[mine], 3, 1)
        shape = block.shape
        block = block.reshape(len(mine), shape[1], -1)
        by_light = _largest(np.einsum("nlx,nmx->lm", block, block, optimize=True).astype(np.float64), lights)
        small = np.einsum("nlx,lm->nmx", block, by_light, optimize=True).reshape(len(mine), -1)
        by_site = _largest((small @ small.T).astype(np.float64), sites)
        core = by_site.T @ small
        squares = float(np.sum(np.square(block, dtype=np.float64)))
        energy += squares
        lost += squares - float(np.sum(np.square(core, dtype=np.float64)))
        found.append(Cluster(mine, by_site, by_light, core.reshape(by_site.shape[1], by_light.shape[1], *shape[2:])))
    return ClusteredTensor(tuple(found), count, max(lost, 0.0) / energy if energy > 0.0 else 0.0)


def _number(one: Float[np.ndarray, "S R P L B"], clusters: int, seed: int) -> Int[np.ndarray, " S"]:
    """Return the cluster of each site: of tensors as few numbers, each a sum of many with random signs."""
    if clusters == 1:
        return np.zeros(len(one), dtype=np.int64)
    draw = np.random.default_rng(seed)
    size = int(np.prod(one.shape[1:]))
    place, sign = draw.integers(_SKETCHED, size=size), draw.choice([-1.0, 1.0], size)
    sketch = np.stack([np.bincount(place, sign * each.ravel(), _SKETCHED) for each in one])
    return in_clusters(sketch, clusters, min(_COMPONENTS, _SKETCHED), seed).number


def _largest(square: Float[np.ndarray, "n n"], count: int) -> Float[np.ndarray, "n k"]:
    """Eigenvectors of the largest values; float32."""
    return np.ascontiguousarray(np.linalg.eigh(square)[1][:, ::-1][:, :count].astype(np.float32))
