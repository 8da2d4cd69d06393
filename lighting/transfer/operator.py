"""Irradiance operator of a scene: from the radiosity of all sites to the irradiance of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt16

from .hits import Hits

# Sites per block; their rays take some 100 MB.
_BLOCK = 2048
# Number of vectors up to which separate products with a sparse operator are faster than one for all.
_ONE_BY_ONE = 6


def irradiance_operator(hits: Hits) -> Any:
    """Return the sparse matrix G (S,S): irradiance of sites = G times radiosity of sites.

    Rays are cosine-distributed, so that the integral of L cos(theta) over the hemisphere is pi times the mean of L over
    them; with radiosity B = pi L it is the mean of B. Between sites, B is linear on triangles. Rows sum to the share of
    the cosine-weighted hemisphere covered by surfaces that can be lit: at most 1.

    Returns
    -------
    scipy.sparse.csr_array, float32 values.
    """
    from scipy.sparse import csr_array, vstack

    count = len(hits.sites)
    blocks = [
        gathering_rows(hits, hits.triangle[start : start + _BLOCK], hits.place[start : start + _BLOCK])
        for start in range(0, count, _BLOCK)
    ]
    return vstack(blocks, format="csr") if blocks else csr_array((0, 0), dtype=np.float32)


def gathering_rows(hits: Hits, triangle: Int[np.ndarray, "n N"], place: UInt16[np.ndarray, "n N 2"]) -> Any:
    """Return the same matrix (n, S) for any n points, given the hits of their rays."""
    from scipy.sparse import csr_array

    number, share = hits.about(triangle, place)
    inside = share > 0.0
    row = np.broadcast_to(np.arange(len(triangle))[:, None, None], share.shape)[inside]
    # 32-bit indices halve the memory traffic of each bounce.
    places = (row.astype(np.int32), number[inside].astype(np.int32))
    found = csr_array((share[inside] / triangle.shape[1], places), shape=(len(triangle), len(hits.sites)))
    found.sum_duplicates()
    return found.astype(np.float32)


def columns_times(operator: Any, vectors: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m k"]:
    """Multiply a sparse operator with each of some vectors."""
    if len(vectors) > _ONE_BY_ONE:
        return np.ascontiguousarray((operator @ np.ascontiguousarray(vectors.T)).T)
    return np.stack([operator @ each for each in vectors])


@dataclass(frozen=True, eq=False)
class ByPart:
    """G separated by sending part: if radiosity is an amount per site times a colour per part, one number per row
    suffices.

    rows (n, S) : rows of G, split where the sending part changes; they share its data. part (n,) : sending part of
    each. first (S + 1,) : first row of each site.
    """

    rows: Any
    part: Int[np.ndarray, " n"]
    first: Int[np.ndarray, " sites_and_1"]

    @classmethod
    def of(cls, operator: Any, part: Int[np.ndarray, " S"]) -> ByPart:
        """Split an operator by part. operator : G with ascending columns. part : of each site."""
        from scipy.sparse import csr_array

        of_number = part[operator.indices]
        begins = np.append(np.diff(of_number, prepend=-1) != 0, True)
        # An empty row begins where the next one does.
        begins[operator.indptr] = True
        edges = np.flatnonzero(begins)
        rows = csr_array((operator.data, operator.indices, edges), shape=(len(edges) - 1, operator.shape[1]))
        return cls(rows, of_number[edges[:-1]], np.searchsorted(edges, operator.indptr))

    def amounts(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "K n"]:
        """Compute the irradiance of sites by each part if all parts were white."""
        return columns_times(self.rows, np.ascontiguousarray(lux.T))

    def irradiance(
        self, amounts: Float[np.ndarray, "K n"], terms: Sequence[Float[np.ndarray, "P J"]]
    ) -> list[Float[np.ndarray, "S J"]]:
        """Compute the irradiance of sites for each light, with the colours of parts under it."""
        from scipy.sparse import csr_array

        shape = len(self.first) - 1, len(terms[0])
        pairs = zip(amounts, terms, strict=True)
        return [np.asarray(csr_array((amount, self.part, self.first), shape=shape) @ one) for amount, one in pairs]
