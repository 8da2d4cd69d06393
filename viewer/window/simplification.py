"""Mesh simplification by vertex clustering, for images during motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from ...lighting.mesh.mesh import Mesh, degenerate_faces
from ...lighting.scene import Scene
from ...lighting.vectors import unit

# Numbers of cells along the longest side of a mesh's box, tried in order.
_CELLS = (256, 192, 144, 108, 81, 61, 46, 34, 26, 19, 14, 10)


def simplified_scene(scene: Scene, most: int) -> Scene:
    """Simplify the largest meshes of a scene to `most` triangles in total, or as few as possible; returns itself if it
    has no more.

    Meshes with texture coordinates are unchanged, since neighbours in space may be far apart on a texture.
    """
    faces = sum(len(part.mesh.faces) for part in scene.parts)
    if faces <= most:
        return scene
    share = most / faces
    parts = tuple(replace(part, mesh=simplified(part.mesh, int(share * len(part.mesh.faces)))) for part in scene.parts)
    return replace(scene, parts=parts)


def simplified(mesh: Mesh, most: int) -> Mesh:
    """Simplify a mesh to at most `most` triangles, or to as few as a grid of ten cells along its longest side allows.

    The vertices of a cell are replaced by their mean, with the mean of their normals; triangles in fewer than three
    cells are dropped (J. Rossignac and P. Borrel, Multi-resolution 3D approximations for rendering complex scenes,
    1993). Vertices with different normal directions are not merged, so that thin plates keep two sides. The mesh itself
    is returned if it has no more triangles, has texture coordinates, or nothing of it would be left.
    """
    if len(mesh.faces) <= most or mesh.uv is not None:
        return mesh
    found = mesh
    for cells in _CELLS:
        coarser = _clustered(mesh, cells)
        if coarser is None:
            return found
        found = coarser
        if len(found.faces) <= most:
            break
    return found


def is_closed(mesh: Mesh) -> bool:
    """Return whether each edge joins two triangles of opposite orientation, ignoring splits by normals, so that
    backfaces are visible only from inside.
    """
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.faces].astype(np.int64)
    count = int(faces.max(initial=0)) + 1
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    there, back = np.sort(start * count + end), np.sort(end * count + start)
    return bool((there[1:] != there[:-1]).all() and np.array_equal(there, back))


def _clustered(mesh: Mesh, cells: int) -> Mesh | None:
    """Merge the vertices of a mesh by cells; None if no triangle is left."""
    low, high = mesh.bounds
    size = max(float((high - low).max()), 1e-300)
    cell = np.floor((mesh.vertices - low) / size * cells).astype(np.int64)
    # Digit from 0 to 5: the axis of the normal's longest component, and its sign.
    longest = np.abs(mesh.normals).argmax(axis=1)
    towards = 2 * longest + (np.take_along_axis(mesh.normals, longest[:, None], axis=1)[:, 0] < 0.0)
    _, cluster = np.unique(np.column_stack([cell, towards]), axis=0, return_inverse=True)
    cluster = cluster.reshape(-1)
    vertices, normals = (_means(one, cluster) for one in (mesh.vertices, mesh.normals))
    faces = cluster[mesh.faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    faces = faces[~degenerate_faces(vertices, faces)]
    return Mesh(vertices, unit(normals), faces, name=mesh.name) if len(faces) else None


def _means(values: Float[np.ndarray, "V 3"], cluster: Int[np.ndarray, " V"]) -> Float[np.ndarray, "C 3"]:
    count = np.bincount(cluster)
    return np.stack([np.bincount(cluster, one) / count for one in values.T], axis=1)
