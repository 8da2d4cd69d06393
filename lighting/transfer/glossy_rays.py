"""Glossy sites among hit points: data that depends on the set of glossy parts, but on no material, light or camera.

The radiance of a glossy site depends on direction: it is represented by one source per cell of the hemisphere
(`cells`). A ray that hits a glossy part sees, for each of the three sites around the hit point, the cell that faces
back along it. So irradiance is still one sparse operator, and so is the radiance along each ray of a glossy site.
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
# Peak bytes per ray of a glossy site, and per ray of any site, since all rays may hit glossy parts.
_BYTES_OF_GLOSSY, _BYTES_TOWARDS = 100, 160


@dataclass(frozen=True, eq=False)
class GlossyRays:
    """Rays of G glossy sites among S, with N rays and O cells each.

    sites (G,) : their indices. number (S,) : index of each site among the G, -1 for a diffuse one. within (G,) : index
        within its part. parts : one for each glossy part with sites.
    local (G, N, 3) : unit directions of the rays in the sites' frames. cell (G, N) : cell of each ray.
    escape (G, N) : texel of the sky that each ray sees; -1 if it hits a part.
    ray (n,) : indices (site times N + ray) of rays that hit a glossy part, ascending; about (n,3), share (n,3) : the
        sites around these hit points and their weights.
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
        """Number of rays per site, N."""
        return self.local.shape[1]

    @cached_property
    def sky_in_cells(self) -> Any:
        """Matrix (G I, texels) from luminance of the sky, cd/m^2, to illuminance by each cell of glossy sites'
        hemispheres, lux.
        """
        from scipy.sparse import coo_array

        site, ray = np.nonzero(self.escape >= 0)
        texel = self.escape[site, ray].astype(np.int32)
        value = np.full(len(site), np.pi / self.rays, dtype=np.float32)
        place = (site * len(self.cells) + self.cell[site, ray]).astype(np.int32)
        size = (len(self.sites) * len(self.cells), int(texel.max(initial=-1)) + 1)
        # By columns, since most rows are empty.
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
        """Collect the rays of glossy parts. glossy : mask of these parts. escapes : texel of the sky that each ray
        sees, -1 for a part.

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
        # Corners of a triangle belong to one part; dark ones have no weight, and their part is arbitrary.
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
    """Yield blocks of rays that hit glossy parts: index, sites around the hit point, weights, and these sites'
    cells.
    """
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
