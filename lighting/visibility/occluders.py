"""Occlusion queries against all triangles of a scene."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from ..mesh.ray_index import ray_index
from ..reference.geometry import SHADOW_OFFSET

#: Offset of ray origins from a surface, in radii of the scene, as for shadow rays.
OFFSET = SHADOW_OFFSET


class Occluders:
    """BVH of triangles (F, 3, 3), in coordinates in which the scene has radius 1 about the origin.

    Embree works in float32; scaled so, its coordinates are fine enough for rays that start `OFFSET` off a surface.
    """

    def __init__(self, triangles: Float[np.ndarray, "F 3 3"]) -> None:
        self._scene = ray_index(triangles)

    def free(
        self,
        starts: Float[np.ndarray, "n 3"],
        to: Float[np.ndarray, "n 3"],
        lengths: Float[np.ndarray, " n"] | None = None,
    ) -> Bool[np.ndarray, " n"]:
        """Return whether rays along unit vectors are unoccluded, up to `lengths` or to infinity."""
        if not len(starts):
            return np.ones(0, dtype=bool)
        given = (np.ascontiguousarray(each, dtype=np.float32) for each in (starts, to))
        ends = None if lengths is None else np.ascontiguousarray(lengths, dtype=np.float32)
        return self._scene.run(*given, dists=ends, query="OCCLUDED") < 0

    def met(
        self, starts: Float[np.ndarray, "n 3"], to: Float[np.ndarray, "n 3"]
    ) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Return the first triangle hit by each ray along a unit vector, -1 for none, and its distance."""
        given = (np.ascontiguousarray(each, dtype=np.float32) for each in (starts, to))
        found = self._scene.run(*given, query="INTERSECT", output=True)
        return found["primID"].astype(np.int64), found["tfar"].astype(np.float64)
