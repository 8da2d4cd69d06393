"""Convexity of meshes: a convex body does not occlude itself."""

from __future__ import annotations

import numpy as np

from ..vectors import dot, welded
from .mesh import Mesh

# Distance, as a share of the mesh's size, below which vertices are welded, as along uv seams.
_SAME = 1e-9
# Concavity of an edge, in sizes of the mesh, attributed to rounding.
_FLAT = 1e-12
# Largest sum of angles about a vertex, radians: a full turn, and rounding.
_FULL_TURN = 2.0 * np.pi + 1e-6


def is_convex(mesh: Mesh) -> bool:
    """Return whether the triangles are the whole surface of one convex body, facing outwards.

    Each edge belongs to two triangles and is convex; angles at a vertex sum to at most a full turn, and the mesh is
    connected with the Euler characteristic of a ball. A closed, locally convex surface is convex (Nakajima 1928).
    """
    size = float(np.ptp(mesh.vertices, axis=0).max())
    faces = welded(np.round(mesh.vertices / (_SAME * size)))[1][mesh.faces]
    count = int(faces.max()) + 1
    edges = np.concatenate([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]])
    order = np.lexsort(np.sort(edges, axis=1).T)
    if len(edges) % 2:
        return False
    one, other = order[::2], order[1::2]
    # Each edge occurs twice, once in either direction.
    if not (edges[one] == edges[other][:, ::-1]).all() or len(np.unique(np.sort(edges, axis=1), axis=0)) != len(one):
        return False
    if len(np.unique(faces)) - len(one) + len(faces) != 2 or not _of_one_piece(faces, count):
        return False
    # The opposite corner is below the plane of the adjacent triangle.
    opposite = mesh.vertices[np.concatenate([mesh.faces[:, k] for k in range(3)])]
    face = np.tile(np.arange(len(faces)), 3)
    above = dot(opposite[other] - opposite[one], mesh.face_normals[face[one]])
    return bool((above <= _FLAT * size).all()) and bool((_angles(mesh, faces, count) <= _FULL_TURN).all())


def _of_one_piece(faces: np.ndarray, count: int) -> bool:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(ends)), tuple(ends.T)), shape=(count, count))
    return len(np.unique(connected_components(graph, directed=False)[1][np.unique(faces)])) == 1


def _angles(mesh: Mesh, faces: np.ndarray, count: int) -> np.ndarray:
    """Sum the triangles' angles at each vertex, radians."""
    total = np.zeros(count)
    for k in range(3):
        here, ahead, back = (mesh.vertices[mesh.faces[:, (k + i) % 3]] for i in range(3))
        a, b = ahead - here, back - here
        angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), dot(a, b))
        total += np.bincount(faces[:, k], angle, minlength=count)
    return total
