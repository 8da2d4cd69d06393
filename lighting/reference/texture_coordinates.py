"""Footprints of samples in texture coordinates, as rays see them.

uv (N, 2) : (0, 0) at the lower left corner of a picture, u to the right, v upwards; numbers beyond [0, 1] are left to
whoever looks something up. footprint (N, 2, 2) : in rows, how (u, v) changes from a sample to the next column (to the
right) and to the next row (downwards) of the picture's samples; the area of a sample in uv is |det|.

Derivatives at the sample's own point, on the plane of its triangle, which goes on beyond the triangle's sides: no other
part, silhouette or crease enters (Igehy 1999, Tracing ray differentials, section 3.1.2). Renderers that rasterise
have the twin of this in `viewer.render.surfaces`.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..camera import Camera
from ..vectors import dot


def uv_gradients(corners: Float[np.ndarray, "F 3 3"], uv: Float[np.ndarray, "F 3 2"]) -> Float[np.ndarray, "F 2 3"]:
    """Compute the gradients of u and v along the three coordinates of space, in the planes of triangles with these
    corners.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    # Directions along which only the one side's weight grows, and at which rate.
    by_first, by_second = np.cross(second, normal), np.cross(normal, first)
    by_uv = np.einsum("nc,ni->nci", uv[:, 1] - uv[:, 0], by_first) + np.einsum(
        "nc,ni->nci", uv[:, 2] - uv[:, 0], by_second
    )
    return by_uv / dot(normal, normal)[:, None, None]


def uv_footprints(
    camera: Camera,
    directions: Float[np.ndarray, "N 3"],
    distance: Float[np.ndarray, " N"],
    normals: Float[np.ndarray, "N 3"],
    gradients: Float[np.ndarray, "N 2 3"],
) -> Float[np.ndarray, "N 2 2"]:
    """Footprints of samples whose rays, with unit `directions`, meet triangles with these normals and `uv_gradients` at
    `distance`.
    """
    width, height = camera.sample_size
    right, up, back = camera.axes
    steps = width * right, -height * up
    # Where the step is one of the ray's direction, it is at unit depth; a parallel view's is one of place.
    scale = -distance * (directions @ back) if camera.projection == "perspective" else np.ones_like(distance)
    # What a step leaves of the plane is made up for along the ray.
    along = np.einsum("nci,ni->nc", gradients, directions) / dot(normals, directions)[:, None]
    rows = [scale[:, None] * (gradients @ step - along * (normals @ step)[:, None]) for step in steps]
    return np.stack(rows, axis=1)
