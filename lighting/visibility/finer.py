"""Further sites where a mesh is coarser than its visibility: in the middles of edges whose ends see much else.

What is linear between two vertices misses a shadow's edge that runs between them. How much the maps of bent distances
(`compression`) at both ends differ says where that may be; most meshes have no such edge. Sites in the middles are of
the same kind as those of vertices, and the triangles on both sides are cut there (`halving`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..scene import Scene
from ..vectors import dot, unit
from .compression import BYTES
from .occluders import Occluders
from .pieces import Pieces, angles
from .refinement import Refinement
from .sites import Corners, Sites, corners_of, sites_at
from .tracing import MAP

#: Root mean square by which maps of bent distances at both ends of an edge differ at least where its middle is a site.
#: Of a mesh of 3,000 vertices that is coarse for its shapes half of the vertices have such an edge, of finely
#: divided ones hardly any.
APART = 0.25
#: Middles there are at most for each vertex, and bytes that a vertex may come to with them.
MOST_A_VERTEX, MOST_BYTES = 0.5, 98.0
# Bytes beside the codes: of a vertex its normal and two numbers of sites, of a middle two vertices as well.
_VERTEX_BYTES, _MIDDLE_BYTES = 12, 20
# Edges at once: 50 MB of codes.
_BLOCK = 1 << 16


class Finer(NamedTuple):
    """Of A middles: their sites, numbered by themselves, their normals (A, 3), and the triangles as they are cut."""

    sites: Sites
    facing: Float[np.ndarray, "A 3"]
    refinement: Refinement


def most_middles(refinement: Refinement) -> int:
    """How many there may be in a scene."""
    return int(MOST_A_VERTEX * len(np.unique(refinement.corners[refinement.undivided])))


def far_apart(
    refinement: Refinement,
    facing: Float[np.ndarray, "V 3"],
    fronts: Int[np.ndarray, " V"],
    backs: Int[np.ndarray, " V"],
    codes: Float[np.ndarray, "S K"],
) -> Int[np.ndarray, "A 2"]:
    """The vertices at the ends of edges that get a site in the middle; those that differ most where there are too many.

    facing : normals of the vertices. codes : of all sites.
    """
    corners = refinement.corners[refinement.undivided]
    ends = np.concatenate([corners[:, [1, 2]], corners[:, [2, 0]], corners[:, [0, 1]]])
    between = np.sort(fronts[ends], axis=1)
    # Edges of the same two sites are one, as along a seam.
    ends = ends[np.unique(between[:, 0] * len(codes) + between[:, 1], return_index=True)[1]]
    apart = np.empty(len(ends))
    for start in range(0, len(ends), _BLOCK):
        some = ends[start : start + _BLOCK]
        apart[start : start + _BLOCK] = np.maximum(_differ(codes, fronts[some]), _differ(codes, backs[some]))
    wanted = np.flatnonzero((apart > APART) & (dot(facing[ends[:, 0]], facing[ends[:, 1]]) > 0.0))
    vertices, terms = len(fronts), codes.shape[1]
    code = min(terms, BYTES) + max(terms - BYTES, 0) // 2
    room = MOST_BYTES - _VERTEX_BYTES - code * len(codes) / vertices
    sides = 2 if (backs[ends] >= 0).any() else 1
    most = min(most_middles(refinement), int(vertices * max(room, 0.0) / (_MIDDLE_BYTES + code * sides)))
    return ends[np.sort(wanted[np.argsort(-apart[wanted], kind="stable")[:most]])]


def middle_sites(
    scene: Scene,
    found: tuple[Pieces, ...],
    refinement: Refinement,
    fronts: Int[np.ndarray, " V"],
    pairs: Int[np.ndarray, "A 2"],
    occluders: Occluders,
) -> Finer:
    """The sites in the middles of pairs of vertices, found as those of vertices are, from the pieces around them.

    found, occluders : of the scene, which has radius 1 in the coordinates of `occluders`.
    """
    whole = corners_of(scene, found)
    finer, pieces, of = refinement.cut(fronts, pairs)
    places, normals = np.zeros((len(fronts) + len(pairs), 3)), np.zeros((len(fronts) + len(pairs), 3))
    places[whole.vertex], normals[: len(whole.normals)] = whole.triangles.reshape(-1, 3), whole.normals
    places[len(fronts) :] = places[pairs].mean(axis=1)
    normals[len(fronts) :] = unit(normals[pairs].sum(axis=1))
    triangles = places[pieces]
    around = Corners(
        triangles,
        pieces.ravel(),
        normals,
        angles(triangles).ravel(),
        whole.face_normals[of],
        whole.part[of],
        whole.solid[of],
    )
    all_sites = sites_at(around, occluders)
    front, back = all_sites.fronts[len(fronts) :], all_sites.backs[len(fronts) :]
    ours = np.unique(np.concatenate([front, back[back >= 0]]))
    numbers = np.searchsorted(ours, front), np.where(back >= 0, np.searchsorted(ours, back), -1)
    return Finer(Sites(all_sites.starts[ours], all_sites.normals[ours], *numbers), normals[len(fronts) :], finer)


def _differ(codes: Float[np.ndarray, "S K"], sites: Int[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """Root mean square over the map; 0 where there is no site."""
    one, other = codes[np.maximum(sites.T, 0)].astype(np.float32)
    return np.where((sites >= 0).all(axis=1), np.linalg.norm(one - other, axis=1) / MAP, 0.0)
