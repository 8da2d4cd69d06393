"""The connected pieces of a mesh: which are closed bodies, which are sheets that show both sides, which are convex."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..mesh.mesh import Mesh
from ..vectors import dot, welded

# A neighbour that rises this far above a triangle's plane, in sizes of the mesh, is rounding, not a hollow.
_FLAT = 1e-9


class Pieces(NamedTuple):
    """The P pieces of a mesh: triangles that hang together at edges, whatever numbers their vertices have.

    of_face (F,) : the piece of each triangle.
    solid (P,) : closed, wound alike all over, and the winding looks outwards: its inside is dark, and nobody sees it.
    convex (P,) : a solid that hides nothing from itself.
    """

    of_face: Int[np.ndarray, " F"]
    solid: Bool[np.ndarray, " P"]
    convex: Bool[np.ndarray, " P"]


def pieces(mesh: Mesh) -> Pieces:
    """Return the pieces of a mesh.

    An edge is in order if it belongs to two triangles that run along it in opposite senses. A piece all of whose edges
    are in order is closed. It is convex if, beside, no triangle rises above the plane of its neighbour: a closed
    surface that is convex everywhere is so as a whole, unless it winds around more than once; one does so whose
    angles at a vertex add up to more than a full turn, which no convex corner has.
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

    # Edges out of order hold pieces together as well: by the edge's number, whichever way it runs.
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
    """(F, 3) angles of the triangles at their corners, radians."""
    return triangle_angles(mesh.vertices[mesh.faces])


def triangle_angles(corners: Float[np.ndarray, "F 3 3"]) -> np.ndarray:
    """(F, 3) angles of triangles at their corners, radians."""
    along = corners[:, [1, 2, 0]] - corners
    back = -along[:, [2, 0, 1]]
    # Twice the area, at whatever corner.
    area = np.linalg.norm(np.cross(along[:, 0], back[:, 0]), axis=-1)
    return np.arctan2(area[:, None], dot(along, back))
