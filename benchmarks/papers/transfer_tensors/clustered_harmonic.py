"""Transfer matrices in clusters of sites, each with a mean and principal components: light meets those, not sites.

Mueller, Meseth and Klein 2004 (section 4.3), after Sloan et al. 2003: M_p is the sum over j of
alpha_(p,j) m_(j,k(p)), so that M_p a is a sum of as many vectors m_(j,k) a, which all sites of a cluster share.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt16

from ....materials.btf.clusters import clustered
from .harmonic import HarmonicTransfer

#: The paper's: clusters, and components of each beside its mean.
CLUSTERS, COMPONENTS = 32, 8


@dataclass(frozen=True, eq=False)
class ClusteredHarmonicTransfer:
    """S sites in k clusters.

    number (S,) : the cluster of each. weights (S,c) : of its components. matrices (k,1+c,J,25,25) : mean and
    components. error : squared, relative.
    """

    number: UInt16[np.ndarray, " S"]
    weights: Float[np.ndarray, "S c"]
    matrices: Float[np.ndarray, "k c1 J B B"]
    error: float

    @property
    def nbytes(self) -> int:
        """Bytes of the stored matrices."""
        return self.number.nbytes + self.weights.nbytes + self.matrices.nbytes

    def folded(self, light: Float[np.ndarray, "K B"]) -> Float[np.ndarray, "k c1 K J B"]:
        """Fold light with each cluster's mean and components, all that another light changes."""
        return np.einsum("kcjab,nb->kcnja", self.matrices, light, optimize=True)

    def lit(self, light: Float[np.ndarray, "K B"]) -> Float[np.ndarray, "S K J B"]:
        """Implement `HarmonicTransfer.lit`."""
        folded = self.folded(light)
        found = np.empty((len(self.number), *folded.shape[2:]))
        for cluster, each in enumerate(folded):
            mine = np.flatnonzero(self.number == cluster)
            components = each[1:].reshape(len(each) - 1, -1)
            found[mine] = each[0] + (self.weights[mine] @ components).reshape(len(mine), *each.shape[1:])
        return found


def clustered_transfer(
    transfer: HarmonicTransfer, clusters: int = CLUSTERS, components: int = COMPONENTS, seed: int = 0
) -> ClusteredHarmonicTransfer:
    """Return the matrices of all sites, compressed."""
    shape = transfer.matrices.shape[1:]
    vectors = transfer.matrices.reshape(len(transfer.matrices), -1)
    # Clusters are found in the coordinates in which sites differ: no more numbers each than there are sites.
    mean = vectors.mean(axis=0)
    off = vectors.astype(np.float64) - mean
    rows, axes = _compact(off)
    found = clustered(rows, clusters, components, seed)
    origin = found.origin @ axes + mean
    parts = np.concatenate([origin[:, None], found.axes @ axes], axis=1)
    made = found.origin[found.number] + np.einsum("nc,ncg->ng", found.weights, found.axes[found.number])
    left = float(np.sum((rows - made) ** 2) + np.sum(off**2) - np.sum(rows**2))
    whole = float(np.sum(vectors.astype(np.float64) ** 2))
    return ClusteredHarmonicTransfer(
        found.number.astype(np.uint16),
        found.weights.astype(np.float32),
        parts.reshape(*parts.shape[:2], *shape).astype(np.float32),
        max(left, 0.0) / whole if whole > 0.0 else 0.0,
    )


# Coordinates that vectors are clustered in; what is left by so many is far below what clusters leave.
_COORDINATES = 64


def _compact(small: Float[np.ndarray, "S G"]) -> tuple[Float[np.ndarray, "S g"], Float[np.ndarray, "g G"]]:
    """Vectors in the coordinates of their largest principal components, and those."""
    if len(small) <= small.shape[1]:
        squares, sides = np.linalg.eigh(small @ small.T)
        kept = np.flatnonzero(squares > 1e-12 * max(float(squares[-1]), np.finfo(float).tiny))[-_COORDINATES:]
        axes = (sides[:, kept] / np.sqrt(squares[kept])).T @ small
    else:
        squares, sides = np.linalg.eigh(small.T @ small)
        kept = np.flatnonzero(squares > 1e-12 * max(float(squares[-1]), np.finfo(float).tiny))[-_COORDINATES:]
        axes = sides[:, kept].T
    return small @ axes.T, axes
