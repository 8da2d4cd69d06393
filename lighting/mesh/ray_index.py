"""BVH of triangles for ray queries: Embree, or numpy where Embree has no package for this system.

The numpy version supports the same queries, some hundred times slower. It computes in float64; like Embree it takes
coordinates in float32.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..vectors import dot

# Triangles of a leaf; rays traced together.
_LEAF, _RAYS = 16, 1 << 18
# Tolerance of barycentric coordinates, so that no ray passes between two triangles that share an edge.
_EDGE = 1e-9
# Least size of components of directions, for division in box tests.
_TINY = 1e-300


def has_embree() -> bool:
    """Return whether Embree is installed."""
    try:
        import embreex.rtcore_scene  # noqa: F401
    except ImportError:
        return False
    return True


def rays_words() -> str:
    """Name the ray tracer in use.

    >>> rays_words() in ("Embree rays", "rays in numpy")
    True
    """
    return "Embree rays" if has_embree() else "rays in numpy"


def ray_index(vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"] | None = None) -> Any:
    """Build a BVH of triangles, `vertices[faces]` or without `faces` triangles (F, 3, 3), with embreex's `run`."""
    if not has_embree():
        corners = np.asarray(vertices, dtype=np.float32)
        return NumpyIndex(corners if faces is None else corners[faces])
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    given = np.ascontiguousarray(vertices, dtype=np.float32)
    TriangleMesh(scene, given, *(() if faces is None else (np.ascontiguousarray(faces, dtype=np.int32),)))
    return scene


class NumpyIndex:
    """Bounding volume hierarchy of triangles (F, 3, 3), split in halves."""

    def __init__(self, triangles: Float[np.ndarray, "F 3 3"]) -> None:
        corners = np.asarray(triangles, dtype=np.float64)
        self._first = corners[:, 0]
        self._edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._normals = np.cross(*self._edges)
        low, high = corners.min(axis=1), corners.max(axis=1)
        centres = 0.5 * (low + high)
        # Bounds of each node, and its two children or its triangles.
        self._boxes: list[tuple[np.ndarray, np.ndarray]] = []
        self._parts: list[tuple[int, int] | np.ndarray] = []
        waiting: list[tuple[np.ndarray, int | None]] = [(np.arange(len(corners)), None)]
        while waiting:
            inside, parent = waiting.pop()
            number = len(self._boxes)
            self._boxes.append((low[inside].min(axis=0, initial=np.inf), high[inside].max(axis=0, initial=-np.inf)))
            self._parts.append(inside)
            if parent is not None:
                before = self._parts[parent]
                self._parts[parent] = (before[0], number) if isinstance(before, tuple) else (number, -1)
            if len(inside) > _LEAF:
                axis = int(np.argmax(np.ptp(centres[inside], axis=0)))
                order = inside[np.argsort(centres[inside, axis], kind="stable")]
                half = len(order) // 2
                waiting += [(order[half:], number), (order[:half], number)]

    def run(
        self,
        origins: Float[np.ndarray, "n 3"],
        directions: Float[np.ndarray, "n 3"],
        dists: Float[np.ndarray, " n"] | None = None,
        query: str = "INTERSECT",
        output: bool = False,
    ) -> Any:
        """Trace rays, with the interface of embreex.

        dists : largest distances, in lengths of the directions; infinite by default.
        query : "INTERSECT" for the closest triangle, "OCCLUDED" for any.

        Returns
        -------
        Triangles that are hit, -1 for none; with `output` a dict of these as `primID`, their distances as `tfar`, and
        `u` and `v`, barycentric coordinates of the second and third corner.
        """
        count = len(origins)
        found = {"primID": np.full(count, -1, dtype=np.int64), "tfar": np.full(count, np.inf)}
        found |= {"u": np.zeros(count), "v": np.zeros(count)}
        if dists is not None:
            found["tfar"][:] = dists
        for begin in range(0, count, _RAYS):
            rays = slice(begin, begin + _RAYS)
            parts = {name: values[rays] for name, values in found.items()}
            start, to = np.asarray(origins[rays], dtype=np.float64), np.asarray(directions[rays], dtype=np.float64)
            self._follow(start, to, parts, query == "OCCLUDED")
        return found if output else found["primID"]

    def _follow(self, origins: np.ndarray, directions: np.ndarray, found: dict[str, np.ndarray], any_: bool) -> None:
        inverse = 1.0 / np.where(np.abs(directions) < _TINY, _TINY, directions)
        waiting = [(0, np.arange(len(origins)))]
        while waiting:
            number, rays = waiting.pop()
            if any_:
                rays = rays[found["primID"][rays] < 0]
            low, high = self._boxes[number]
            start, over = origins[rays], inverse[rays]
            one, other = (low - start) * over, (high - start) * over
            enters, leaves = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
            # Slightly enlarged, so that rounding cannot miss a triangle at the boundary.
            leaves += 1e-9 * np.abs(leaves)
            rays = rays[(enters <= leaves) & (leaves >= 0.0) & (enters <= found["tfar"][rays])]
            if not len(rays):
                continue
            parts = self._parts[number]
            if isinstance(parts, tuple):
                # The child that is nearer for most rays comes first, so that the other is often culled.
                ahead = directions[rays].sum(axis=0) @ (self._boxes[parts[1]][0] - self._boxes[parts[0]][0])
                waiting += [(part, rays) for part in (parts[::-1] if ahead > 0.0 else parts)]
            elif len(parts):
                self._meet(parts, rays, origins, directions, found)

    def _meet(
        self, triangles: np.ndarray, rays: np.ndarray, origins: np.ndarray, directions: np.ndarray, found: dict
    ) -> None:
        """Intersect rays with a few triangles and record hits closer than those found before (Moeller and Trumbore
        1997).
        """
        ab, ac, normal = (each[triangles, None] for each in (*self._edges, self._normals))
        to, from_a = directions[rays], origins[rays] - self._first[triangles, None]
        across = np.cross(from_a, to)
        with np.errstate(divide="ignore", invalid="ignore"):
            over = -1.0 / dot(to, normal)
            u, v, far = dot(ac, across) * over, -dot(ab, across) * over, dot(from_a, normal) * over
            meets = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1.0 + _EDGE) & (far > 0.0) & (far < found["tfar"][rays])
        nearest = np.where(meets, far, np.inf).argmin(axis=0), np.arange(len(rays))
        met = meets[nearest]
        which = nearest[0][met], nearest[1][met]
        rays = rays[met]
        found["primID"][rays] = triangles[which[0]]
        for name, values in (("tfar", far), ("u", u), ("v", v)):
            found[name][rays] = values[which]
