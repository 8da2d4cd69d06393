"""Tracing of visibility around a few sites: signed angular distances to the occlusion boundary.

A ray is traced through the centre of each texel of a map of the sphere, `MAP`^2, above a site's horizon. A cell between
four centres that are not all free or all hidden is sampled twice as finely, and so are cells along the horizon and
those that a boundary enters from such a cell. Between two differing neighbours of the finer grid runs a boundary; one
more ray halfway decides in which half. Distances are computed from texel centres to all these boundary points: Wang et
al. 2009, eq. 23. The horizon is no boundary, since renderers clip there anyway and a surface's own horizon changes from
vertex to vertex.

Below the horizon of a site nothing is traced: the map there mirrors the part above, for points between vertices that
look just below a vertex's horizon. Maps have the axes of the world, so that neighbours are interpolated texel by texel.

An occluder that no texel centre hits, at most 5.6 degrees across, is missed from that site.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from ..environment import octahedral
from ..environment.octahedral import bordered, places, unfolded
from ..vectors import dot, unit
from .occluders import Occluders

#: Side of the maps of distances, texels.
MAP = 32
#: Points along a side of the finer grid, rim included: every second one, from the second on, is a texel centre.
GRID = 2 * MAP + 1
# Sine below the horizon down to which distances have full weight, since points between vertices may look there.
BELOW = 0.15
# States of directions as bits, to be combined by `or` and `xor`; 0 if not traced.
_FREE, _HIDDEN, _BOTH = 1, 2, 3


class Traced(NamedTuple):
    """Traced distances of n sites.

    distances (n, MAP^2) : signed angles, radians, positive where free, at most pi / 2 in size.
    all_free : whether no ray hit anything. dark (n,) : sites whose every ray above the horizon hit something.
    """

    distances: Float[np.ndarray, "n texels"]
    all_free: bool
    dark: Bool[np.ndarray, " n"]


class _Grid(NamedTuple):
    """The finer grid, float32.

    to (GRID^2, 3) : directions of its points. ends (E, 2) : end points of its edges, those along rows first.
    halfway (E, 3) : midpoint of both ends; halves (E, 2, 3) : midpoints between that and each end.
    """

    to: Float[np.ndarray, "G 3"]
    ends: Int[np.ndarray, "E 2"]
    halfway: Float[np.ndarray, "E 3"]
    halves: Float[np.ndarray, "E 2 3"]


@cache
def _grid() -> _Grid:
    along = np.arange(GRID) / MAP - 1.0
    to = unfolded(along[None, :], along[:, None]).reshape(-1, 3)
    number = np.arange(GRID * GRID).reshape(GRID, GRID)
    beside = (number[:, :-1], number[:, 1:]), (number[:-1], number[1:])
    ends = np.concatenate([np.stack([one.ravel(), other.ravel()], axis=1) for one, other in beside])
    halfway = unit(to[ends[:, 0]] + to[ends[:, 1]])
    halves = unit(halfway[:, None] + to[ends])
    return _Grid(to.astype(np.float32), ends, halfway.astype(np.float32), halves.astype(np.float32))


@cache
def texels() -> Float[np.ndarray, "texels 3"]:
    """Return the directions of the map's texel centres, float32."""
    return octahedral.texel_directions(MAP).reshape(-1, 3).astype(np.float32)


def traced(starts: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], occluders: Occluders) -> Traced:
    """Trace n sites from their `starts`, above their unit normals."""
    starts, normals = starts.astype(np.float32), normals.astype(np.float32)
    sines = normals @ texels().T
    state = np.zeros(sines.shape, dtype=np.uint8)
    site, texel = _places(sines > 0.0)
    state[site, texel] = _asked(occluders, starts.take(site, axis=0), texels().take(texel, axis=0))
    free, hidden = ((state == one).any(axis=1) for one in (_FREE, _HIDDEN))
    # Sites without a boundary are entirely free or entirely hidden.
    distances = np.where(free[:, None], np.float32(0.5 * np.pi), np.float32(-0.5 * np.pi))
    distances = np.broadcast_to(distances, state.shape).copy()
    some = np.flatnonzero(free & hidden)
    if len(some):
        distances[some] = _to_boundaries(starts[some], normals[some], sines[some], state[some], occluders)
    return Traced(distances, not hidden.any(), ~free)


def _places(wanted: Bool[np.ndarray, "n m"]) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, " r"]]:
    """Return the rows and columns of True elements, as `nonzero` but four times as fast."""
    return np.divmod(np.flatnonzero(wanted), wanted.shape[1])


def _asked(
    occluders: Occluders, starts: Float[np.ndarray, "m 3"], to: Float[np.ndarray, "m 3"]
) -> UInt8[np.ndarray, " m"]:
    """Return the states of directions, tracing a ray for each."""
    return np.where(occluders.free(starts, to), np.uint8(_FREE), np.uint8(_HIDDEN))


def _to_boundaries(
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    sines: Float[np.ndarray, "n texels"],
    state: UInt8[np.ndarray, "n texels"],
    occluders: Occluders,
) -> Float[np.ndarray, "n texels"]:
    """Compute `Traced.distances` of sites with both free and hidden directions."""
    cells = _cells(state.reshape(-1, MAP, MAP))
    fine = _refined(starts, normals, state.reshape(-1, MAP, MAP), cells, occluders)
    site, boundary = _boundaries(starts, fine, occluders)
    ends = np.searchsorted(site, np.arange(len(starts) + 1))
    free, below = state == _FREE, sines <= 0.0
    # Cosines of the nearest boundary points; without a boundary the angle is pi / 2. Below the horizon a texel t is
    # mirrored, t - 2 (t . n) n, and its cosine to b is b . t - 2 (b . n) (t . n).
    nearest = np.zeros(state.shape, dtype=np.float32)
    boundary = np.concatenate([boundary, dot(boundary, normals[site])[:, None]], axis=1)
    to = np.concatenate([texels().T, np.zeros((1, state.shape[1]), dtype=np.float32)])
    down = -2.0 * np.minimum(sines, 0.0)
    cosines = np.empty((int(np.diff(ends).max()), state.shape[1]), dtype=np.float32)
    for number in range(len(starts)):
        near, to[3] = boundary[ends[number] : ends[number + 1]], down[number]
        if len(near):
            # Maximum over rows, which are contiguous in memory.
            np.matmul(near, to, out=cosines[: len(near)]).max(axis=0, out=nearest[number])
    distances = np.arccos(np.clip(nearest, 0.0, 1.0))
    # Mirrored directions take the state of the four texel centres around them where these agree; elsewhere a ray is
    # traced, or, far below the horizon, where it hardly matters, the nearest centre is used.
    one, texel = _places(below)
    mirrored = texels().take(texel, axis=0) + down[below][:, None] * normals.take(one, axis=0)
    column, row = (((each + 1.0) * (0.5 * MAP) + 0.5).astype(np.int64) for each in places(mirrored))
    found = cells[one, row, column]
    unsure = np.flatnonzero((found == 0) | (found == _BOTH))
    deep = unsure[sines[one[unsure], texel[unsure]] <= -BELOW]
    found[deep] = state[one[deep], octahedral.texel_at(mirrored[deep], MAP)]
    unsure = np.flatnonzero((found == 0) | (found == _BOTH))
    found[unsure] = _asked(occluders, starts[one[unsure]], mirrored[unsure])
    free[one, texel] = found == _FREE
    return np.where(free, distances, -distances)


def _cells(state: UInt8[np.ndarray, "n m m"]) -> UInt8[np.ndarray, "n k k"]:
    """Combine the states at the four corners of each cell between texel centres, including cells across the folded
    rim.
    """
    padded = np.ascontiguousarray(np.moveaxis(bordered(np.moveaxis(state, 0, -1)), -1, 0))
    rows = padded[:, :-1] | padded[:, 1:]
    return rows[:, :, :-1] | rows[:, :, 1:]


def _refined(
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    state: UInt8[np.ndarray, "n m m"],
    cells: UInt8[np.ndarray, "n k k"],
    occluders: Occluders,
) -> UInt8[np.ndarray, "n g g"]:
    """Return the states on the finer grid: of texel centres, and in cells crossed by a boundary or the horizon."""
    to = _grid().to
    fine = np.zeros((len(state), GRID, GRID), dtype=np.uint8)
    fine[:, 1::2, 1::2] = state
    asked = np.zeros(fine.shape, dtype=bool)
    chosen = (cells == _BOTH) | (_beside_unasked(state) & (cells != 0))
    for turn in range(2):
        if turn:
            chosen = _entered(fine) & ~chosen
        wanted = np.zeros(fine.shape, dtype=bool)
        wanted[:, 0::2, 0::2] = chosen
        wanted[:, 1::2, 0::2] = chosen[:, :-1] | chosen[:, 1:]
        wanted[:, 0::2, 1::2] = chosen[:, :, :-1] | chosen[:, :, 1:]
        wanted &= ~asked
        asked |= wanted
        # Every point of the rim occurs twice.
        for twice in _second_halves(wanted):
            twice[:] = False
        site, point = _places(wanted.reshape(len(wanted), -1))
        up = dot(normals.take(site, axis=0), to.take(point, axis=0)) > 0.0
        site, point = site[up], point[up]
        fine.reshape(len(fine), -1)[site, point] = _asked(occluders, starts.take(site, axis=0), to.take(point, axis=0))
        for twice, first in zip(_second_halves(fine), _first_halves(fine), strict=True):
            twice[:] = first
    return fine


def _beside_unasked(state: UInt8[np.ndarray, "n m m"]) -> Bool[np.ndarray, "n k k"]:
    """Return a mask of cells with an untraced corner."""
    return _cells((state == 0).astype(np.uint8)) != 0


def _entered(fine: UInt8[np.ndarray, "n g g"]) -> Bool[np.ndarray, "n k k"]:
    """Return a mask of cells on either side of an edge between texel centres whose midpoint differs from one of its
    ends.
    """
    across = (fine[:, 1::2, 2:-1:2] | fine[:, 1::2, 1:-2:2] | fine[:, 1::2, 3::2]) == _BOTH
    along = (fine[:, 2:-1:2, 1::2] | fine[:, 1:-2:2, 1::2] | fine[:, 3::2, 1::2]) == _BOTH
    found = np.zeros((len(fine), MAP + 1, MAP + 1), dtype=bool)
    found[:, :-1, 1:-1] |= across
    found[:, 1:, 1:-1] |= across
    found[:, 1:-1, :-1] |= along
    found[:, 1:-1, 1:] |= along
    # Cells of the rim occur twice, too.
    for rim in (found[:, 0], found[:, -1], found[:, :, 0], found[:, :, -1]):
        rim |= rim[:, ::-1].copy()
    return found


def _second_halves(grid: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the second halves of the grid's four sides, which repeat the first halves."""
    return grid[:, 0, MAP + 1 :], grid[:, -1, MAP + 1 :], grid[:, MAP + 1 :, 0], grid[:, MAP + 1 :, -1]


def _first_halves(grid: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the first halves of the grid's four sides, in the order of the second."""
    return grid[:, 0, MAP - 1 :: -1], grid[:, -1, MAP - 1 :: -1], grid[:, MAP - 1 :: -1, 0], grid[:, MAP - 1 :: -1, -1]


def _boundaries(
    starts: Float[np.ndarray, "n 3"], fine: UInt8[np.ndarray, "n g g"], occluders: Occluders
) -> tuple[Int[np.ndarray, " b"], Float[np.ndarray, "b 3"]]:
    """Return the site (ascending) and the direction of every boundary point."""
    grid, count = _grid(), len(fine)
    differ = (fine[:, :, 1:] ^ fine[:, :, :-1]) == _BOTH, (fine[:, 1:] ^ fine[:, :-1]) == _BOTH
    crossed = np.concatenate([one.reshape(count, -1) for one in differ], axis=1)
    site, edge = _places(crossed)
    # The boundary runs in the second half where the middle has the state of the first end.
    halfway = _asked(occluders, starts.take(site, axis=0), grid.halfway.take(edge, axis=0))
    second = halfway == fine.reshape(count, -1)[site, grid.ends[edge, 0]]
    return site, grid.halves[edge, second.astype(np.int64)]
