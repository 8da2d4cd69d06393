"""Tangents from texture coordinates, by the convention of MikkTSpace (Mikkelsen 2008), as used for baking normal maps.

The tangent runs along increasing u. The bitangent is `handedness` * cross(normal, tangent), 1 if (u, v) is oriented
like (x, y) on the anticlockwise side of the triangle, and -1 if the texture is mirrored. Triangles of one handedness
that share a vertex, and edges at it, have one tangent there: the mean of their directions of u, each projected into the
plane of the vertex normal and normalised, weighted by the triangle's angle at the vertex in that plane.

As in mikktspace.c, with its default threshold of 180 degrees: all of that; vertices equal in position, normal and uv
are identified, whatever their indices; a triangle without area in uv contributes nothing and takes its neighbours'
handedness.

Differences: (1) if those neighbours differ, it takes that of the unmirrored ones, not of the first in the file; without
neighbours it is unmirrored. (2) "Without area" is relative to the triangle's longest side in uv, not the smallest
float32. (3) Polygons are triangulated beforehand, so that the halves of a quad may differ in handedness. (4) Numbers
are float64. (5) Renderers orthonormalise the interpolated tangent and normal at every sample, which MikkTSpace does
not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..vectors import dot, orthonormal_frame, stated_tangents, unit, welded
from .creases import corner_groups

# Ratio of height to longest side in uv below which a triangle has no direction of u in float64.
THINNEST_UV = 1e-10


class Tangents(NamedTuple):
    """Tangents of a mesh of F triangles.

    directions (T, 3) : unit, orthogonal to the vertex normal.
    faces (F, 3) : index of the direction at each corner of each triangle.
    handedness (F,) : 1.0 or -1.0; the bitangent is handedness * cross(normal, tangent), along increasing v.
    """

    directions: Float[np.ndarray, "T 3"]
    faces: Int[np.ndarray, "F 3"]
    handedness: Float[np.ndarray, " F"]


def horizontal_tangents(normals: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"]) -> Tangents:
    """Compute tangents of a mesh without texture coordinates: `stated_tangents`, unmirrored."""
    directions = orthonormal_frame(normals, stated_tangents(normals))[:, 0]
    return Tangents(directions, faces, np.ones(len(faces)))


def uv_tangents(
    vertices: Float[np.ndarray, "V 3"],
    normals: Float[np.ndarray, "V 3"],
    faces: Int[np.ndarray, "F 3"],
    uv: Float[np.ndarray, "V 2"],
) -> Tangents:
    """Compute tangents of a mesh with texture coordinates, as described above; `stated_tangents` where uv determines
    none.
    """
    along_u, sign = _directions_of_u(vertices[faces], uv[faces])
    alike, vertex = welded(np.concatenate([vertices, normals, uv], axis=1))
    corners = vertex[faces]
    handedness = _handedness(corners, sign, len(alike))
    groups, label = corner_groups(corners, lambda one, other: handedness[one] == handedness[other])
    label = label.reshape(-1, 3)

    total, normal_of = np.zeros((2, groups, 3))
    for k in range(3):
        normal = normals[faces[:, k]]
        here = vertices[faces[:, k]]
        following, last = (_level(vertices[faces[:, (k + step) % 3]] - here, normal) for step in (1, 2))
        angle = np.arctan2(np.linalg.norm(np.cross(following, last), axis=1), dot(following, last))
        np.add.at(total, label[:, k], angle[:, None] * unit(_level(along_u, normal)))
        normal_of[label[:, k]] = normal
    return Tangents(orthonormal_frame(normal_of, total)[:, 0], label, handedness)


def seen_handedness(
    handedness: Float[np.ndarray, "*n"], has_uv: np.ndarray, side: Float[np.ndarray, "*n"]
) -> Float[np.ndarray, "*n"]:
    """Return the handedness of the frame about the normal on the viewer's `side` (1 front, -1 back) of triangles.

    The bitangent is along increasing v on both sides, so that textures look the same from either. Without uv, the frame
    is right-handed on both.
    """
    return np.where(has_uv, handedness * side, 1.0)


def _directions_of_u(
    points: Float[np.ndarray, "F 3 3"], uv: Float[np.ndarray, "F 3 2"]
) -> tuple[Float[np.ndarray, "F 3"], Float[np.ndarray, " F"]]:
    """Return unit directions of increasing u in triangles, and the sign of their area in uv; 0 without area."""
    (du1, dv1), (du2, dv2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area = du1 * dv2 - du2 * dv1
    longest = np.max([du1**2 + dv1**2, du2**2 + dv2**2, (du2 - du1) ** 2 + (dv2 - dv1) ** 2], axis=0)
    sign = np.where(np.abs(area) > THINNEST_UV * longest, np.sign(area), 0.0)
    rough = dv2[:, None] * (points[:, 1] - points[:, 0]) - dv1[:, None] * (points[:, 2] - points[:, 0])
    return unit(rough * sign[:, None]), sign


def _handedness(
    corners: Int[np.ndarray, "F 3"], sign: Float[np.ndarray, " F"], vertices: int
) -> Float[np.ndarray, " F"]:
    """Return 1 or -1 per triangle; a triangle without area in uv takes that of its unmirrored neighbours, else of
    mirrored ones.
    """
    found = np.where(sign == 0.0, 1.0, sign)
    lost = np.flatnonzero(sign == 0.0)
    if len(lost):
        beside = np.zeros((2, vertices), dtype=bool)
        beside[0, corners[sign > 0.0]] = True
        beside[1, corners[sign < 0.0]] = True
        unmirrored, mirrored = (np.any(one[corners[lost]], axis=1) for one in beside)
        found[lost] = np.where(mirrored & ~unmirrored, -1.0, 1.0)
    return found


def _level(directions: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    return directions - dot(directions, normals)[:, None] * normals
