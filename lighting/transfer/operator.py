"""The irradiance operator of a scene: what each site receives of what all sites send out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from .hits import Hits

# Sites at once: their rays take some 100 MB.
_BLOCK = 2048


def irradiance_operator(hits: Hits) -> Any:
    """G (S,S), sparse: irradiance at each site = G times radiosity at all.

    Rays are as dense as the cosine, so that the integral of L cos(theta) over the hemisphere is pi times the mean of L
    over them, and with radiosity B = pi L it is the mean of B. Between sites, B is linear on triangles. Rows sum to the
    share of the cosine-weighted hemisphere in which something lit may be: at most 1.

    Returns
    -------
    scipy.sparse.csr_array, float32 values.
    """
    from scipy.sparse import csr_array

    count, blocks = len(hits.sites), []
    for start in range(0, count, _BLOCK):
        rows = slice(start, min(start + _BLOCK, count))
        number, share = hits.ends(rows)
        inside = share > 0.0
        row = np.broadcast_to(np.arange(rows.stop - rows.start)[:, None, None], share.shape)[inside]
        size = (rows.stop - rows.start, count)
        # Small numbers of sites: half the bytes that each bounce reads.
        places = (row.astype(np.int32), number[inside].astype(np.int32))
        block = csr_array((share[inside] / hits.rays, places), shape=size)
        block.sum_duplicates()
        blocks.append(block.astype(np.float32))
    from scipy.sparse import vstack

    return vstack(blocks, format="csr") if blocks else csr_array((0, 0), dtype=np.float32)


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

    def amounts(self, lux: Float[np.ndarray, "S K"]) -> Float[np.ndarray, "n K"]:
        """What sites receive of those of each part, were all white."""
        return np.stack([self.rows @ np.ascontiguousarray(each) for each in lux.T], axis=1)

    def irradiance(
        self, amounts: Float[np.ndarray, "n K"], terms: Float[np.ndarray, "P J"]
    ) -> Float[np.ndarray, "S KJ"]:
        """The same in the colours of the parts."""
        from scipy.sparse import csr_array

        shape = len(self.first) - 1, len(terms)
        each = (csr_array((amount, self.part, self.first), shape=shape) @ terms for amount in amounts.T)
        return np.concatenate([np.ascontiguousarray(one) for one in each], axis=1)
