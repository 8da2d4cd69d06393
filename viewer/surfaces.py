"""What samples see of a surface: position, shading frame and direction to the viewer; twin of `surface.glsl`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ..lighting.vectors import facing_viewer, orthonormal_frame, unit
from .raster import SUBSTEPS, Window, WindowTriangles, rasterise
from .view import View


@dataclass(frozen=True, eq=False)
class Surface:
    """The N samples of a window that meet a surface, sorted by pixel.

    pixel (N,) : row * width + column in the window. number (N,) : triangle of the window. point (N, 2) : column and row
    of the sample, in 1/256. face (N,) : triangle of the scene.
    position (N, 3) : in radii about the scene's centre. to_viewer (N, 3) : unit. frame (N, 3, 3) : rows tangent,
    bitangent and shading normal.
    """

    pixel: Int[np.ndarray, " N"]
    number: Int[np.ndarray, " N"]
    point: Int[np.ndarray, "N 2"]
    face: Int[np.ndarray, " N"]
    position: Float[np.ndarray, "N 3"]
    to_viewer: Float[np.ndarray, "N 3"]
    frame: Float[np.ndarray, "N 3 3"]


@dataclass(frozen=True, eq=False)
class Interpolated:
    """`Surface` at N points of given triangles, and `whole` (N,): a depth's inverse, up to a factor of the triangle."""

    position: Float[np.ndarray, "N 3"]
    to_viewer: Float[np.ndarray, "N 3"]
    frame: Float[np.ndarray, "N 3 3"]
    whole: Float[np.ndarray, " N"]


def surface_samples(view: View, window: Window, triangles: WindowTriangles) -> Surface:
    """Rasterise one window and interpolate to its samples."""
    side = view.camera.samples
    seen = rasterise(triangles, window.width, window.height)
    blocks = (window.height // side, side, window.width // side, side)
    # By pixel, and within a pixel by row.
    line, column, sub_line, sub_column = np.nonzero(seen.reshape(blocks).transpose(0, 2, 1, 3) >= 0)
    pixel = line * blocks[2] + column
    row, column = line * side + sub_line, column * side + sub_column
    number = seen[row, column]

    point = np.stack([column, row], axis=1) * SUBSTEPS + SUBSTEPS // 2
    at = interpolated(view, triangles, number, point)
    return Surface(pixel, number, point, triangles.parent[number], at.position, at.to_viewer, at.frame)


def interpolated(
    view: View,
    triangles: WindowTriangles,
    number: Int[np.ndarray, " N"],
    point: Int[np.ndarray, "N 2"],
) -> Interpolated:
    """What triangles `number` show at `point`, in 1/256 sample; the plane of a triangle goes on beyond its edges."""
    offsets = triangles.corners[number] - point[:, None]
    following, last = offsets[:, [1, 2, 0]], offsets[:, [2, 0, 1]]
    weights = (following[..., 0] * last[..., 1] - following[..., 1] * last[..., 0]) * triangles.inverse_w[number]
    whole = weights.sum(axis=1, keepdims=True)
    weights /= np.where(whole == 0.0, 1.0, whole)
    if (triangles.weights != np.eye(3)).any():
        weights = np.einsum("nk,nkj->nj", weights, triangles.weights[number])

    face = triangles.parent[number]
    position, normal, tangent = (
        np.einsum("nk,nki->ni", weights, corners[face])
        for corners in (view.scene.positions, view.normals, view.scene.tangents)
    )
    to_viewer = unit(view.eye - position) if view.perspective else np.broadcast_to(view.eye, position.shape)
    normal = facing_viewer(unit(normal), to_viewer)
    return Interpolated(position, to_viewer, orthonormal_frame(normal, tangent), whole[:, 0])
