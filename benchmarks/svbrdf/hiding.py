"""What hides light from points: a wall, for which every question has a closed answer, or a shape on a floor."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ...lighting import shapes
from ...lighting.camera import Camera
from ...lighting.lights import DirectionalLight
from ...lighting.scene import Part, Scene
from ...lighting.visibility import measure
from ...lighting.visibility.free_share import free_share
from ...lighting.visibility.precompute import computed_visibility
from ...lighting.visibility.visibility import SceneVisibility
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .surface import ShadedPoints

# Of the shape: 2562 vertices or so.
_SUBDIVISIONS = 4


class Hiding(ABC):
    """What hides light from N points.

    cpu_seconds_per_1000_vertices, bytes_per_vertex : of what `free_share` looks up; None where it is closed.
    """

    cpu_seconds_per_1000_vertices: float | None = None
    bytes_per_vertex: float | None = None

    @abstractmethod
    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """What of Gaussians about directions of the world each point sees, by signed distance."""

    @abstractmethod
    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "#N Q"]:
        """Whether each point sees each direction; one row where all see the same. Exact."""

    @abstractmethod
    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """The share of the clamped cosine that is free."""


@dataclass(frozen=True, eq=False)
class Wall(Hiding):
    """A plane through every point that faces `towards` (3,), unit: what is behind it is hidden."""

    towards: Float[np.ndarray, "3"]

    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """The plane's edge is a great circle, as signed distances take every edge for."""
        return free_share(np.arcsin(np.clip(to @ self.towards, -1.0, 1.0)), sharpness)

    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "#N Q"]:
        """The same for all points."""
        return (directions @ self.towards > 0.0)[None]

    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Lambert's: half of 1 + the cosine between the two planes."""
        return 0.5 + 0.5 * normals @ self.towards


@dataclass(frozen=True, eq=False)
class SceneHiding(Hiding):
    """A scene's own parts, at points of their surfaces: looked up in `visibility`, and by rays."""

    scene: Scene
    visibility: SceneVisibility
    drawn: measure.Truth
    kept: np.ndarray
    cpu_seconds_per_1000_vertices: float  # pyright: ignore[reportIncompatibleVariableOverride]

    @property
    def bytes_per_vertex(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """What is stored."""
        return self.visibility.bytes_a_vertex

    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """By the vertices of the triangle that a point lies on."""
        vertices, weights = self.visibility.located(self.drawn.faces[self.kept], self.drawn.weights[self.kept])
        return self.visibility.free_shares(vertices, weights, to, sharpness)

    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "#N Q"]:
        """By rays."""
        return measure.truth(self.scene, len(self.drawn.faces), directions).free[self.kept]

    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """The illuminance under light of 1 from everywhere, over pi: the first of the transfer's harmonics."""
        vertices, weights = self.visibility.located(self.drawn.faces[self.kept], self.drawn.weights[self.kept])
        transfer = self.visibility.transfer(vertices, weights, normals)
        return np.clip(transfer[:, 0] * np.sqrt(4.0 * np.pi) / np.pi, 0.0, 1.0)


def shape_on_floor(points: int) -> tuple[SceneHiding, ShadedPoints]:
    """A shape on a floor, as many of `points` drawn at random on them as a camera before it would see the front of."""
    floor = shapes.plane(4.0, 4.0)
    body = shapes.speed_shape(_SUBDIVISIONS)
    parts = (Part("shape", body, "paint"), Part("floor", floor, "paint"))
    camera = Camera("view", (2.5, 2.0, 3.0), (0, 0, 0))
    light = DirectionalLight((0.4, 0.8, 0.5), illuminant("D65"), 800.0)
    scene = Scene(parts, (light,), (camera,), observer("1931_2"))
    begun = time.process_time()
    visibility = computed_visibility(scene)
    if visibility is None:
        raise RuntimeError("a floor under a shape hides light from it")
    seconds = 1000.0 * (time.process_time() - begun) / len(visibility.fronts)
    drawn = measure.truth(scene, points, 1)
    viewer = np.array([2.5, 2.0, 3.0]) / np.linalg.norm([2.5, 2.0, 3.0])
    kept = np.flatnonzero(drawn.normals @ viewer > 0.1)
    return SceneHiding(scene, visibility, drawn, kept, seconds), ShadedPoints.facing(drawn.normals[kept], viewer)
