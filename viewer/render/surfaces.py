"""Visible surface points at samples: position, shading frame, direction to the viewer and, on request, texture
coordinates; twin of `surface.glsl` and `uv.frag`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...lighting.vectors import facing_viewer, orthonormal_frame, unit
from .raster import SUBSTEPS, TileWindow, WindowTriangles, rasterise
from .view import View


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """The N samples of a window that see a surface, sorted by pixel.

    pixel (N,) : row * width + column in the window. number (N,) : triangle of the window. point (N, 2) : column and row
    of the sample, in 1/256 sample. face (N,) : triangle of the scene.
    position (N, 3) : in radii about the scene's centre. to_viewer (N, 3) : unit. frame (N, 3, 3) : rows tangent,
    bitangent (along increasing v) and shading normal. weights (N, 3) : barycentric.
    uv (N, 2), footprint (N, 2, 2) : see `lighting.reference.geometry`; 0 on parts without uv
    (`SceneGeometry.has_uv`), None if not requested or if no part has uv.
    """

    pixel: Int[np.ndarray, " N"]
    number: Int[np.ndarray, " N"]
    point: Int[np.ndarray, "N 2"]
    face: Int[np.ndarray, " N"]
    position: Float[np.ndarray, "N 3"]
    to_viewer: Float[np.ndarray, "N 3"]
    frame: Float[np.ndarray, "N 3 3"]
    weights: Float[np.ndarray, "N 3"]
    uv: Float[np.ndarray, "N 2"] | None = None
    footprint: Float[np.ndarray, "N 2 2"] | None = None


@dataclass(frozen=True, eq=False)
class Interpolated:
    """Attributes of `SurfaceSamples` at N points of triangles; `whole` (N,): inverse depth up to a factor per
    triangle.
    """

    position: Float[np.ndarray, "N 3"]
    to_viewer: Float[np.ndarray, "N 3"]
    frame: Float[np.ndarray, "N 3 3"]
    weights: Float[np.ndarray, "N 3"]
    whole: Float[np.ndarray, " N"]


def surface_samples(
    view: View, window: TileWindow, triangles: WindowTriangles, with_uv: bool = False
) -> SurfaceSamples:
    """Rasterise one window and interpolate to its samples; texture coordinates only with `with_uv`."""
    side = view.camera.samples
    seen = seen_in(view, window, triangles)
    blocks = (window.height // side, side, window.width // side, side)
    # By pixel, and within a pixel by row.
    line, column, sub_line, sub_column = np.nonzero(seen.reshape(blocks).transpose(0, 2, 1, 3) >= 0)
    pixel = line * blocks[2] + column
    row, column = line * side + sub_line, column * side + sub_column
    number = seen[row, column]

    point = np.stack([column, row], axis=1) * SUBSTEPS + SUBSTEPS // 2
    at = interpolated(view, triangles, number, point)
    uv, footprint = uv_at(view, triangles, number, point) if with_uv and view.scene.uv is not None else (None, None)
    return SurfaceSamples(
        pixel, number, point, triangles.parent[number], at.position, at.to_viewer, at.frame, at.weights, uv, footprint
    )


def seen_in(view: View, window: TileWindow, triangles: WindowTriangles) -> Int[np.ndarray, "h w"]:
    """Rasterise a window, seeing through holes."""
    tracer = view.scene.tracer
    if tracer is None:
        return rasterise(triangles, window.width, window.height)

    def there(number: np.ndarray, sample: np.ndarray) -> Bool[np.ndarray, " n"]:
        weights, _ = _corner_weights(triangles, number, sample * SUBSTEPS + SUBSTEPS // 2)
        return ~tracer.in_holes(triangles.parent[number], weights)

    return rasterise(triangles, window.width, window.height, there)


def interpolated(
    view: View,
    triangles: WindowTriangles,
    number: Int[np.ndarray, " N"],
    point: Int[np.ndarray, "N 2"],
) -> Interpolated:
    """Interpolate triangles `number` at `point`, in 1/256 sample, also beyond their edges."""
    weights, whole = _corner_weights(triangles, number, point)
    face = triangles.parent[number]
    position, normal, tangent = (
        np.einsum("nk,nki->ni", weights, corners[face])
        for corners in (view.scene.positions, view.normals, view.scene.tangents)
    )
    to_viewer = unit(view.eye - position) if view.perspective else np.broadcast_to(view.eye, position.shape)
    normal = facing_viewer(unit(normal), to_viewer)
    frame = orthonormal_frame(normal, tangent, view.handedness[face])
    return Interpolated(position, to_viewer, frame, weights, whole)


def _corner_weights(
    triangles: WindowTriangles, number: Int[np.ndarray, " N"], point: Int[np.ndarray, "N 2"]
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """Return `Interpolated.weights` and `whole`."""
    weights = _areas(triangles, number, point) * triangles.inverse_w[number]
    whole = weights.sum(axis=1, keepdims=True)
    weights /= np.where(whole == 0.0, 1.0, whole)
    return triangles.of_parents(number, weights), whole[:, 0]


def uv_at(
    view: View,
    triangles: WindowTriangles,
    number: Int[np.ndarray, " N"],
    point: Int[np.ndarray, "N 2"],
) -> tuple[Float[np.ndarray, "N 2"], Float[np.ndarray, "N 2 2"]]:
    """Return texture coordinates and footprints of triangles `number` at `point`, as in `SurfaceSamples`."""
    inverse_w = triangles.inverse_w
    # Areas are linear in the point; changes for a step of one sample to the right, and downwards.
    opposite = np.roll(triangles.corners, -2, axis=1) - np.roll(triangles.corners, -1, axis=1)
    slopes = SUBSTEPS * np.stack([-opposite[..., 1], opposite[..., 0]], axis=1) * inverse_w[:, None]
    corners = view.uv(triangles)[number]
    weights = _areas(triangles, number, point) * inverse_w[number]
    whole = weights.sum(axis=1)
    whole = np.where(whole == 0.0, 1.0, whole)
    uv = np.einsum("nk,nkc->nc", weights, corners) / whole[:, None]
    footprint = slopes[number] @ (corners - uv[:, None]) / whole[:, None, None]
    return uv, footprint


def _areas(
    triangles: WindowTriangles, number: Int[np.ndarray, " N"], point: Int[np.ndarray, "N 2"]
) -> Int[np.ndarray, "N 3"]:
    """Return twice the signed areas of `point`, in 1/256 sample, with the sides opposite to each corner."""
    offsets = triangles.corners[number] - point[:, None]
    following, last = offsets[:, [1, 2, 0]], offsets[:, [2, 0, 1]]
    return following[..., 0] * last[..., 1] - following[..., 1] * last[..., 0]
