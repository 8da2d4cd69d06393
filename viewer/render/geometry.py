"""Camera-independent geometry of a scene for both renderers: triangles about its centre, and the lights' relation to
them.

Data of a light are cached while only other lights move; a camera's view is `view.View`. Decisions per triangle are made
in float64, so that both renderers agree. Lengths are in radii of the scene. Conventions are those of
`lighting.reference.geometry`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...lighting.lights import DeltaLight
from ...lighting.mesh.mesh import Mesh
from ...lighting.reference.geometry import Tracer
from ...lighting.scene import Scene
from ...lighting.vectors import dot
from ...materials.core.surface import Cutout
from .shadows import ShadowGrid, SortedTriangles, shadow_grid, sorted_triangles


@dataclass(frozen=True, eq=False)
class LightGeometry:
    """Geometry of a light, without its spectrum.

    vector (4,) : homogeneous, in radii about the scene's centre (`Light.homogeneous`).
    irradiance : pi E / E_ref on a surface facing it at unit length of vector[:3] - vector[3] position.
    above (F,) : positive if the light is above the triangle's horizon, on the side of the triangle's normal.
    """

    vector: Float[np.ndarray, "4"]
    irradiance: float
    above: Float[np.ndarray, " F"]
    shadows: ShadowGrid

    def towards(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Compute vectors from points to the light; irradiance falls with their squared length."""
        return self.vector[:3] - self.vector[3] * points


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """Triangles by their corners, and lights, valid for all cameras, materials and spectra.

    centre (3,), radius : world, of the scene; origin and unit of all coordinates below but `points`.
    points (V, 3) : vertices, world. faces (F, 3) : vertex indices of corners.
    face_normals (F, 3) : unit. positions, normals, tangents (F, 3, 3) : rounded to float32.
    handedness (F,) : 1 or -1, of the tangents (`lighting.mesh.tangents`).
    first_face (parts + 1,) : first triangle of each part.
    cutouts : holes of each part's material. tracer : ray tracer through holes; None without holes.
    """

    meshes: tuple[Mesh, ...]
    centre: Float[np.ndarray, "3"]
    radius: float
    points: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    face_normals: Float[np.ndarray, "F 3"]
    positions: Float[np.ndarray, "F 3 3"]
    normals: Float[np.ndarray, "F 3 3"]
    tangents: Float[np.ndarray, "F 3 3"]
    handedness: Float[np.ndarray, " F"]
    first_face: Int[np.ndarray, "_"]
    occluders: SortedTriangles
    lights: tuple[LightGeometry, ...] = ()
    cutouts: tuple[Cutout | None, ...] = ()
    tracer: Tracer | None = None

    @property
    def has_uv(self) -> tuple[bool, ...]:
        """True for each part with texture coordinates."""
        return tuple(mesh.uv is not None for mesh in self.meshes)

    @cached_property
    def first_corners(self) -> Float[np.ndarray, "F 3"]:
        """First corner of each triangle, world, needed when the camera moves."""
        return self.points.take(self.faces[:, 0], axis=0)

    @cached_property
    def corner_texels(self) -> Float[np.ndarray, "F 9 4"]:
        """Positions, normals and tangents for GPUs, float32 padded by 0 to four numbers."""
        texels = np.zeros((len(self.faces), 9, 4), dtype=np.float32)
        for start, corners in ((0, self.positions), (3, self.normals), (6, self.tangents)):
            texels[:, start : start + 3, :3] = corners
        return texels

    @cached_property
    def uv(self) -> Float[np.ndarray, "F 3 2"] | None:
        """Texture coordinates rounded to float32, 0 on parts without; None if no part has any."""
        if not any(self.has_uv):
            return None
        parts = [np.zeros((len(m.faces), 3, 2)) if m.uv is None else m.uv[m.faces] for m in self.meshes]
        return _float32(np.concatenate(parts))


def knows_geometry(scene: Scene, known: SceneGeometry | None) -> bool:
    """Return whether `scene_geometry` would return `known`."""
    if known is None or not _same_meshes(scene, known) or len(scene.delta_lights) != len(known.lights):
        return False
    pairs = zip(scene.delta_lights, known.lights, strict=True)
    return all(_is_of(one, *_place(scene, light, known)) for light, one in pairs)


def scene_geometry(scene: Scene, known: SceneGeometry | None = None) -> SceneGeometry:
    """Prepare a scene for any camera; data of the same meshes and lights are taken from `known`, which is returned
    itself if nothing has changed.
    """
    same = known is not None and _same_meshes(scene, known)
    bare = known if known is not None and same else _triangles(scene)
    lights = tuple(_light(scene, light, bare) for light in scene.delta_lights)
    if same and [id(light) for light in lights] == [id(light) for light in bare.lights]:
        return bare
    return replace(bare, lights=lights)


def same_geometry(scene: Scene, other: Scene) -> bool:
    """Return whether two scenes differ at most in materials without holes, spectra and observers."""
    low, high = scene.bounds
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    lux = scene.viewing.reference_illuminance_lux, other.viewing.reference_illuminance_lux

    def places(one: Scene) -> list[tuple]:
        found = (light.homogeneous(centre, radius) for light in one.delta_lights)
        return [(tuple(vector), strength) for vector, strength in found]

    return (
        lux[0] == lux[1]
        and len(scene.parts) == len(other.parts)
        and all(a.mesh is b.mesh and a.cutout is b.cutout for a, b in zip(scene.parts, other.parts, strict=True))
        and places(scene) == places(other)
    )


def _same_meshes(scene: Scene, known: SceneGeometry) -> bool:
    """Compare meshes by identity, which is valid while `known` keeps them alive."""
    return len(scene.parts) == len(known.meshes) and all(
        part.mesh is mesh and part.cutout is cutout
        for part, mesh, cutout in zip(scene.parts, known.meshes, known.cutouts, strict=True)
    )


def _triangles(scene: Scene) -> SceneGeometry:
    low, high = scene.bounds
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    meshes = tuple(part.mesh for part in scene.parts)
    points = np.concatenate([mesh.vertices for mesh in meshes])
    first_vertex = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + first for mesh, first in zip(meshes, first_vertex, strict=False)])
    scaled = ((points - centre) / radius)[faces]
    return SceneGeometry(
        meshes=meshes,
        centre=centre,
        radius=radius,
        points=points,
        faces=faces,
        face_normals=np.concatenate([mesh.face_normals for mesh in meshes]),
        positions=_float32(scaled),
        normals=_float32(np.concatenate([mesh.normals[mesh.faces] for mesh in meshes])),
        tangents=_float32(np.concatenate([mesh.tangents.directions[mesh.tangents.faces] for mesh in meshes])),
        handedness=np.concatenate([mesh.tangents.handedness for mesh in meshes]),
        first_face=np.cumsum([0, *(len(mesh.faces) for mesh in meshes)]),
        occluders=sorted_triangles(scaled),
        cutouts=scene.cutouts,
        tracer=Tracer(scene) if any(scene.cutouts) else None,
    )


def _light(scene: Scene, light: DeltaLight, bare: SceneGeometry) -> LightGeometry:
    vector, irradiance = _place(scene, light, bare)
    for one in bare.lights:
        if _is_of(one, vector, irradiance):
            return one
    above = dot(bare.face_normals, light.arrivals(bare.first_corners).directions)
    return LightGeometry(vector, irradiance, above, shadow_grid(bare.occluders, vector))


def _place(scene: Scene, light: DeltaLight, bare: SceneGeometry) -> tuple[Float[np.ndarray, "4"], float]:
    vector, lux = light.homogeneous(bare.centre, bare.radius)
    return vector, np.pi * lux / scene.viewing.reference_illuminance_lux


def _is_of(one: LightGeometry, vector: Float[np.ndarray, "4"], irradiance: float) -> bool:
    return np.array_equal(one.vector, vector) and one.irradiance == irradiance


def _float32(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)
