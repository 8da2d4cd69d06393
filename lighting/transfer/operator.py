"""The irradiance operator of a scene: what each site receives of what all sites send out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt16

from .hits import Hits

# Sites per block: their rays take some 100 MB.
_BLOCK = 2048
# Vectors up to which a sparse operator takes less time for one after the other than for all together.
_ONE_BY_ONE = 6


def irradiance_operator(hits: Hits) -> Any:
    """G (S,S), sparse: irradiance at each site = G times radiosity at all.

    Rays are as dense as the cosine, so that the integral of L cos(theta) over the hemisphere is pi times the mean of L
    over them, and with radiosity B = pi L it is the mean of B. Between sites, B is linear on triangles. Rows sum to the
    share of the cosine-weighted hemisphere in which something lit may be: at most 1.

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
    """Return the same of any n places, of whose rays this is where they end: (n, S)."""
    from scipy.sparse import csr_array

    number, share = hits.about(triangle, place)
    inside = share > 0.0
    row = np.broadcast_to(np.arange(len(triangle))[:, None, None], share.shape)[inside]
    # Small numbers of sites: half the bytes that each bounce reads.
    places = (row.astype(np.int32), number[inside].astype(np.int32))
    found = csr_array((share[inside] / triangle.shape[1], places), shape=(len(triangle), len(hits.sites)))
    found.sum_duplicates()
    return found.astype(np.float32)


def columns_times(operator: Any, vectors: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m k"]:
    """Return a sparse operator times each of some vectors."""
    if len(vectors) > _ONE_BY_ONE:
        return np.ascontiguousarray((operator @ np.ascontiguousarray(vectors.T)).T)
    return np.stack([operator @ each for each in vectors])


@dataclass(frozen=True, eq=False)
class ByPart:
    """G with what comes from each part kept apart: light of one amount a site and one colour a part costs one number.

    rows (n, S) : those of G, cut where the part of the sender changes; they share its numbers. part (n,) : of the
    senders of each. first (S + 1,) : the first row of each site.
    """

    rows: Any
    part: Int[np.ndarray, " n"]
    first: Int[np.ndarray, " sites_and_1"]

    @classmethod
    def of(cls, operator: Any, part: Int[np.ndarray, " S"]) -> ByPart:
        """operator : G with ascending columns. part : of each site."""
        from scipy.sparse import csr_array

        of_number = part[operator.indices]
        begins = np.append(np.diff(of_number, prepend=-1) != 0, True)
        # A row without numbers begins where the next one does.
        begins[operator.indptr] = True
        edges = np.flatnonzero(begins)
        rows = csr_array((operator.data, operator.indices, edges), shape=(len(edges) - 1, operator.shape[1]))
        return cls(rows, of_number[edges[:-1]], np.searchsorted(edges, operator.indptr))

    def amounts(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "K n"]:
        """Compute the light that sites receive of each part, were all white."""
        return columns_times(self.rows, np.ascontiguousarray(lux.T))

    def irradiance(
        self, amounts: Float[np.ndarray, "K n"], terms: Sequence[Float[np.ndarray, "P J"]]
    ) -> list[Float[np.ndarray, "S J"]]:
        """Return the same of each light, in the colours that the parts have under it."""
        from scipy.sparse import csr_array

        shape = len(self.first) - 1, len(terms[0])
        pairs = zip(amounts, terms, strict=True)
        return [np.asarray(csr_array((amount, self.part, self.first), shape=shape) @ one) for amount, one in pairs]
