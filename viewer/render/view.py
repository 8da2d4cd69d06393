"""View of a scene's triangles by one camera: visible sides, projection, and division of the image into windows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float

from ...lighting.camera import Camera
from ...lighting.mesh.tangents import seen_handedness
from ...lighting.vectors import dot
from .geometry import LightGeometry, SceneGeometry
from .raster import TileWindow, WindowTriangles, least_of, most_of, window_triangles

# Largest number of samples along a side of a window: bounds memory, keeps positions on the vertex grid exact, and
# allows progress reports.
TILE_SAMPLES = 1024


@dataclass(frozen=True, eq=False)
class View:
    """Camera's view of a scene, valid for all materials and spectra.

    side (F,) : 1 if a triangle's normal is on the viewer's side, else -1.
    handedness (F,) : 1 or -1, of the shading frames on that side (`lighting.mesh.tangents.seen_handedness`).
    perspective, eye (3,) : position of a perspective camera, or unit direction to an orthographic one.
    clip (V, 3), depth (V,) : vertices in clip space without its third coordinate, and their distances along the viewing
        direction.
    left_out (F,) : mask of culled triangles; None for none.
    """

    scene: SceneGeometry
    camera: Camera
    side: Float[np.ndarray, " F"]
    handedness: Float[np.ndarray, " F"]
    perspective: bool
    eye: Float[np.ndarray, "3"]
    clip: Float[np.ndarray, "V 3"]
    depth: Float[np.ndarray, " V"]
    left_out: Bool[np.ndarray, " F"] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image in samples."""
        return self.camera.width * self.camera.samples, self.camera.height_px * self.camera.samples

    @cached_property
    def normals(self) -> Float[np.ndarray, "F 3 3"]:
        """Return normals at corners, flipped to the viewer's side of their triangle."""
        return self.scene.normals * self.side[:, None, None]

    def lit(self, light: LightGeometry) -> Bool[np.ndarray, " F"]:
        """Return a mask of triangles with the light above their horizon, on the viewer's side."""
        return self.side * light.above > 0.0

    def windows(self, side: int | None = None) -> Iterator[TileWindow]:
        """Yield windows of whole pixels from the centre of the image outwards, of at most `side` samples along a side;
        None is `TILE_SAMPLES`.
        """
        width, height = self.size
        across, down = _steps(self.camera, side)
        corners = [(left, top) for top in range(0, height, down) for left in range(0, width, across)]

        def from_middle(corner: tuple[int, int]) -> int:
            left, top = corner
            return (2 * left + across - width) ** 2 + (2 * top + down - height) ** 2

        for left, top in sorted(corners, key=from_middle):
            yield TileWindow(left, top, min(across, width - left), min(down, height - top))

    def triangles(self, window: TileWindow) -> WindowTriangles:
        """Return the triangles in a window."""
        faces, farthest = self.scene.faces, float(self.depth.max(initial=0.0))
        clip, depth, near = self.clip, self.depth, None if self.left_out is None else np.flatnonzero(~self.left_out)
        if (window.width, window.height) != self.size:
            low, high = self.boxes
            ends = window.left + window.width, window.top + window.height
            there = (high[:, 0] >= window.left) & (low[:, 0] <= ends[0])
            there &= (high[:, 1] >= window.top) & (low[:, 1] <= ends[1])
            near = np.flatnonzero(there if self.left_out is None else there & ~self.left_out)
            # Vertices of these triangles only, once per corner.
            corners = faces[near].ravel()
            clip, depth, faces = clip[corners], depth[corners], np.arange(len(corners)).reshape(-1, 3)
        elif near is not None:
            faces = faces[near]
        found = window_triangles(clip, depth, faces, self.perspective, self.size, window, farthest)
        return found if near is None else replace(found, parent=near[found.parent])

    @cached_property
    def boxes(self) -> tuple[Float[np.ndarray, "F 2"], Float[np.ndarray, "F 2"]]:
        """Bounding boxes, lowest and highest column and row of samples, of each triangle, enlarged by one sample; the
        whole image if a corner is not in front of the camera.
        """
        ahead = self.clip[:, 2] > 0.0
        flat = self.clip[:, :2] / np.where(ahead, self.clip[:, 2], 1.0)[:, None]
        at = (0.5 * (1.0 + flat * (1.0, -1.0)) * self.size)[self.scene.faces]
        behind = ~least_of(ahead[self.scene.faces])
        low, high = least_of(at) - 1.0, most_of(at) + 1.0
        low[behind], high[behind] = -np.inf, np.inf
        return low, high

    def uv(self, triangles: WindowTriangles) -> Float[np.ndarray, "T 3 2"]:
        """Return texture coordinates at the corners of a window's triangles, 0 on parts without."""
        if self.scene.uv is None:
            return np.zeros((len(triangles.parent), 3, 2))
        return triangles.at_corners(self.scene.uv)


def view_of(scene: SceneGeometry, camera: Camera) -> View:
    """Prepare a scene for rasterisation from a camera."""
    perspective = camera.projection == "perspective"
    first = scene.first_corners
    to_viewer = camera.position - first if perspective else np.broadcast_to(camera.axes[2], first.shape)
    side = np.where(dot(scene.face_normals, to_viewer) < 0.0, -1.0, 1.0)
    # A single matrix product, since numpy would multiply vertex by vertex.
    clip = scene.points @ camera.clip_from_world()[[0, 1, 3], :3].T + camera.clip_from_world()[[0, 1, 3], 3]
    view = camera.view_from_world()
    has_uv = np.repeat(scene.has_uv, np.diff(scene.first_face))
    return View(
        scene=scene,
        camera=camera,
        side=side,
        handedness=seen_handedness(scene.handedness, has_uv, side),
        perspective=perspective,
        eye=(camera.position - scene.centre) / scene.radius if perspective else camera.axes[2],
        clip=clip,
        depth=-(scene.points @ view[2, :3] + view[2, 3]),
    )


@lru_cache(maxsize=16)
def view_key(camera: Camera) -> tuple:
    """Return a key that is equal for cameras with the same view."""
    size = (camera.width, camera.height_px, camera.samples)
    return camera.projection, camera.clip_from_world().tobytes(), camera.position.tobytes(), size


def window_count(camera: Camera, side: int | None = None) -> int:
    """Count the windows of a camera's image; `side`: see `View.windows`."""
    across, down = _steps(camera, side)
    return -(-camera.width * camera.samples // across) * -(-camera.height_px * camera.samples // down)


def _steps(camera: Camera, side: int | None) -> tuple[int, int]:
    """Return the samples along the sides of windows of whole pixels: at most `side`, or if None such that windows have
    similar sizes and costs.
    """
    most = max(1, (TILE_SAMPLES if side is None else side) // camera.samples)
    if side is not None:
        return most * camera.samples, most * camera.samples
    width, height = (-(-length // -(-length // most)) for length in (camera.width, camera.height_px))
    return width * camera.samples, height * camera.samples
