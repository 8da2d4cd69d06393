"""Triangulation of polygons with any number of corners: concave, non-planar, with holes connected by a bridge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

# Relative error of area allowed for a triangulation: rounding is far below, self-intersecting outlines far above.
_MISSED = 1e-3


@dataclass(frozen=True)
class Triangulation:
    """Triangles (T, 3) as indices of corners, the polygon (T,) of each, and the number of self-intersecting
    outlines.
    """

    corners: Int[np.ndarray, "T 3"]
    polygon: Int[np.ndarray, " T"]
    crossing: int

    def notes(self, name: str) -> list[str]:
        """Return notes on polygons that could not be filled."""
        if not self.crossing:
            return []
        return [f"{name}: the outlines of {self.crossing} polygons cross themselves; their triangles may be other ones"]


def triangulated(points: Float[np.ndarray, "C 3"], counts: Int[np.ndarray, " P"]) -> Triangulation:
    """Triangulate polygons, preserving their winding.

    A polygon becomes a fan from its first corner if no triangle of the fan is flipped. Others are cut by ears
    (mapbox-earcut), projected along the axis nearest to their mean normal.

    Parameters
    ----------
    points : positions of all corners, polygon after polygon; corners may repeat.
    counts : number of corners of each polygon, at least 3; their sum is C.
    """
    # Non-finite corners have no area; the mesh refuses them later.
    points = np.where(np.isfinite(points), points, 0.0)
    starts = np.cumsum(counts) - counts
    found: list[np.ndarray] = []
    owners: list[np.ndarray] = []
    crossing = 0
    for count in np.unique(counts).tolist():
        which = np.flatnonzero(counts == count)
        fan = np.stack([np.zeros(count - 2, np.int64), np.arange(1, count - 1), np.arange(2, count)], axis=1)
        right = np.ones(len(which), dtype=bool)
        if count > 3:
            outline = points[starts[which][:, None] + np.arange(count)]
            spokes = outline[:, 1:] - outline[:, :1]
            areas = np.cross(spokes[:, :-1], spokes[:, 1:])
            normals = areas.sum(axis=1)
            right = (np.einsum("pti,pi->pt", areas, normals) >= 0.0).all(axis=1) & (normals != 0.0).any(axis=1)
            for number in np.flatnonzero(~right):
                cut, whole = _cut(outline[number], normals[number], fan)
                crossing += not whole
                found.append(cut + starts[which[number]])
                owners.append(np.full(len(cut), which[number]))
        found.append((starts[which[right]][:, None, None] + fan).reshape(-1, 3))
        owners.append(np.repeat(which[right], count - 2))
    corners = np.concatenate([np.empty((0, 3), np.int64), *found])
    polygon = np.concatenate([np.empty(0, np.int64), *owners])
    order = np.argsort(polygon, kind="stable")
    return Triangulation(corners[order], polygon[order], crossing)


def _cut(
    outline: Float[np.ndarray, "n 3"], normal: Float[np.ndarray, "3"], fan: Int[np.ndarray, "t 3"]
) -> tuple[Int[np.ndarray, "m 3"], bool]:
    """Triangulate one polygon by ears; return the triangles, and whether they fill it; the fan if its area is 0."""
    if not (normal != 0.0).any():
        return fan, not np.cross(outline[1:-1] - outline[0], outline[2:] - outline[0]).any()
    from mapbox_earcut import triangulate_float64

    axis = int(np.argmax(np.abs(normal)))
    # Relative to a corner, since far from the origin products of coordinates would lose precision.
    flat = np.ascontiguousarray((outline - outline[0])[:, [(axis + 1) % 3, (axis + 2) % 3]])
    cut = triangulate_float64(flat, np.array([len(flat)], dtype=np.uint32)).reshape(-1, 3).astype(np.int64)
    # Ordered along the outline, triangles have its winding.
    cut = np.sort(cut, axis=1)
    a, b = flat[cut[:, 1]] - flat[cut[:, 0]], flat[cut[:, 2]] - flat[cut[:, 0]]
    filled = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
    area = abs(normal[axis])
    return cut, bool(abs(filled - area) <= _MISSED * area)
