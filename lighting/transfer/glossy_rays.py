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

from ...runtime.memory import check_room, gigabytes
from .cells import HemisphereCells
from .glossy_part import Ends, GlossyPart
from .hits import Hits, ray_directions

# Sites per block.
_BLOCK = 1024
# Bytes at the peak of each ray of a glossy site, and of each ray there is, of which all may end on glossy parts.
_BYTES_OF_GLOSSY, _BYTES_TOWARDS = 100, 160


@dataclass(frozen=True, eq=False)
class GlossyRays:
    """Rays of G glossy sites among S, N rays each; O cells.

    sites (G,) : their numbers. number (S,) : which of them a site is, -1 of a matt one. within (G,) : which of its
        part's. parts : of each glossy part that has sites.
    local (G, N, 3) : unit directions of the rays in the sites' frames. cell (G, N) : that they lie in.
    escape (G, N) : the texel of the sky that each ray meets; -1 where it meets a part.
    ray (n,) : numbers (site times N + ray) of rays that end on a glossy part, ascending; about (n,3), share (n,3) : the
        sites about these ends.
    """

    cells: HemisphereCells
    sites: Int[np.ndarray, " G"]
    number: Int[np.ndarray, " S"]
    within: Int[np.ndarray, " G"]
    parts: tuple[GlossyPart, ...]
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
        from scipy.sparse import coo_array

        site, ray = np.nonzero(self.escape >= 0)
        texel = self.escape[site, ray].astype(np.int32)
        value = np.full(len(site), np.pi / self.rays, dtype=np.float32)
        place = (site * len(self.cells) + self.cell[site, ray]).astype(np.int32)
        size = (len(self.sites) * len(self.cells), int(texel.max(initial=-1)) + 1)
        # By columns: most rows are empty.
        return coo_array((value, (place, texel)), shape=size).tocsc()

    @classmethod
    def of(
        cls,
        hits: Hits,
        frames: Float[np.ndarray, "S 3 3"],
        escapes: Int[np.ndarray, "S N"],
        glossy: Bool[np.ndarray, " P"],
        cells: HemisphereCells,
    ) -> GlossyRays:
        """glossy : which parts are. escapes : the texel of the sky that each ray meets, -1 of a part.

        Raises
        ------
        InputError : it would not fit into memory.
        """
        count, rays = len(hits.sites), hits.rays
        sites = np.flatnonzero(glossy[hits.part_of_site])
        needed = (len(sites) * _BYTES_OF_GLOSSY + count * _BYTES_TOWARDS) * rays
        words = f"{len(sites):,} glossy sites, {rays} rays each: {gigabytes(needed)} of memory"
        check_room(needed, "what glossy parts pass on does not fit into memory", words, "ask for fewer rays")
        number = np.full(count, -1)
        number[sites] = np.arange(len(sites))
        numbers, place = np.unique(hits.part_of_site[sites], return_inverse=True)
        own = [np.flatnonzero(place == one) for one in range(len(numbers))]
        within = np.empty(len(sites), dtype=np.int64)
        for mine in own:
            within[mine] = np.arange(len(mine))
        ray, about, share, cell = (
            np.concatenate(each) for each in zip(*_ends(hits, frames, glossy, cells), strict=True)
        )
        # Corners of a triangle are of one part; those that are dark have no share, and may be of any.
        there = np.maximum(number[about], 0)
        part = place[np.take_along_axis(there, share.argmax(axis=1)[:, None], axis=1)[:, 0]] if len(ray) else ray
        ends = Ends(ray // rays, ray % rays, number[ray // rays], share, part, within[there] * len(cells) + cell, place)
        parts = tuple(GlossyPart.of(hits, ends, sites[mine], one, len(cells)) for one, mine in enumerate(own))
        local = np.empty((len(sites), rays, 3), dtype=np.float32)
        for start in range(0, len(sites), _BLOCK):
            some = sites[start : start + _BLOCK]
            local[start : start + _BLOCK] = np.einsum("nij,nrj->nri", frames[some], _of_sites(hits, some))
        cell = cells.of(local)
        return cls(cells, sites, number, within, parts, local, cell, escapes[sites], ray, about, share)


def _of_sites(hits: Hits, sites: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n N 3"]:
    return ray_directions(hits.sites.normals[sites], sites, hits.rays)


def _ends(
    hits: Hits, frames: Float[np.ndarray, "S 3 3"], glossy: Bool[np.ndarray, " P"], cells: HemisphereCells
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield rays that end on glossy parts, block by block: number, sites about, shares, and these sites' cells."""
    of_triangle = np.append(np.tile(glossy[hits.part], 2), False)
    for start in range(0, max(len(hits.sites), 1), _BLOCK):
        rows = slice(start, start + _BLOCK)
        which = np.flatnonzero(of_triangle[hits.triangle[rows]])
        about, share = (each.reshape(-1, 3)[which] for each in hits.ends(rows))
        back = -hits.directions(rows).reshape(-1, 3)[which]
        cell = np.empty(about.shape, dtype=np.int32)
        for corner in range(3):
            cell[:, corner] = cells.of(np.einsum("nij,nj->ni", frames[about[:, corner]], back))
        yield which + start * hits.rays, about, share, cell
