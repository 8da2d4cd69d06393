"""Occlusion of light at points: its interface, and a wall, for which it has a closed form."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ...lighting.visibility.free_share import free_share


class Hiding(ABC):
    """Occlusion of light at N points.

    cpu_seconds_per_1000_vertices, bytes_per_vertex : of what `free_share` looks up; None where it is closed.
    """

    cpu_seconds_per_1000_vertices: float | None = None
    bytes_per_vertex: float | None = None

    @abstractmethod
    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """Compute the share of Gaussians about directions of the world that each point sees, by signed distance."""

    @abstractmethod
    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "#N Q"]:
        """Return whether each point sees each direction; one row where all see the same. Exact."""

    @abstractmethod
    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the share of the clamped cosine that is free."""


@dataclass(frozen=True, eq=False)
class Wall(Hiding):
    """A plane through every point that faces `towards` (3,), unit: what is behind it is hidden."""

    towards: Float[np.ndarray, "3"]

    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """Take the plane's edge for a great circle, as signed distances take every edge for."""
        return free_share(np.arcsin(np.clip(to @ self.towards, -1.0, 1.0)), sharpness)

    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "#N Q"]:
        """Return the same for all points."""
        return (directions @ self.towards > 0.0)[None]

    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Lambert's: half of 1 + the cosine between the two planes."""
        return 0.5 + 0.5 * normals @ self.towards
