"""Shapes as cameras see them: points of their surfaces, what is kept of their visibility, and rays from them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from ...lighting.camera import Camera
from ...lighting.lights import DirectionalLight
from ...lighting.mesh import shapes
from ...lighting.mesh.files import load_mesh
from ...lighting.mesh.mesh import Mesh
from ...lighting.reference.geometry import Tracer
from ...lighting.scene import Part, Scene
from ...lighting.vectors import dot, facing_viewer, unit
from ...lighting.visibility.free_share import free_share
from ...lighting.visibility.precompute import computed_visibility
from ...lighting.visibility.visibility import SceneVisibility
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..papers.harmonics import matt_transfer
from .hiding import Hiding
from .surface import ShadedPoints

#: Files of meshes by the places' names, below `meshes/` of the data.
FILES = {"spot": "spot.obj", "spot on floor": "spot.obj", "shaderball": "shaderball.glb"}
#: Subdivisions of the shape that needs no file: 2562 vertices or so.
SUBDIVISIONS = 4
# Points whose normal is farther from the viewer than this cosine are left out, as at the sphere's last edge.
_LEAST_COSINE = 0.05
# Rays that are sent at once.
_RAYS = 1 << 20


@dataclass(frozen=True, eq=False)
class SceneHiding(Hiding):
    """A scene's own parts, at N points of their surfaces: looked up in `visibility`, and by rays.

    faces (N,), weights (N, 3) : where the points are. back (N,) : whether a triangle is seen from behind.
    geometric, normals (N, 3) : of triangles and of shading, both towards the viewer.
    """

    tracer: Tracer
    visibility: SceneVisibility
    faces: Int[np.ndarray, " N"]
    weights: Float[np.ndarray, "N 3"]
    back: Bool[np.ndarray, " N"]
    geometric: Float[np.ndarray, "N 3"]
    normals: Float[np.ndarray, "N 3"]
    cpu_seconds_per_1000_vertices: float  # pyright: ignore[reportIncompatibleVariableOverride]

    @property
    def bytes_per_vertex(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Bytes stored a vertex."""
        return self.visibility.bytes_a_vertex

    def free_share(
        self, to: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q"]:
        """Compute free shares by the vertices of the triangle that a point lies on."""
        vertices, weights = self.visibility.located(self.faces, self.weights)
        return free_share(self.visibility.signed_distances(vertices, weights, to, self.back), sharpness)

    def seen(self, directions: Float[np.ndarray, "Q 3"]) -> Bool[np.ndarray, "N Q"]:
        """Find by rays what points see, above the horizons of triangle and shading normal."""
        free = np.zeros((len(self.faces), len(directions)), dtype=bool)
        start = self.tracer.vertices[self.tracer.faces[self.faces]]
        start = self.tracer.lifted(np.einsum("nk,nki->ni", self.weights, start), self.geometric)
        rows = max(1, _RAYS // len(directions))
        for block in (slice(first, first + rows) for first in range(0, len(free), rows)):
            point, which = np.nonzero(
                (self.geometric[block] @ directions.T > 0.0) & (self.normals[block] @ directions.T > 0.0)
            )
            far = np.full(len(point), np.inf)
            free[block][point, which] = self.tracer.free(start[block][point], directions[which], far)
        return free

    def occlusion(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the illuminance under light of 1 from everywhere, over pi: the first of the transfer's harmonics."""
        vertices, weights = self.visibility.located(self.faces, self.weights)
        transfer = matt_transfer(self.visibility, vertices, weights, normals, self.back)
        return np.clip(transfer[:, 0] * np.sqrt(4.0 * np.pi) / np.pi, 0.0, 1.0)


#: Occlusion and points of a place, for pictures of a number of pixels across.
Place = Callable[[int], tuple[SceneHiding, ShadedPoints]]


def mesh_places(data: Path | None) -> dict[str, Place]:
    """Return the places that there are, by name; without `data` no file is one."""
    found: dict[str, Place] = {"floor": shape_on_floor}
    for name, file in FILES.items():
        if data is not None and (path := data / "meshes" / file).is_file():
            found[name] = partial(_from_file, path, name == "spot on floor")
    return found


def shape_on_floor(across: int) -> tuple[SceneHiding, ShadedPoints]:
    """Return a shape that needs no file, on a floor, seen from before it."""
    parts = (Part("shape", shapes.speed_shape(SUBDIVISIONS), "paint"), Part("floor", shapes.plane(4.0, 4.0), "paint"))
    view = Camera("view", (2.5, 2.0, 3.0), (0, 0, 0), projection="orthographic", height=4.0)
    return pixel_points(parts, (view,), across)


def _from_file(path: Path, floor: bool, across: int) -> tuple[SceneHiding, ShadedPoints]:
    """Return a mesh, on a floor or in the air, seen from both sides, from before and from behind."""
    mesh = load_mesh(path)
    parts = [Part("shape", mesh, "paint")]
    low, high = mesh.bounds
    middle, size = 0.5 * (low + high), float(np.abs(high - low).max())
    if floor:
        parts.append(Part("floor", _floor(low, middle, 1.8 * size), "paint"))
    eyes = ((0.5, 0.33, 0.8), (-0.9, 0.4, -0.2))
    picture = {"projection": "orthographic", "height": 1.3 * size}
    views = [
        Camera(f"view {n}", middle + 2.0 * size * unit(np.array(eye)), middle, **picture) for n, eye in enumerate(eyes)
    ]
    return pixel_points(parts, views, across)


def _floor(low: np.ndarray, middle: np.ndarray, side: float) -> Mesh:
    return shapes.plane(side, side).placed(translate=(middle[0], low[1], middle[2]))


def pixel_points(parts: Sequence[Part], views: Sequence[Camera], across: int) -> tuple[SceneHiding, ShadedPoints]:
    """Return the middles of the pixels in which cameras see a part, `across` pixels wide and high."""
    light = DirectionalLight((0.4, 0.8, 0.5), illuminant("D65"), 800.0)
    scene = Scene(tuple(parts), (light,), tuple(views), observer("1931_2"))
    begun = time.process_time()
    visibility = computed_visibility(scene)
    if visibility is None:
        raise RuntimeError("nothing hides anything here")
    seconds = 1000.0 * (time.process_time() - begun) / visibility.vertices
    tracer = Tracer(scene)
    rays = [replace(view, width=across, height_px=across, samples=1).rays() for view in views]
    origins, directions = (
        np.ascontiguousarray(np.concatenate([ray[k].reshape(-1, 3) for ray in rays])) for k in range(2)
    )
    faces = tracer.first(origins, directions)
    met = np.flatnonzero(faces >= 0)
    faces, to_viewer = faces[met], -directions[met]
    _, weights = tracer.on_triangle(faces, origins[met], -to_viewer)
    geometric = tracer.face_normals[faces]
    back = dot(geometric, to_viewer) < 0.0
    side = np.where(back, -1.0, 1.0)[:, None]
    normals = unit(np.einsum("nk,nki->ni", weights, tracer.normals[tracer.faces[faces]])) * side
    normals, geometric = facing_viewer(normals, to_viewer), geometric * side
    kept = np.flatnonzero((dot(normals, to_viewer) > _LEAST_COSINE) & (dot(geometric, to_viewer) > _LEAST_COSINE))
    hiding = SceneHiding(
        tracer, visibility, faces[kept], weights[kept], back[kept], geometric[kept], normals[kept], seconds
    )
    return hiding, ShadedPoints.facing(normals[kept], to_viewer[kept])
