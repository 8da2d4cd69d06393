"""What is free around a few sites: signed angular distances to the boundary of what is hidden.

The hemisphere above a site is traced on a map of `RAYS`^2 directions of the sphere. Where two
neighbouring texels differ, a boundary runs between them: one more ray halfway says in which half. Distances are then
taken on a coarser map, `MAP`^2, from the middles of texels to all those boundary points: Wang et al. 2009, eq. 23. The
horizon is no boundary, since renderers cut there anyway and a surface's own horizon changes from vertex to vertex.

Below the horizon of a site nothing is traced: what a point between vertices asks there, just below a vertex's
horizon, is what the horizon mirrors. Maps have the axes of the world, so that neighbours are mixed texel by texel.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..vectors import unit
from . import octahedral
from .occluders import Occluders

#: Sides of the maps that rays are sent along, and that distances are kept on. MAP divides RAYS.
RAYS, MAP = 64, 32
# Below the horizon by this sine, distances still count: points between vertices may ask there.
BELOW = 0.15
# Nearer to a boundary than this (rad, about a texel of rays and a half) a ray of its own says what side a texel is on.
_NEAR = 0.09


class Traced(NamedTuple):
    """Of n sites.

    distances (n, MAP^2) : signed angles, radians, positive where free, at most pi / 2 in size.
    all_free : whether no ray met anything. dark (n,) : where every ray above the horizon met something.
    """

    distances: Float[np.ndarray, "n texels"]
    all_free: bool
    dark: Bool[np.ndarray, " n"]


@cache
def _rays() -> tuple[np.ndarray, ...]:
    """Directions of rays, pairs of neighbours, and what lies halfway between them."""
    to, pairs = octahedral.directions(RAYS), octahedral.neighbours(RAYS)
    halfway = unit(to[pairs[:, 0]] + to[pairs[:, 1]])
    return (to.astype(np.float32), pairs, halfway.astype(np.float32))


@cache
def _texels() -> np.ndarray:
    return octahedral.directions(MAP).astype(np.float32)


def traced(starts: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], occluders: Occluders) -> Traced:
    """Trace n sites from their `starts`, above their unit normals."""
    to, pairs, halfway = _rays()
    starts, normals = starts.astype(np.float32), normals.astype(np.float32)
    above = normals @ to.T > 0.0
    site, texel = np.nonzero(above)
    free = np.ones(above.shape, dtype=bool)
    free[site, texel] = occluders.free(starts[site], to[texel])
    if free.all():
        distances = np.full((len(starts), MAP**2), 0.5 * np.pi, dtype=np.float32)
        return Traced(distances, True, np.zeros(len(starts), dtype=bool))

    a, b = pairs.T
    site, pair = np.nonzero((free[:, a] != free[:, b]) & above[:, a] & above[:, b])
    middle_free = occluders.free(starts[site], halfway[pair])
    beyond = np.where(middle_free == free[site, a[pair]], b[pair], a[pair])
    boundary = unit(halfway[pair] + to[beyond])
    ends = np.searchsorted(site, np.arange(len(starts) + 1))

    sines = normals @ _texels().T
    distances = np.empty((len(starts), MAP**2), dtype=np.float32)
    mirrored = np.empty((*distances.shape, 3), dtype=np.float32)
    for one in range(len(starts)):
        up = _texels() - np.minimum(2.0 * sines[one], 0.0)[:, None] * normals[one]
        mirrored[one] = up
        near = boundary[ends[one] : ends[one + 1]]
        # The largest of each column: rows of boundary points lie one after the other in memory.
        distances[one] = np.arccos(np.clip((near @ up.T).max(axis=0), 0.0, 1.0)) if len(near) else 0.5 * np.pi
    where = octahedral.texel_at(mirrored, RAYS)
    row = np.arange(len(starts))[:, None]
    signs = free[row, where]
    unsure = ((distances < _NEAR) | ~above[row, where]) & (sines > -BELOW)
    one, texel = np.nonzero(unsure)
    signs[one, texel] = occluders.free(starts[one], mirrored[one, texel])
    return Traced(np.where(signs, distances, -distances), False, ~(free & above).any(axis=1))
