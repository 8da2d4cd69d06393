"""Light transport of one glossy part: from its sites to others, and along its own rays from others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from .hits import Hits

# Sites per block.
_BLOCK = 1024


@dataclass(frozen=True, eq=False)
class Ends:
    """The n rays that hit glossy parts, with G glossy sites.

    site, ray (n,) : origin of each ray, and its index there; row (n,) : index of that site among the G, -1 for a
    diffuse one. share (n,3) : weights of the sites around the hit point. part (n,), cell (n,3) : index of the hit part
    among glossy parts, and the cells, among all cells of that part, that face back along the ray. place (G,) : index of
    each glossy site's part among glossy parts.
    """

    site: Int[np.ndarray, " n"]
    ray: Int[np.ndarray, " n"]
    row: Int[np.ndarray, " n"]
    share: Float[np.ndarray, "n 3"]
    part: Int[np.ndarray, " n"]
    cell: Int[np.ndarray, "n 3"]
    place: Int[np.ndarray, " G"]


@dataclass(frozen=True, eq=False)
class GlossyPart:
    """The G_p sites of one glossy part, with N rays and O cells each. Quantities constant over the part belong to its
    surface.

    part : its index. sites (G_p,) : their indices among all glossy sites. shines (h,) : indices of those of the G_p
        that any ray hits.
    rows (n,), emission (n, G_p O) : irradiance at sites `rows` = this times radiosity (pi times radiance) of cells.
    brings (G_p N, S + u) : pi times the radiance along each ray of its sites = this times radiosity: the diffuse one of
        all sites, followed by that of the u cells that its rays hit.
    cells : for each glossy part with such cells, its index among glossy parts, the slice of the u, and the cells'
        indices in that part.
    at (e,), end (e,) : indices of those of the G_p N rays that hit a glossy part, ascending, and their indices among
        all such rays.
    """

    part: int
    sites: Int[np.ndarray, " G_p"]
    shines: Int[np.ndarray, " h"]
    rows: Int[np.ndarray, " n"]
    emission: Any
    brings: Any
    cells: tuple[tuple[int, slice, Int[np.ndarray, " _"]], ...]
    at: Int[np.ndarray, " e"]
    end: Int[np.ndarray, " e"]

    @classmethod
    def of(cls, hits: Hits, ends: Ends, sites: Int[np.ndarray, " G_p"], place: int, size: int) -> GlossyPart:
        """Build the matrices of one part. sites : of the part, among all sites. place : of the part among glossy ones.
        size : O.
        """
        from scipy.sparse import csr_array, hstack

        mine, own = np.flatnonzero(ends.place == place), np.flatnonzero(ends.part == place)
        ray, corner = np.nonzero(ends.share[own] > 0.0)
        rows, row = np.unique(ends.site[own][ray], return_inverse=True)
        column = ends.cell[own][ray, corner].astype(np.int32)
        value = (ends.share[own][ray, corner] / hits.rays).astype(np.float32)
        emission = csr_array((value, (row.astype(np.int32), column)), shape=(len(rows), len(mine) * size))
        emission.sum_duplicates()
        looks = np.flatnonzero((ends.row >= 0) & (hits.part_of_site[ends.site] == hits.part_of_site[sites[0]]))
        at = np.searchsorted(mine, ends.row[looks]) * hits.rays + ends.ray[looks]
        ray, corner = np.nonzero(ends.share[looks] > 0.0)
        # Cells of one part are contiguous.
        step = len(ends.place) * size
        met, column = np.unique(ends.part[looks][ray] * step + ends.cell[looks][ray, corner], return_inverse=True)
        value = ends.share[looks][ray, corner].astype(np.float32)
        shape = len(mine) * hits.rays, len(met)
        towards = csr_array((value, (at[ray].astype(np.int32), column.astype(np.int32))), shape=shape)
        edges = np.searchsorted(met, np.arange(ends.place.max() + 2) * step).tolist()
        cells = tuple((k, slice(a, b), met[a:b] - k * step) for k, (a, b) in enumerate(pairwise(edges)) if a < b)
        brings = hstack([_evenly(hits, sites), towards], format="csr")
        shines = np.unique(emission.indices // size)
        return cls(int(hits.part_of_site[sites[0]]), mine, shines, rows, emission, brings, cells, at, looks)

    @cached_property
    def by_site(self) -> tuple[Any, Any]:
        """Elements of `brings` with one row per site, (G_p, S + u), and the ray of each element."""
        from scipy.sparse import csr_array

        of, sites = self.brings, len(self.sites)
        ray = np.repeat(np.arange(of.shape[0], dtype=np.int32), np.diff(of.indptr))
        first, shape = of.indptr[:: of.shape[0] // sites], (sites, of.shape[1])
        share, which = (csr_array((data, of.indices, first), shape=shape) for data in (of.data, ray))
        return share, which


def _evenly(hits: Hits, sites: Int[np.ndarray, " n"]) -> Any:
    """Return the matrix (n N, S) from the diffuse radiosity of all sites to pi times the radiance along each ray."""
    from scipy.sparse import csr_array

    data, indices, counts = [], [], []
    for start in range(0, len(sites), _BLOCK):
        some = sites[start : start + _BLOCK]
        about, share = hits.about(hits.triangle[some], hits.place[some])
        inside = share > 0.0
        data.append(share[inside].astype(np.float32))
        indices.append(about[inside].astype(np.int32))
        counts.append(inside.sum(axis=2).ravel())
    first = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)
    shape = (len(sites) * hits.rays, len(hits.sites))
    return csr_array((np.concatenate(data), np.concatenate(indices), first), shape=shape)
