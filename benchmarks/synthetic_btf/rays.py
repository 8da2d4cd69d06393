"""Rays over a surface that goes on for ever.

Embree gets the tile and half a tile around it. A ray that leaves this before it is above all heights goes on from
where it would be in the tile.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from ...lighting.mesh.ray_index import ray_index
from ...runtime.errors import InputError
from .relief import Relief

#: Least sine of a direction's height above the plane: nearer to the horizon there is no image, and rays have no end.
LEAST_HEIGHT = 0.02
# Texels that rays start off a facet: coordinates are float32, of some hundreds at the most.
_OFFSET = 1e-3
# Most steps of a ray, each of half a tile at least. A ray along the plane would go on for ever; after these it has met
# whatever it can meet.
_MOST_TILES = 4096
# Rays given to Embree at once: bounds memory.
_CHUNK = 1 << 20


class PeriodicRays:
    """Index for rays of a relief and what is around it."""

    def __init__(self, relief: Relief) -> None:
        rows, columns = relief.heights.shape
        cells = relief.cells
        # A tile as narrow as its relief is high would be crossed many times: more of it is laid out then.
        steep = int(np.ceil(2.0 * np.ptp(relief.heights) * cells))
        margin = (min(max(rows, steep) // 2 + 1, 2 * rows + 64), min(max(columns, steep) // 2 + 1, 2 * columns + 64))
        row = np.arange(-margin[0], rows + margin[0] + 1)
        column = np.arange(-margin[1], columns + margin[1] + 1)
        y, x = np.meshgrid(-row / cells, column / cells, indexing="ij")
        z = relief.heights[np.ix_(row % rows, column % columns)]
        vertices = np.stack([x, y, z], axis=2).reshape(-1, 3).astype(np.float32)
        first = (np.arange(len(row) - 1)[:, None] * len(column) + np.arange(len(column) - 1)).ravel()
        below = first + len(column)
        upper, lower = np.stack([first, below, first + 1], 1), np.stack([first + 1, below, below + 1], 1)
        faces = np.stack([upper, lower], axis=1).reshape(-1, 3).astype(np.int32)
        self._scene = ray_index(vertices, faces)
        cell = ((row[:-1] % rows)[:, None] * columns + column[:-1] % columns).ravel()
        self._facet = np.stack([2 * cell, 2 * cell + 1], axis=1).ravel()
        self._tile = np.array([columns / cells, rows / cells])
        self._low = np.array([column[0], -row[-1]]) / cells
        self._high = np.array([column[-1], -row[0]]) / cells
        self._heights = float(relief.heights.min()), float(relief.heights.max())

    def first(self, starts: Float[np.ndarray, "n 3"], to: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the first facet of the tile that each ray along a unit vector meets; -1 where it meets none."""
        found = self._cast(starts, to, "INTERSECT")
        return np.where(found < 0, -1, self._facet[found])

    def free(self, starts: Float[np.ndarray, "n 3"], to: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Return whether rays along unit vectors meet nothing."""
        return self._cast(starts, to, "OCCLUDED") < 0

    def _cast(self, starts: np.ndarray, to: np.ndarray, query: str) -> Int[np.ndarray, " n"]:
        found = np.full(len(starts), -1, dtype=np.int64)
        for begin in range(0, len(starts), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            found[part] = self._cast_part(starts[part], to[part], query)
        return found

    def _cast_part(self, starts: np.ndarray, to: np.ndarray, query: str) -> Int[np.ndarray, " n"]:
        found = np.full(len(starts), -1, dtype=np.int64)
        going = np.arange(len(starts))
        at, to = starts.astype(np.float64), to.astype(np.float64)
        for _ in range(_MOST_TILES):
            tiles = np.floor(at[:, :2] / self._tile + np.array([0.0, 1.0])) * self._tile
            at[:, :2] -= tiles
            hit = self._scene.run(at.astype(np.float32), to.astype(np.float32), query=query)
            found[going] = hit
            edge = np.where(to[:, :2] > 0.0, self._high, self._low) - at[:, :2]
            far = np.divide(edge, to[:, :2], out=np.full_like(edge, np.inf), where=to[:, :2] != 0.0).min(axis=1)
            far_height = at[:, 2] + np.where(np.isfinite(far), far, 0.0) * to[:, 2]
            least, most = self._heights
            above_all, below_all = (to[:, 2] >= 0.0) & (far_height > most), (to[:, 2] <= 0.0) & (far_height < least)
            on = (hit < 0) & np.isfinite(far) & ~above_all & ~below_all
            if not on.any():
                break
            at, to, going = at[on] + far[on, None] * to[on], to[on], going[on]
        return found


def off_surface(points: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Offset `points` to where rays that leave facets start."""
    return points + _OFFSET * normals


def check_above_horizon(directions: Float[np.ndarray, "D 3"], field: str) -> None:
    """Refuse directions with z below `LEAST_HEIGHT`."""
    low = np.flatnonzero(directions[:, 2] < LEAST_HEIGHT)
    if len(low):
        raise InputError(
            "a direction too near to the horizon to be traced",
            field=field,
            found=f"direction {low[0]}: z = {directions[low[0], 2]:.4g}",
            expected=f"z >= {LEAST_HEIGHT:g}",
        )
