"""The sites of a scene, the triangles that their rays may end on, and the rays themselves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..scene import Scene
from ..visibility.sites import Corners, Sites
from .edge_refinement import MOST, PlacedSites, placed
from .hits import RAYS, Hits, check_rays_fit, traced_hits


@dataclass(frozen=True, eq=False)
class Bodies:
    """Surfaces that the rays of a scene start from and end on.

    placed : where they do, and of which scene.
    """

    placed: PlacedSites

    @classmethod
    def of(cls, scene: Scene, longest_edge: float | None = None, most: float = MOST) -> Bodies:
        """Make the bodies of a scene, large triangles divided; and cut where light is not linear (`placed`)."""
        return cls(placed(scene, longest_edge, most))

    @property
    def sites(self) -> Sites:
        """Sites that rays start from."""
        return self.placed.sites

    @property
    def corners(self) -> Corners:
        """Corners of all triangles."""
        return self.placed.corners

    @property
    def triangles(self) -> Float[np.ndarray, "F 3 3"]:
        """Triangles that rays end on, in float32."""
        return self.placed.triangles

    def traced(
        self, rays: int = RAYS, progress: Callable[[int, int, str], None] = lambda done, total, what: None
    ) -> Hits:
        """Trace a number of rays of each site; see `scene_hits`."""
        check_rays_fit(len(self.sites), rays)
        return traced_hits(self.sites, self.corners, self.triangles, rays, progress)


def scene_hits(
    scene: Scene,
    rays: int = RAYS,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    longest_edge: float | None = None,
) -> Hits:
    """Trace the rays of all sites of a scene: its vertices, welded by place and normal (`visibility.sites`), and those
    that large triangles are cut at (`visibility.refinement`), or those on which light is not linear
    (`edge_refinement`).

    progress : called with (sites done, sites in all, what is done). longest_edge : see `refined`. `ray_cache.kept_hits`
    has them on disk.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    return Bodies.of(scene, longest_edge).traced(rays, progress)
