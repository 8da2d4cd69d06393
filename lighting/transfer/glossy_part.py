"""One glossy part among the ends of rays: what its sites send to others, and what their rays bring of others."""

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
    """The n rays that end on glossy parts, of G glossy sites among all.

    site, ray (n,) : the site that each is of, and which of its rays; row (n,) : which of G that site is, -1 of a matt
    one. share (n,3) : of the sites about the end. part (n,), cell (n,3) : the place among glossy parts of the one that
    it ends on, and the cells that look back along it, of all that part has. place (G,) : of each glossy site's part.
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
    """The G_p sites of one glossy part, of N rays and O cells each. What is equal in all of a part is left to its
    surface.

    part : its number. sites (G_p,) : which of all glossy sites they are. shines (h,) : those of the G_p that any ray
        looks at.
    rows (n,), emission (n, G_p O) : irradiance at sites `rows` = this times radiosity (pi times radiance) of cells.
    brings (G_p N, S + u) : pi times the radiance that each ray of its sites brings = this times radiosity, of what all
        sites send out evenly and of the u cells that its rays look at.
    cells : of each glossy part that these are on, its place among all, which of the u they are, and which of its own.
    at (e,), end (e,) : those of the G_p N rays that end on a glossy part, ascending, and which of all such they are.
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
        """sites : of the part, among all there are. place : of the part among glossy ones. size : O."""
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
        # Cells of one part stand together.
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
        """(G_p, S + u) : the numbers of `brings`, and which of all rays each is of, in one row a site."""
        from scipy.sparse import csr_array

        of, sites = self.brings, len(self.sites)
        ray = np.repeat(np.arange(of.shape[0], dtype=np.int32), np.diff(of.indptr))
        first, shape = of.indptr[:: of.shape[0] // sites], (sites, of.shape[1])
        share, which = (csr_array((data, of.indices, first), shape=shape) for data in (of.data, ray))
        return share, which


def _evenly(hits: Hits, sites: Int[np.ndarray, " n"]) -> Any:
    """(n N, S) : what each ray of sites brings of what all send out evenly."""
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
