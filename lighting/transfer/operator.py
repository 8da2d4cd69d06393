"""The irradiance operator of a scene: what each site receives of what all sites send out."""

from __future__ import annotations

from typing import Any

import numpy as np

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
