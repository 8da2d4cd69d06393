"""Sites of visibility: vertices distinct in position or normal, and the origins of their rays.

Vertices that agree in part, position and normal, as along a seam of uv, share a site; an unused vertex has none. Rays
start `OFFSET` off the vertex along its normal, with two exceptions, since a vertex may touch other geometry where the
surface beside it does not:

- If the triangles at a site do not surround it (the rim of a sheet, one side of a crease), the start moves inwards by
  `_INWARDS` of the way to the centre of those triangles. So the foot of a wall has the wall's visibility.
- If geometry separates the start from most of the triangles around it (a body that touches a floor at that vertex), the
  start moves onto the widest of those triangles.

A sheet may be seen from both sides, so its vertices have two sites, one on each. The back of a solid is its inside,
which is dark and has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ..scene import Scene
from ..vectors import dot, unit, welded
from .half_space import Before
from .occluders import OFFSET, Occluders
from .pieces import Pieces, corner_angles, pieces

# Inward shift of a start, as a share of the way to the mean centre of its triangles; and of a triangle's probe, of the
# way from the vertex to its centre.
_INWARDS, _BESIDE = 0.03, 0.05


@dataclass(frozen=True, eq=False)
class Sites:
    """The S sites of a scene, scaled to radius 1 about the origin.

    starts (S, 3) : ray origins. normals (S, 3) : unit, on the side of the rays.
    fronts (V,), backs (V,) : the sites of each vertex of all parts, one after the other, on the side of its normal and
        on the other; -1 for none.
    """

    starts: Float[np.ndarray, "S 3"]
    normals: Float[np.ndarray, "S 3"]
    fronts: Int[np.ndarray, " V"]
    backs: Int[np.ndarray, " V"]

    def __len__(self) -> int:
        return len(self.starts)

    def ordered(self, order: Int[np.ndarray, " S"]) -> Sites:
        """Return the sites renumbered: the first is the former `order[0]`."""
        number = np.append(np.argsort(order), -1)
        return Sites(self.starts[order], self.normals[order], number[self.fronts], number[self.backs])


@dataclass(frozen=True, eq=False)
class Corners:
    """Input for finding sites: F triangles, scaled as `Sites`, with attributes of their corners.

    vertex, angles (3F,) : of corners, triangle by triangle. normals (V, 3) : of vertices. face_normals (F, 3), part,
    solid (F,) : of triangles.
    """

    triangles: Float[np.ndarray, "F 3 3"]
    vertex: Int[np.ndarray, " corners"]
    normals: Float[np.ndarray, "V 3"]
    angles: Float[np.ndarray, " corners"]
    face_normals: Float[np.ndarray, "F 3"]
    part: Int[np.ndarray, " F"]
    solid: Bool[np.ndarray, " F"]


@dataclass(frozen=True, eq=False)
class Faces:
    """Attributes of triangles that cutting preserves: see `Corners`."""

    face_normals: Float[np.ndarray, "F 3"]
    part: Int[np.ndarray, " F"]
    solid: Bool[np.ndarray, " F"]

    def corners(self, scene: Scene) -> Corners:
        """Return the corners of the scene with these faces."""
        return Corners(
            scaled_triangles(scene),
            numbered_faces(scene).ravel(),
            np.concatenate([each.mesh.normals for each in scene.parts]),
            np.concatenate([corner_angles(each.mesh) for each in scene.parts]).ravel(),
            self.face_normals,
            self.part,
            self.solid,
        )

    def cut(self, fine: Scene, of: Int[np.ndarray, " T"]) -> Corners:
        """Return the corners of the subdivided scene; piece t inherits the attributes of triangle `of[t]`."""
        return Faces(self.face_normals[of], self.part[of], self.solid[of]).corners(fine)


def scaled_triangles(scene: Scene, before: Before | None = None) -> Float[np.ndarray, "F 3 3"]:
    """Return all triangles of a scene, clipped to `before` if given, translated and scaled so that the scene has radius
    1 about the origin.
    """
    low, high = scene.bounds
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in scene.parts])
    return ((corners if before is None else before.cut(corners)) - centre) / radius


def nothing_hides(found: tuple[Pieces, ...]) -> bool:
    """Return whether a scene of these pieces is a single convex solid, without any occlusion."""
    return len(found) == 1 and len(found[0].convex) == 1 and bool(found[0].convex[0])


def pieces_of(scene: Scene) -> tuple[Pieces, ...]:
    """Find the pieces of each part."""
    return tuple(pieces(part.mesh) for part in scene.parts)


def sites(scene: Scene, found: tuple[Pieces, ...], occluders: Occluders) -> Sites:
    """Find the sites of a scene, given its pieces and occluders."""
    return sites_at(faces_of(scene, found).corners(scene), occluders)


def numbered_faces(scene: Scene) -> Int[np.ndarray, "F 3"]:
    """Return the vertices of all triangles, numbered over all parts."""
    offsets = np.cumsum([0, *(len(part.mesh.vertices) for part in scene.parts[:-1])])
    return np.concatenate([part.mesh.faces + at for part, at in zip(scene.parts, offsets, strict=True)])


def part_of_face(scene: Scene) -> Int[np.ndarray, " F"]:
    """Return the part of each triangle."""
    return np.repeat(np.arange(len(scene.parts)), [len(part.mesh.faces) for part in scene.parts])


def faces_of(scene: Scene, found: tuple[Pieces, ...]) -> Faces:
    """Return the faces of a scene of these pieces."""
    normals = np.concatenate([part.mesh.face_normals for part in scene.parts])
    return Faces(normals, part_of_face(scene), np.concatenate([each.solid[each.of_face] for each in found]))


def sites_at(corners: Corners, occluders: Occluders) -> Sites:
    """Return the sites of these corners."""
    triangles, vertex, angles, face_normals = corners.triangles, corners.vertex, corners.angles, corners.face_normals
    places = triangles.reshape(-1, 3)
    # One row per vertex, or two if it belongs to a sheet and a solid; sheets sort before solids.
    both = 2 * vertex + np.repeat(corners.solid, 3)
    a_corner = np.full(2 * len(corners.normals), -1)
    a_corner[both] = np.arange(len(both))
    there = a_corner >= 0
    row, a_corner = np.cumsum(there)[both] - 1, a_corner[there]
    solid, vertex = corners.solid[a_corner // 3], vertex[a_corner]
    rows = np.column_stack([solid, corners.part[a_corner // 3], places[a_corner], corners.normals[vertex]])
    kinds, kind = welded(rows.astype(np.float64))
    site = kind[row]
    fronts = np.full(len(corners.normals), -1, dtype=np.int64)
    # A vertex shared by a sheet and a solid counts as the sheet's, which has both sides.
    for some in (solid, ~solid):
        fronts[vertex[some]] = kind[some]
    sheets = int((kinds[:, 0] == 0.0).sum())
    place, normal = kinds[:, 2:5], kinds[:, 5:8]

    middle = np.repeat(triangles.mean(axis=1), 3, axis=0)
    inwards = _INWARDS * _weighted_mean(site, angles, middle - places, len(kinds))
    inwards[~_open(site, welded(place)[1][site].reshape(-1, 3), len(kinds))] = 0.0

    def side(sign: float, count: int) -> Float[np.ndarray, "n 3"]:
        """Return the ray origins of the first sites on one side."""
        ours = site < count
        normals = sign * normal[:count]
        # Shift along the surface or out of it, never into it.
        along = inwards[:count] - np.minimum(dot(inwards[:count], normals), 0.0)[:, None] * normals
        starts = place[:count] + along + OFFSET * normals
        beside = places + _BESIDE * (middle - places) + sign * OFFSET * np.repeat(face_normals, 3, axis=0)
        return _out_of_contact(starts, site[ours], beside[ours], angles[ours], occluders)

    return Sites(
        np.concatenate([side(1.0, len(kinds)), side(-1.0, sheets)]),
        np.concatenate([normal, -normal[:sheets]]),
        fronts,
        np.where((fronts >= 0) & (fronts < sheets), fronts + len(kinds), -1),
    )


def _open(site: Int[np.ndarray, " corners"], number: Int[np.ndarray, "F 3"], count: int) -> np.ndarray:
    """Return a mask (S,) of sites that triangles do not surround: some spoke has only one triangle."""
    following, last = number[:, [1, 2, 0]].ravel(), number[:, [2, 0, 1]].ravel()
    far = int(number.max()) + 1
    # Both directions around the site, distinguished by the last bit.
    spokes = np.sort(np.concatenate([2 * (site * far + following), 2 * (site * far + last) + 1]))
    first = np.flatnonzero(np.append(True, spokes[1:] >> 1 != spokes[:-1] >> 1))
    lonely = (spokes[first] >> 1)[np.add.reduceat(1 - 2 * (spokes & 1), first) != 0] // far
    found = np.zeros(count, dtype=bool)
    found[lonely] = True
    return found


def _weighted_mean(
    site: Int[np.ndarray, " corners"],
    weights: Float[np.ndarray, " corners"],
    values: Float[np.ndarray, "corners 3"],
    count: int,
) -> Float[np.ndarray, "S 3"]:
    total = np.bincount(site, weights=weights, minlength=count)
    sums = np.stack([np.bincount(site, weights=weights * values[:, k], minlength=count) for k in range(3)], axis=1)
    # Corners whose angle rounds to 0 have no weight.
    return sums / np.where(total > 0.0, total, 1.0)[:, None]


def _out_of_contact(
    starts: Float[np.ndarray, "S 3"],
    site: Int[np.ndarray, " corners"],
    beside: Float[np.ndarray, "corners 3"],
    angles: Float[np.ndarray, " corners"],
    occluders: Occluders,
) -> Float[np.ndarray, "S 3"]:
    """Return the starts, with those separated from most of their triangles (by angle) moved onto the widest of
    these.
    """
    way = beside - starts[site]
    length = np.linalg.norm(way, axis=1)
    hidden = ~occluders.free(starts[site], unit(way), length)
    share = np.bincount(site, weights=angles * hidden, minlength=len(starts))
    parted = share > 0.5 * np.bincount(site, weights=angles, minlength=len(starts))
    chosen = np.flatnonzero(hidden & parted[site])
    # The widest comes last and overwrites the others.
    chosen = chosen[np.lexsort((chosen, angles[chosen]))]
    found = starts.copy()
    found[site[chosen]] = beside[chosen]
    return found
