"""Subdivision of triangles too large to resolve shadows, such as a floor of two triangles.

The longest edges of each part are bisected (`edge_bisection`) repeatedly until none exceeds the limit, or the part has
its largest number of vertices. So a thin side of a box gets few vertices and its top many, and in a mesh of many small
triangles and a few large ones only the large ones are cut.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..mesh.mesh import Mesh
from ..scene import Scene
from ..vectors import unit, welded
from .edge_bisection import Halving
from .sites import numbered_faces, part_of_face

#: Longest edge after subdivision, in radii of the scene; largest number of vertices of a part after subdivision. A part
#: that already has more may get a quarter of that number, for its largest triangles.
LONGEST_EDGE, MOST_VERTICES = 0.03, 6000
# Length of edges cut in the same round, relative to the part's longest: longest first, but in few rounds. Edges of a
# shape and of its halves never have this ratio, so that the choice does not depend on rounding.
_TOGETHER = 2.0**-0.25


class Vertices(NamedTuple):
    """Positions and unit normals of vertices."""

    places: Float[np.ndarray, "V 3"]
    facing: Float[np.ndarray, "V 3"]

    @classmethod
    def of(cls, scene: Scene) -> Vertices:
        """Return the vertices of all parts, one part after the other."""
        meshes = [part.mesh for part in scene.parts]
        return cls(
            np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate([mesh.normals for mesh in meshes])
        )

    def at(self, numbers: Int[np.ndarray, " n"]) -> Vertices:
        """Select vertices by index."""
        return Vertices(self.places[numbers], self.facing[numbers])

    def scaled(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> Vertices:
        """Scale to a scene of radius 1 about the origin, as `Sites`. low, high : the scene's bounds."""
        return self._replace(places=(self.places - 0.5 * (low + high)) / (0.5 * float(np.linalg.norm(high - low))))

    def with_middles(self, pairs: Int[np.ndarray, "A 2"]) -> Vertices:
        """Append the midpoints of pairs, with averaged normals."""
        return Vertices(
            np.concatenate([self.places, self.places[pairs].mean(axis=1)]),
            np.concatenate([self.facing, unit(self.facing[pairs].sum(axis=1))]),
        )


def refined(scene: Scene, longest_edge: float | None = None) -> tuple[Scene, Halving, Int[np.ndarray, " V"]]:
    """Subdivide the large triangles of a scene.

    longest_edge : limit, in radii of the scene; None: `LONGEST_EDGE`.

    Returns
    -------
    The subdivided scene; the cuts, with vertices and triangles of all parts one after the other, as in
    `geometry.Tracer`, followed by the added vertices; and the index in the new scene of each of these vertices.
    """
    halving, vertices = cuts(scene, longest_edge)
    fine, number = divided(scene, halving, vertices)
    return fine, halving, number


def divided(scene: Scene, halving: Halving, vertices: Vertices) -> tuple[Scene, Int[np.ndarray, " V"]]:
    """Replace the triangles of a scene by their pieces; return it and the index in it of each vertex.

    vertices : those of the scene, then those added by cuts.
    """
    places, facing = vertices
    total = sum(len(part.mesh.vertices) for part in scene.parts)
    part_of_piece = part_of_face(scene)[halving.of]
    cut = np.unique(part_of_piece[~halving.whole])
    shares = halving.shares if len(cut) else None
    number, parts, old, new = np.full(len(places), -1), [], 0, 0
    for which, each in enumerate(scene.parts):
        mesh, ours = each.mesh, len(each.mesh.vertices)
        number[old : old + ours] = new + np.arange(ours)
        if which in cut and shares is not None:
            mine = np.flatnonzero(part_of_piece == which)
            corners = halving.pieces[mine]
            added = corners >= total
            # A vertex on a seam has texture coordinates on each side.
            keys, uv = corners[added][:, None], None
            if mesh.uv is not None:
                uv = np.einsum("tck,tki->tci", shares[mine], mesh.uv[halving.corners[halving.of[mine]] - old])
                keys = np.column_stack([keys, uv[added]])
            _, at, local = np.unique(keys, axis=0, return_index=True, return_inverse=True)
            middles, faces = corners[added][at], corners - old
            faces[added] = ours + local.reshape(-1)
            number[middles] = new + ours + np.arange(len(middles))
            mesh = Mesh(
                np.concatenate([mesh.vertices, places[middles]]),
                np.concatenate([mesh.normals, facing[middles]]),
                faces,
                uv=None if mesh.uv is None or uv is None else np.concatenate([mesh.uv, uv[added][at]]),
                name=mesh.name,
            )
        parts.append(replace(each, mesh=mesh))
        old, new = old + ours, new + len(mesh.vertices)
    return replace(scene, parts=tuple(parts)), number


def edges_between(triangles: Int[np.ndarray, "n 3"], sites: Int[np.ndarray, " V"]) -> Int[np.ndarray, "E 2"]:
    """Return the edges of triangles as pairs of vertices; edges between the same two sites are merged, as along a
    seam.
    """
    ends = np.concatenate([triangles[:, [1, 2]], triangles[:, [2, 0]], triangles[:, [0, 1]]])
    between = np.sort(sites[ends].astype(np.int64), axis=1)
    return ends[np.unique(between[:, 0] * (int(sites.max(initial=0)) + 1) + between[:, 1], return_index=True)[1]]


def cuts(scene: Scene, longest_edge: float | None = None) -> tuple[Halving, Vertices]:
    """Return the cuts of large triangles, and all vertices including added ones: see `refined`."""
    low, high = scene.bounds
    longest = (LONGEST_EDGE if longest_edge is None else longest_edge) * 0.5 * float(np.linalg.norm(high - low))
    longest *= 1.0 + 1e-9
    meshes = [part.mesh for part in scene.parts]
    counts = np.array([len(mesh.vertices) for mesh in meshes])
    halving, vertices, of_face = Halving.none(numbered_faces(scene)), Vertices.of(scene), part_of_face(scene)
    part = np.repeat(np.arange(len(meshes)), counts)
    sites = welded(np.column_stack([*vertices, part]))[1]
    room = np.maximum(MOST_VERTICES - counts, np.minimum(MOST_VERTICES, counts) // 4)
    going = np.array([_longest(mesh) > longest for mesh in meshes])
    while going.any():
        pairs = edges_between(halving.pieces[going[of_face[halving.of]]], sites)
        length, of = np.linalg.norm(np.diff(vertices.places[pairs], axis=1)[:, 0], axis=1), part[pairs[:, 0]]
        most = np.zeros(len(meshes))
        np.maximum.at(most, of, length)
        chosen = length > np.maximum(longest, _TOGETHER * most)[of]
        needed = np.bincount(of[chosen], minlength=len(meshes))
        going &= (needed > 0) & (needed <= room)
        chosen &= going[of]
        room -= np.where(going, needed, 0)
        pairs = pairs[chosen]
        # Longest first, quantised so that rounding does not affect the order.
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0], -np.round(1e6 * np.log2(length[chosen]))))]
        halving, vertices = halving.cut(sites, pairs), vertices.with_middles(pairs)
        part = np.concatenate([part, part[pairs[:, 0]]])
        sites = np.concatenate([sites, int(sites.max()) + 1 + np.arange(len(pairs))])
    return halving, vertices


def _longest(mesh: Mesh) -> float:
    corners = mesh.vertices[mesh.faces]
    return float(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).max())
