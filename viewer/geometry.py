"""A scene as both renderers take it: triangles about the origin, turned towards the viewer, with what each light meets.

Everything that is decided once a triangle is decided here, in float64, so that the two renderers cannot differ on it:
which side is seen, which lights stand above its horizon, what lies between it and each light. Lengths are in radii of
the scene. The policy is that of `lighting.geometry`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ..lighting.camera import Camera
from ..lighting.lights import DirectionalLight, Light
from ..lighting.scene import Scene
from ..lighting.vectors import dot
from ..spectral.errors import InputError
from .raster import Window, WindowTriangles, window_triangles
from .shadows import ShadowGrid, SortedTriangles, shadow_grid, sorted_triangles

# Which lights stand above a triangle's horizon is a bit each of a float32 that stays exact.
MOST_LIGHTS = 24
# Samples along a side of what is rendered at once: bounds memory, and keeps positions on the vertex grid exact.
TILE_SAMPLES = 2048


@dataclass(frozen=True, eq=False)
class LightGeometry:
    """A light without its spectrum.

    vector (3,) : unit direction to it (directional) or where it stands (point), in radii about the scene's centre.
    irradiance : pi E / E_ref on a surface that faces it; of a point light at one radius' distance.
    """

    directional: bool
    vector: Float[np.ndarray, "3"]
    irradiance: float
    shadows: ShadowGrid


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """What a camera and the lights see of a scene; good for all materials and all spectra.

    Attributes
    ----------
    positions, normals, tangents : (F, 3, 3) by triangle and corner, rounded to float32; normals on the viewer's side.
    first_face : (parts + 1,) where each part's triangles begin.
    lit : (F,) bit n is set where light n stands above the triangle's horizon, on the viewer's side.
    perspective, eye : the pin-hole, or the unit direction to the viewer of an orthographic camera.
    """

    camera: Camera
    positions: Float[np.ndarray, "F 3 3"]
    normals: Float[np.ndarray, "F 3 3"]
    tangents: Float[np.ndarray, "F 3 3"]
    first_face: Int[np.ndarray, "_"]
    lit: Int[np.ndarray, " F"]
    perspective: bool
    eye: Float[np.ndarray, "3"]
    occluders: SortedTriangles
    lights: tuple[LightGeometry, ...]
    clip: Float[np.ndarray, "F 3 3"]
    depth: Float[np.ndarray, "F 3"]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in samples."""
        return self.camera.width * self.camera.samples, self.camera.height_px * self.camera.samples

    def windows(self) -> Iterator[tuple[Window, WindowTriangles]]:
        """The picture in tiles of whole pixels, and the triangles in each."""
        width, height = self.size
        step = _tile_side(self.camera)
        for top in range(0, height, step):
            for left in range(0, width, step):
                window = Window(left, top, min(step, width - left), min(step, height - top))
                yield window, window_triangles(self.clip, self.depth, self.perspective, (width, height), window)


def window_count(camera: Camera) -> int:
    """How many windows a camera's picture is drawn in."""
    step = _tile_side(camera)
    return -(-camera.width * camera.samples // step) * -(-camera.height_px * camera.samples // step)


def _tile_side(camera: Camera) -> int:
    """Samples along a side of a tile of whole pixels."""
    return max(1, TILE_SAMPLES // camera.samples) * camera.samples


def scene_geometry(scene: Scene, camera: Camera) -> SceneGeometry:
    """Prepare a scene for rasterising.

    Raises
    ------
    InputError : more than 24 lights.
    """
    if len(scene.lights) > MOST_LIGHTS:
        raise InputError("too many lights", field="lights", found=len(scene.lights), expected=f"at most {MOST_LIGHTS}")
    low, high = scene.bounds
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    meshes = [part.mesh for part in scene.parts]
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    face_normals = np.concatenate([mesh.face_normals for mesh in meshes])
    normals = np.concatenate([mesh.normals[mesh.faces] for mesh in meshes])
    tangents = np.concatenate([mesh.tangents[mesh.faces] for mesh in meshes])

    perspective = camera.projection == "perspective"
    to_viewer = camera.position - corners[:, 0] if perspective else np.broadcast_to(camera.axes[2], corners[:, 0].shape)
    side = np.where(dot(face_normals, to_viewer) < 0.0, -1.0, 1.0)
    lit = np.zeros(len(corners), dtype=np.int64)
    occluders = sorted_triangles((corners - centre) / radius)
    lights = []
    for number, light in enumerate(scene.lights):
        above = side * _above_horizon(light, corners[:, 0], face_normals)
        lit |= (above > 0.0).astype(np.int64) << number
        directional = isinstance(light, DirectionalLight)
        vector = light.direction_to_light if directional else (light.position - centre) / radius
        strength = light.illuminance_lux if directional else light.intensity_cd / radius**2
        irradiance = np.pi * strength / scene.viewing.reference_illuminance_lux
        lights.append(LightGeometry(directional, vector, irradiance, shadow_grid(occluders, directional, vector)))

    clip = corners @ camera.clip_from_world()[[0, 1, 3], :3].T + camera.clip_from_world()[[0, 1, 3], 3]
    view = camera.view_from_world()
    return SceneGeometry(
        camera=camera,
        positions=_float32((corners - centre) / radius),
        normals=_float32(normals * side[:, None, None]),
        tangents=_float32(tangents),
        first_face=np.cumsum([0, *(len(mesh.faces) for mesh in meshes)]),
        lit=lit,
        perspective=perspective,
        eye=(camera.position - centre) / radius if perspective else camera.axes[2],
        occluders=occluders,
        lights=tuple(lights),
        clip=clip,
        depth=-(corners @ view[2, :3] + view[2, 3]),
    )


def geometry_key(scene: Scene, camera: Camera) -> tuple:
    """Equal for two calls whose geometry is the same; holds for as long as the scene's meshes are kept alive."""
    size = (camera.width, camera.height_px, camera.samples)
    view = (camera.projection, camera.clip_from_world().tobytes(), camera.position.tobytes(), size)
    lights = tuple(
        (light.direction_to_light.tobytes(), light.illuminance_lux)
        if isinstance(light, DirectionalLight)
        else (light.position.tobytes(), light.intensity_cd, "cd")
        for light in scene.lights
    )
    meshes = tuple(id(part.mesh) for part in scene.parts)
    return meshes, view, lights, scene.viewing.reference_illuminance_lux


def _above_horizon(light: Light, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Positive where the light is on the side of the triangle that its normal points to."""
    return dot(normals, light.incident(points)[0])


def _float32(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)
