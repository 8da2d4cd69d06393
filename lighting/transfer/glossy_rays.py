"""Glossy sites among the ends of rays: what depends on which parts are glossy, and on no material, light or camera.

A glossy site sends out another radiance into each direction: it is as many sources as the hemisphere has cells
(`cells`). A ray that ends on a glossy part sees, of each of the three sites about its end, the cell that looks back
along it. So what all sites receive is still one sparse operator, and so is what each ray of a glossy site brings.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.memory import check_room, gigabytes
from .cells import Cells
from .hits import Hits, ray_directions

# Sites at once.
_BLOCK = 1024
# Bytes at the peak of each ray of a glossy site, and of each ray there is, of which all may end on glossy parts.
_BYTES_OF_GLOSSY, _BYTES_TOWARDS = 100, 160


@dataclass(frozen=True, eq=False)
class GlossyPart:
    """What the G_p sites of one glossy part send to others; what is equal in all of a part is left to its surface.

    part : its number. sites (G_p,) : which of all glossy sites they are.
    rows (n,), emission (n, G_p O) : irradiance at sites `rows` = this times radiosity (pi times radiance) of cells.
    seen (u,), cells (u,) : of the cells that rays of glossy sites end on, which are this part's; and which of its own.
    """

    part: int
    sites: Int[np.ndarray, " G_p"]
    rows: Int[np.ndarray, " n"]
    emission: Any
    seen: Int[np.ndarray, " u"]
    cells: Int[np.ndarray, " u"]


@dataclass(frozen=True, eq=False)
class GlossyRays:
    """Of G glossy sites among S, N rays each; O cells.

    sites (G,) : their numbers. number (S,) : which of them a site is, -1 of a matt one.
    parts : of each glossy part that has sites.
    evenly, towards, at_ends : (G N, S), (G N, U) and (G N, n): pi times the radiance that each ray of glossy sites
        brings, of sites that send out evenly, of the U cells that such rays end on, and of what `ray` bring beside.
    local (G, N, 3) : unit directions of the rays in the sites' frames. cell (G, N) : that they lie in.
    escape (G, N) : the texel of the sky that each ray meets; -1 where it meets a part.
    ray (n,) : numbers (site times N + ray) of rays that end on a glossy part, ascending; about (n,3), share (n,3) : the
        sites about these ends.
    """

    cells: Cells
    sites: Int[np.ndarray, " G"]
    number: Int[np.ndarray, " S"]
    parts: tuple[GlossyPart, ...]
    evenly: Any
    towards: Any
    at_ends: Any
    local: Float[np.ndarray, "G N 3"]
    cell: Int[np.ndarray, "G N"]
    escape: Int[np.ndarray, "G N"]
    ray: Int[np.ndarray, " n"]
    about: Int[np.ndarray, "n 3"]
    share: Float[np.ndarray, "n 3"]

    @property
    def rays(self) -> int:
        """N."""
        return self.local.shape[1]

    @cached_property
    def sky_in_cells(self) -> Any:
        """(G I, texels): lux from each cell of glossy sites' hemispheres = this times luminance of the sky, cd/m^2."""
        from scipy.sparse import csr_array

        site, ray = np.nonzero(self.escape >= 0)
        texel = self.escape[site, ray].astype(np.int32)
        value = np.full(len(site), np.pi / self.rays, dtype=np.float32)
        place = (site * len(self.cells) + self.cell[site, ray]).astype(np.int32)
        size = (len(self.sites) * len(self.cells), int(texel.max(initial=-1)) + 1)
        found = csr_array((value, (place, texel)), shape=size)
        found.sum_duplicates()
        return found

    @classmethod
    def of(
        cls,
        hits: Hits,
        frames: Float[np.ndarray, "S 3 3"],
        escapes: Int[np.ndarray, "S N"],
        glossy: Bool[np.ndarray, " P"],
        cells: Cells,
    ) -> GlossyRays:
        """glossy : which parts are. escapes : the texel of the sky that each ray meets, -1 of a part.

        Raises
        ------
        InputError : it would not fit into memory.
        """
        from scipy.sparse import csr_array

        count, rays, size = len(hits.sites), hits.rays, len(cells)
        mine = glossy[hits.part_of_site]
        sites = np.flatnonzero(mine)
        needed = (len(sites) * _BYTES_OF_GLOSSY + count * _BYTES_TOWARDS) * rays
        words = f"{len(sites):,} glossy sites, {rays} rays each: {gigabytes(needed)} of memory"
        check_room(needed, "what glossy parts pass on does not fit into memory", words, "ask for fewer rays")
        number = np.full(count, -1)
        number[sites] = np.arange(len(sites))
        local = np.empty((len(sites), rays, 3), dtype=np.float32)
        ends = list(_ends(hits, frames, glossy, number, cells))
        ray, about, share, column = (np.concatenate([one[k] for one in ends]) for k in range(4))
        for start in range(0, len(sites), _BLOCK):
            some = sites[start : start + _BLOCK]
            local[start : start + _BLOCK] = np.einsum("nij,nrj->nri", frames[some], _of_sites(hits, some))
        evenly = _evenly(hits, sites)
        row = number[ray // rays]
        of_glossy = np.flatnonzero(row >= 0)
        place = row[of_glossy] * rays + ray[of_glossy] % rays
        met, which = np.unique(column[of_glossy][share[of_glossy] > 0.0], return_inverse=True)
        inside = share[of_glossy] > 0.0
        towards = csr_array(
            (
                share[of_glossy][inside].astype(np.float32),
                (np.repeat(place, inside.sum(axis=1)).astype(np.int32), which.astype(np.int32)),
            ),
            shape=(len(sites) * rays, len(met)),
        )
        at_ends = csr_array(
            (np.ones(len(of_glossy), dtype=np.float32), (place.astype(np.int32), of_glossy.astype(np.int32))),
            shape=(len(sites) * rays, len(ray)),
        )
        parts = tuple(_parts(hits.part_of_site[sites], (ray // rays, share / rays, column), met, size))
        cell = cells.of(local)
        return cls(
            cells, sites, number, parts, evenly, towards, at_ends, local, cell, escapes[sites], ray, about, share
        )


def _parts(
    part: Int[np.ndarray, " G"],
    ends: tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"], Int[np.ndarray, "n 3"]],
    met: Int[np.ndarray, " U"],
    size: int,
) -> Iterator[GlossyPart]:
    """ends : of rays that end on glossy parts, their site, shares of the sites about it, and columns of cells."""
    from scipy.sparse import csr_array

    site, share, column = ends
    within, of_cell = np.empty(len(part), dtype=np.int64), part[met // size]
    # All corners of a triangle are of its part, and those that are dark have no share.
    of_ray = part[np.take_along_axis(column, share.argmax(axis=1)[:, None], axis=1)[:, 0] // size]
    for number in np.unique(part):
        mine, rays = np.flatnonzero(part == number), np.flatnonzero(of_ray == number)
        within[mine] = np.arange(len(mine))
        row, corner = np.nonzero(share[rays] > 0.0)
        chosen = column[rays][row, corner]
        rows, place = np.unique(site[rays][row], return_inverse=True)
        emission = csr_array(
            (
                share[rays][row, corner].astype(np.float32),
                (place.astype(np.int32), (within[chosen // size] * size + chosen % size).astype(np.int32)),
            ),
            shape=(len(rows), len(mine) * size),
        )
        emission.sum_duplicates()
        seen = np.flatnonzero(of_cell == number)
        cells = within[met[seen] // size] * size + met[seen] % size
        yield GlossyPart(int(number), mine, rows, emission, seen, cells)


def _of_sites(hits: Hits, sites: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n N 3"]:
    return ray_directions(hits.sites.normals[sites], sites, hits.rays)


def _ends(
    hits: Hits,
    frames: Float[np.ndarray, "S 3 3"],
    glossy: Bool[np.ndarray, " P"],
    number: Int[np.ndarray, " S"],
    cells: Cells,
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Of rays that end on glossy parts, block by block: number, sites about, shares, and columns of cells."""
    of_triangle = np.append(np.tile(glossy[hits.part], 2), False)
    for start in range(0, max(len(hits.sites), 1), _BLOCK):
        rows = slice(start, start + _BLOCK)
        which = np.flatnonzero(of_triangle[hits.triangle[rows]])
        about, share = (each.reshape(-1, 3)[which] for each in hits.ends(rows))
        back = -hits.directions(rows).reshape(-1, 3)[which]
        column = np.empty(about.shape, dtype=np.int32)
        for corner in range(3):
            seen = np.einsum("nij,nj->ni", frames[about[:, corner]], back)
            # A corner without a share may be of no glossy site.
            column[:, corner] = np.maximum(number[about[:, corner]], 0) * len(cells) + cells.of(seen)
        yield which + start * hits.rays, about, share, column


def _evenly(hits: Hits, sites: Int[np.ndarray, " G"]) -> Any:
    from scipy.sparse import csr_array

    data, indices, counts = [], [], []
    for start in range(0, len(sites), _BLOCK):
        some = sites[start : start + _BLOCK]
        about, share = hits.about(hits.triangle[some], hits.place[some])
        inside = share > 0.0
        data.append(share[inside].astype(np.float32))
        indices.append(about[inside].astype(np.int32))
        counts.append(inside.sum(axis=2).ravel())
    if not data:
        return csr_array((0, len(hits.sites)), dtype=np.float32)
    first = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int32)
    shape = (len(sites) * hits.rays, len(hits.sites))
    return csr_array((np.concatenate(data), np.concatenate(indices), first), shape=shape)
