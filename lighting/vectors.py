"""Points, directions and local frames."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..runtime.errors import InputError

#: Least cosine between a shading normal and the viewer.
LEAST_COSINE = 1e-3
# Types of constructor arguments: three numbers, stored as a (3,) float64 vector; lengths and strengths, also integers.
VectorLike = Any
Number = float | int


def finite_vector(value: object, field: str) -> Float[np.ndarray, "3"]:
    """Convert three finite numbers to a float64 vector; otherwise raise InputError with `field`."""
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError("not a point or direction", field=field, found=value, expected="three finite numbers")
    return vector


def unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Normalise vectors; one of length 0 is unchanged."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def welded(points: Float[np.ndarray, "n k"]) -> tuple[Float[np.ndarray, "m k"], Int[np.ndarray, " n"]]:
    """Return the distinct points, sorted, and the index of each point among them: `np.unique` along an axis, much
    faster.
    """
    order = np.lexsort(points.T[::-1])
    ordered = points[order]
    first = np.ones(len(points), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    which = np.empty(len(points), dtype=np.int64)
    which[order] = np.cumsum(first) - 1
    return ordered[first], which


def dot(a: Float[np.ndarray, "*n 3"], b: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
    """Compute dot products along the last axis."""
    return np.einsum("...i,...i->...", a, b)


def facing_viewer(
    normals: Float[np.ndarray, "*n 3"], to_viewer: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n 3"]:
    """Bend unit normals that face away from the viewer just enough to have the cosine `LEAST_COSINE` before
    normalisation. All renderers shade with these, so that images are comparable up to the outlines.
    """
    facing = dot(normals, to_viewer)
    bend = np.where(facing < LEAST_COSINE, LEAST_COSINE - facing, 0.0)
    return unit(normals + bend[..., None] * to_viewer)


def stated_tangents(normals: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Return default tangents for surfaces without texture coordinates: horizontal, along up x normal (world y is up).

    On a sphere these are the circles of latitude. Where the normal is within 1e-6 of vertical the tangent is world x.
    """
    horizontal = np.stack([normals[..., 2], np.zeros_like(normals[..., 0]), -normals[..., 0]], axis=-1)
    vertical = np.linalg.norm(horizontal, axis=-1, keepdims=True) < 1e-6
    return unit(np.where(vertical, np.array([1.0, 0.0, 0.0]), horizontal))


def orthonormal_frame(
    normals: Float[np.ndarray, "*n 3"],
    tangents: Float[np.ndarray, "*n 3"],
    handedness: Float[np.ndarray, "*n"] | None = None,
) -> Float[np.ndarray, "*n 3 3"]:
    """Build frames with rows tangent, bitangent, normal: `frame @ world` is local, z along the (unit) normal.

    `tangents` need only be roughly tangent; one parallel to its normal is replaced by `stated_tangents`. The frame is
    right-handed, or mirrored where `handedness` is -1 instead of 1.
    """
    flat = tangents - dot(tangents, normals)[..., None] * normals
    lost = np.linalg.norm(flat, axis=-1, keepdims=True) < 1e-8
    fallback = stated_tangents(normals)
    fallback = fallback - dot(fallback, normals)[..., None] * normals
    tangent = unit(np.where(lost, fallback, flat))
    bitangent = np.cross(normals, tangent)
    if handedness is not None:
        bitangent = handedness[..., None] * bitangent
    return np.stack([tangent, bitangent, normals], axis=-2)
