"""First image of a view: coarse ray tracing, shown while shadows of area and environment lights are computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...lighting.reference.geometry import visible_geometry
from ...lighting.reference.noise import NOISE_SHARE
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Scene
from ...lighting.vectors import dot
from ...lighting.visibility.precompute import SeenPoints
from ..gl.side import CanvasSide
from ..render.light_cache import LightCache
from .view_error import Tracers
from .viewpoint import Viewpoint

#: Largest number of pixels of a first image, and samples along a side of each.
MOST_PIXELS, SAMPLES = 120 * 90, 2
#: Target noise, mean ΔE94 over pixels.
AIMED_NOISE = 0.8
# Rays per block: some 20 MB.
_RAYS = 1 << 17
#: Largest number of bounces.
MOST_BOUNCES = 3


@dataclass(frozen=True, eq=False)
class FirstPicture:
    """First image of a side: XYZ (h, w, 3) and coverage (h, w), float32; `noise` is the mean noise, ΔE94."""

    xyz: Float[np.ndarray, "h w 3"]
    coverage: Float[np.ndarray, "h w"]
    noise: float


def first_size(width: int, height: int) -> tuple[int, int]:
    """Return the size in pixels of the first image of a view.

    >>> first_size(1200, 900), first_size(40, 30)
    ((120, 90), (40, 30))
    """
    share = min(1.0, float(np.sqrt(MOST_PIXELS / (width * height))))
    return max(1, round(share * width)), max(1, round(share * height))


def seen_points(scene: Scene, view: Viewpoint, size: tuple[int, int], tracers: Tracers) -> SeenPoints:
    """Return the points of a scene visible at pixel centres."""
    tracer, camera = tracers.of(scene), view.camera(*size)
    found = []
    rows = max(1, _RAYS // camera.width)
    for start in range(0, camera.height_px, rows):
        origins, directions = camera.rays(slice(start, min(start + rows, camera.height_px)))
        origins, directions = origins.reshape(-1, 3), np.ascontiguousarray(directions.reshape(-1, 3))
        faces = tracer.first(origins, directions)
        met = np.flatnonzero(faces >= 0)
        faces, directions = faces[met], directions[met]
        weights = tracer.on_triangle(faces, origins[met], directions)[1]
        found.append((faces, weights, dot(tracer.face_normals[faces], directions) > 0.0))
    return SeenPoints(*(np.concatenate(one) for one in zip(*found, strict=True)))


def first_pictures(
    sides: Sequence[CanvasSide], view: Viewpoint, size: tuple[int, int], tracers: Tracers, lights: LightCache
) -> list[FirstPicture]:
    """Ray trace sides with their fast forms and shown light.

    Indirect light has at most `MOST_BOUNCES` bounces.

    Parameters
    ----------
    size : of the canvas in pixels; the images have its `first_size`. tracers : cache of ray tracers.
    lights : light cache, which knows whether shadows take long.

    Returns
    -------
    One image per side; empty if all shadows are computed soon.

    Raises
    ------
    InputError : see `reference_images`.
    """
    if all(lights.soon_has(light, side.scene) for side in sides for light in side.scene.spread_lights):
        return []
    camera = view.camera(*first_size(*size), SAMPLES)
    found = []
    for number, side in enumerate(sides):
        scene = side.lit.cut(side.surfaces)
        bounces = MOST_BOUNCES if scene.bounces == "auto" else min(int(scene.bounces), MOST_BOUNCES)
        tracer = tracers.of(scene)
        seen = visible_geometry(scene, camera, tracer=tracer, with_uv=scene.needs_uv(side.surfaces), with_frames=True)
        picture = reference_images(
            scene,
            camera,
            side.surfaces,
            geometry=seen,
            tracer=tracer,
            budget=AIMED_NOISE / NOISE_SHARE,
            seed=number,
            bounces=bounces,
        )
        noise = 0.0 if picture.noise is None else max(picture.noise.mean)
        xyz = side.dimming * picture.xyz[0]
        found.append(FirstPicture(xyz.astype(np.float32), picture.coverage.astype(np.float32), noise))
    return found
