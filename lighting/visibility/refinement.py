"""Further vertices on parts whose triangles are too large to have shadows on: a floor of two triangles has none at all.

All triangles of a part are divided alike, into k^2 smaller ones each, so that triangles that share an edge share the
vertices on it and nothing jumps there. A part of many small triangles and a few large ones is therefore left as it is
where dividing all would make too many. Triangles of parts that are not divided may be cut further, one by one, where
visibility changes much along their edges (`halving`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ..mesh import Mesh
from ..scene import Scene
from ..vectors import unit, welded
from .halving import Halving, halved

#: The longest edge that there should be, in radii of the scene; how many vertices a part may have after dividing.
LONGEST_EDGE, MOST_VERTICES = 0.03, 4096


@dataclass(frozen=True, eq=False)
class Refinement:
    """Where the vertices are that were added.

    Vertices of all parts have the numbers that they have one after the other, as in `geometry.Tracer`; added ones
    come after them. Triangles are numbered over all parts too.

    corners (F, 3) : the vertices of the triangles as they were.
    first (P + 1,) : the first triangle of each part, and how many there are.
    divisions (P,) : k of each part.
    nodes : of each part (triangles, (k + 1)(k + 2) / 2) vertices: column b (k + 1) - b (b - 1) / 2 + a is the one with
        weights (k - a - b, a, b) / k. Empty where k is 1.
    halving : cuts of triangles of parts where k is 1; None where there are none.
    """

    corners: Int[np.ndarray, "F 3"]
    first: Int[np.ndarray, " parts_and_1"]
    divisions: Int[np.ndarray, " parts"]
    nodes: tuple[Int[np.ndarray, "_ _"], ...]
    halving: Halving | None = None

    @property
    def undivided(self) -> Int[np.ndarray, " n"]:
        """The triangles of parts where k is 1."""
        return np.flatnonzero(np.repeat(self.divisions == 1, np.diff(self.first)))

    def cut(
        self, fronts: Int[np.ndarray, " V"], pairs: Int[np.ndarray, "A 2"]
    ) -> tuple[Refinement, Int[np.ndarray, "L 3"], Int[np.ndarray, " L"]]:
        """The same with triangles cut in the middles of pairs of vertices, which are numbered from V; see `halved`."""
        if not len(pairs):
            return self, self.corners[:0], self.first[:0]
        faces = self.undivided
        found, pieces, of = halved(self.corners[faces], fronts.astype(np.int64), pairs.astype(np.int64))
        roots = np.full(len(self.corners), -1)
        roots[faces] = found.roots
        return replace(self, halving=replace(found, roots=roots)), pieces, faces[of]

    def located(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Three vertices near each point and their barycentric weights; the point is given by its triangle and the
        weights of that one's corners.
        """
        numbers, found = self.corners[faces], np.array(weights, dtype=np.float64)
        part = np.searchsorted(self.first, faces, side="right") - 1
        for which in np.flatnonzero(self.divisions > 1):
            here, k = np.flatnonzero(part == which), int(self.divisions[which])
            if not len(here):
                continue
            v, w = found[here, 1] * k, found[here, 2] * k
            # The row first: rounding may put a point on the far edge into a column that the row does not have.
            b = np.clip(np.floor(w).astype(np.int64), 0, k - 1)
            a = np.clip(np.floor(v).astype(np.int64), 0, k - 1 - b)
            v, w = v - a, w - b
            upper = v + w > 1.0
            columns = np.stack([np.where(upper, _column(a + 1, b + 1, k), _column(a, b, k)), _column(a + 1, b, k)], 1)
            columns = np.column_stack([columns, _column(a, b + 1, k)])
            numbers[here] = self.nodes[which][(faces[here] - self.first[which])[:, None], columns]
            corner = np.where(upper, v + w - 1.0, 1.0 - v - w)
            found[here] = np.stack([corner, np.where(upper, 1.0 - w, v), np.where(upper, 1.0 - v, w)], axis=1)
        return (numbers, found) if self.halving is None else self.halving.located(faces, numbers, found)


def refined(scene: Scene, longest_edge: float | None = None) -> tuple[Scene, Refinement, Int[np.ndarray, " V"]]:
    """The scene with divided triangles, where its vertices are, and for each vertex of the refinement its number in
    the new scene.

    longest_edge : that there should be, in radii of the scene; None: `LONGEST_EDGE`.
    """
    low, high = scene.bounds
    longest = (LONGEST_EDGE if longest_edge is None else longest_edge) * 0.5 * float(np.linalg.norm(high - low))
    meshes = [part.mesh for part in scene.parts]
    divisions = np.array([_divisions(mesh, longest) for mesh in meshes])
    counts = [len(mesh.vertices) for mesh in meshes]
    offsets = np.cumsum([0, *counts])
    parts, nodes, order, added = [], [], [], []
    total, new = int(offsets[-1]), 0
    for part, k, offset in zip(scene.parts, divisions.tolist(), offsets.tolist(), strict=False):
        mesh, local = (part.mesh, np.zeros((0, 0), np.int64)) if k == 1 else _divided(part.mesh, k)
        more = len(mesh.vertices) - len(part.mesh.vertices)
        ours = len(part.mesh.vertices)
        nodes.append(np.where(local < ours, local + offset, local - ours + total))
        order.append(new + np.arange(ours))
        added.append(new + ours + np.arange(more))
        parts.append(replace(part, mesh=mesh))
        total, new = total + more, new + len(mesh.vertices)
    corners = np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)])
    first = np.cumsum([0, *(len(mesh.faces) for mesh in meshes)])
    found = Refinement(corners, first, divisions, tuple(nodes))
    return replace(scene, parts=tuple(parts)), found, np.concatenate([*order, *added])


def _divisions(mesh: Mesh, longest: float) -> int:
    """Into how many an edge of a mesh is divided."""
    corners = mesh.vertices[mesh.faces]
    edge = float(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).max())
    room = int(np.sqrt(2.0 * MOST_VERTICES / len(mesh.faces)))
    return max(1, min(int(np.ceil(edge / longest)), room))


def _column(a: Int[np.ndarray, " n"], b: Int[np.ndarray, " n"], k: int) -> Int[np.ndarray, " n"]:
    return b * (k + 1) - b * (b - 1) // 2 + a


def _divided(mesh: Mesh, k: int) -> tuple[Mesh, Int[np.ndarray, "F nodes"]]:
    """The mesh with every triangle divided into k^2, its own vertices first; and the nodes of each triangle."""
    b, a = (each.ravel() for each in np.divmod(np.arange((k + 1) ** 2), k + 1))
    a, b = a[a + b <= k], b[a + b <= k]
    share = np.stack([k - a - b, a, b], axis=1)
    # A node's corners in the order of their places, so that triangles on both sides of an edge round alike.
    place = welded(mesh.vertices)[1][mesh.faces]
    order = np.argsort(place, axis=1)
    faces = np.take_along_axis(mesh.faces, order, axis=1)
    parts = np.take_along_axis(np.broadcast_to(share, (len(faces), *share.shape)), order[:, None], axis=2)
    keys = np.where(parts > 0, faces[:, None] * (k + 1) + parts, -1).reshape(-1, 3)
    # A corner itself keeps its number; what else there is, is numbered after the mesh's own.
    whole = (parts == k).reshape(-1, 3)
    own = whole.any(axis=1)
    number = np.empty(len(keys), dtype=np.int64)
    number[own] = np.repeat(faces, len(share), axis=0)[own][whole[own]]
    fresh, which = np.unique(np.sort(keys[~own], axis=1), axis=0, return_inverse=True)
    number[~own] = len(mesh.vertices) + which.reshape(-1)
    first = np.full(len(fresh), -1)
    first[which.reshape(-1)] = np.flatnonzero(~own)
    at, weights = np.repeat(faces, len(share), axis=0)[first], parts.reshape(-1, 3)[first] / k
    vertices = np.einsum("nk,nki->ni", weights, mesh.vertices[at])
    normals = unit(np.einsum("nk,nki->ni", weights, mesh.normals[at]))
    nodes = number.reshape(len(faces), -1)

    # The small triangles: one at each node that has a next column and row, and one more where that is not the last.
    a, b = a[a + b < k], b[a + b < k]
    small = [np.stack([_column(a, b, k), _column(a + 1, b, k), _column(a, b + 1, k)], axis=1)]
    a, b = a[a + b < k - 1], b[a + b < k - 1]
    small += [np.stack([_column(a + 1, b, k), _column(a + 1, b + 1, k), _column(a, b + 1, k)], axis=1)]
    divided = Mesh(
        np.concatenate([mesh.vertices, vertices]),
        np.concatenate([mesh.normals, normals]),
        nodes[:, np.concatenate(small)].reshape(-1, 3),
        uv=None if mesh.uv is None else np.concatenate([mesh.uv, np.einsum("nk,nki->ni", weights, mesh.uv[at])]),
        name=mesh.name,
    )
    return divided, nodes
