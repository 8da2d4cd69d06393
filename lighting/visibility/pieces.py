"""Connected pieces of a mesh, classified as closed bodies or two-sided sheets, and as convex."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..mesh.mesh import Mesh
from ..vectors import dot, welded

# Height of a neighbour above a triangle's plane, in sizes of the mesh, attributed to rounding, not to a concavity.
_FLAT = 1e-9


class Pieces(NamedTuple):
    """The P pieces of a mesh: triangles connected by edges, compared by position, not by vertex index.

    of_face (F,) : the piece of each triangle.
    solid (P,) : closed, consistently wound, facing outwards; its inside is dark and never seen.
    convex (P,) : solid without self-occlusion.
    """

    of_face: Int[np.ndarray, " F"]
    solid: Bool[np.ndarray, " P"]
    convex: Bool[np.ndarray, " P"]


def pieces(mesh: Mesh) -> Pieces:
    """Find the pieces of a mesh.

    An edge is regular if it belongs to two triangles that traverse it in opposite senses. A piece with only regular
    edges is closed. It is convex if also no triangle rises above the plane of its neighbour: a closed, locally convex
    surface is convex unless it winds around more than once. A surface that does has a vertex whose angles sum to more
    than a full turn, which is tested too.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    points, number = welded(mesh.vertices)
    corners = number[mesh.faces]
    count, faces = len(points), len(corners)
    start, end = corners[:, [0, 1, 2]].ravel(), corners[:, [1, 2, 0]].ravel()
    opposite = mesh.vertices[mesh.faces[:, [2, 0, 1]].ravel()]
    key, reverse = start * count + end, end * count + start
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    alone = np.ones(len(key), dtype=bool)
    repeated = ordered[1:] == ordered[:-1]
    alone[order[1:][repeated]] = alone[order[:-1][repeated]] = False
    found = np.minimum(np.searchsorted(ordered, reverse), len(key) - 1)
    there = ordered[found] == reverse
    other = order[found]
    in_order = alone & there & alone[other]

    # Irregular edges connect pieces as well: by the edge's number, in either direction.
    edge = np.unique(np.minimum(key, reverse), return_inverse=True)[1]
    face = np.repeat(np.arange(faces), 3)
    links = coo_array((np.ones(len(face)), (face, faces + edge)), shape=(faces + edge.max() + 1,) * 2)
    labels = connected_components(links, directed=False)[1][:faces]
    of_face = np.unique(labels, return_inverse=True)[1].reshape(-1)
    closed = np.bincount(of_face[face], weights=~in_order) == 0

    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - centre for k in range(3))
    solid = closed & (np.bincount(of_face, weights=dot(a, np.cross(b, c))) > 0.0)

    # Height of the neighbour's third corner above the plane of each triangle.
    above = dot(np.repeat(mesh.face_normals, 3, axis=0), opposite[other] - mesh.vertices[mesh.faces.ravel()])
    hollow = np.bincount(of_face[face], weights=in_order & (above > _FLAT * size)) > 0
    turned = np.bincount(number[mesh.faces.ravel()], weights=corner_angles(mesh).ravel(), minlength=count)
    around = np.zeros(len(solid), dtype=bool)
    around[of_face[(turned > 2.0 * np.pi + 1e-6)[corners].any(axis=1)]] = True
    return Pieces(of_face, solid, solid & ~hollow & ~around)


def corner_angles(mesh: Mesh) -> np.ndarray:
    """Return the angles (F, 3) of a mesh's triangles at their corners, radians."""
    return triangle_angles(mesh.vertices[mesh.faces])


def triangle_angles(corners: Float[np.ndarray, "F 3 3"]) -> np.ndarray:
    """Return the angles (F, 3) of triangles at their corners, radians."""
    along = corners[:, [1, 2, 0]] - corners
    back = -along[:, [2, 0, 1]]
    # Twice the area, the same at every corner.
    area = np.linalg.norm(np.cross(along[:, 0], back[:, 0]), axis=-1)
    return np.arctan2(area[:, None], dot(along, back))
