"""Points, directions and local frames."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..runtime.errors import InputError

#: The cosine to the viewer that a shading normal has at least.
LEAST_COSINE = 1e-3
# Types of constructor arguments: any three numbers, kept as a (3,) float64 vector; lengths and strengths, whole too.
VectorLike = Any
Number = float | int


def finite_vector(value: object, field: str) -> Float[np.ndarray, "3"]:
    """Three finite numbers as a float64 vector; InputError names `field` otherwise."""
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError("not a point or direction", field=field, found=value, expected="three finite numbers")
    return vector


def unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Return the same directions at length one; a vector of no length stays what it is."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def welded(points: Float[np.ndarray, "n k"]) -> tuple[Float[np.ndarray, "m k"], Int[np.ndarray, " n"]]:
    """Return the different points, sorted, and which of them each one is: `np.unique` along an axis, much sooner."""
    order = np.lexsort(points.T[::-1])
    ordered = points[order]
    first = np.ones(len(points), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    which = np.empty(len(points), dtype=np.int64)
    which[order] = np.cumsum(first) - 1
    return ordered[first], which


def dot(a: Float[np.ndarray, "*n 3"], b: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
    """Scalar products along the last axis."""
    return np.einsum("...i,...i->...", a, b)


def facing_viewer(
    normals: Float[np.ndarray, "*n 3"], to_viewer: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n 3"]:
    """Return the unit normals; those that look away from the viewer are bent just enough to have `LEAST_COSINE` before
    they are unit again. Every renderer shades with these, so pictures can be compared up to the outlines.
    """
    facing = dot(normals, to_viewer)
    bend = np.where(facing < LEAST_COSINE, LEAST_COSINE - facing, 0.0)
    return unit(normals + bend[..., None] * to_viewer)


def stated_tangents(normals: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Return the tangent that a surface without texture coordinates gets: horizontal, along up x normal (world y is
    up).

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
    """Rows tangent, bitangent, normal: `frame @ world` is local, z along the (unit) normal.

    `tangents` need only be roughly tangent; one that is parallel to its normal is replaced by `stated_tangents`. The
    frame is right-handed, or mirrored where `handedness` is -1 and not 1.
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
