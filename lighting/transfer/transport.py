"""Geometry of a scene for rendering indirect light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int

from ..scene import Scene
from ..visibility.edge_bisection import Halving
from .cells import HemisphereCells
from .edge_refinement import placed
from .hits import RAYS, Hits
from .precomputation import Precomputation
from .ray_cache import kept_hits

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Transport:
    """Precomputed light transport of a scene, valid for any materials and lights.

    prepared : the subdivided scene and its rays. refinement, fronts (V,), backs (V,) : sites, as in `SceneVisibility`.
    """

    prepared: Precomputation
    refinement: Halving
    fronts: Int[np.ndarray, " V"]
    backs: Int[np.ndarray, " V"]

    @classmethod
    def of(
        cls,
        scene: Scene,
        rays: int = RAYS,
        longest_edge: float | None = None,
        progress: Progress = lambda done, total, what: None,
        folder: Path | str | None = None,
        jobs: int = 1,
        say: Callable[[str], object] = lambda words: None,
    ) -> Transport:
        """Read the rays of a scene from `folder`, or trace and store them there: see `kept_hits`.

        longest_edge : see `refined`.

        Raises
        ------
        InputError : it would not fit into memory; the folder cannot be used.
        """
        bodies = placed(scene, longest_edge)
        hits = kept_hits(scene, folder, rays, jobs, progress, longest_edge, say, bodies)
        where, order = hits.sites, bodies.order
        prepared = Precomputation(bodies.scene, hits, HemisphereCells())
        return cls(prepared, bodies.refinement, where.fronts[order], where.backs[order])

    @property
    def hits(self) -> Hits:
        """Hit points of the rays."""
        return self.prepared.hits

    @property
    def fine(self) -> Scene:
        """The subdivided scene."""
        return self.prepared.scene
