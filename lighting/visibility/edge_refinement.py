"""Further sites where a mesh is coarser than its visibility: in the middles of edges whose ends see much else.

What is linear between two vertices misses a shadow's edge that runs between them. How much the maps of bent distances
(`compression`) at both ends differ says where that may be; most meshes have no such edge. Sites in the middles are of
the same kind as those of vertices, and the triangles on both sides are cut there (`edge_bisection`). Triangles that
were cut since they are large (`refinement`) have none: where all edges are that short, middles were worth less than
they took.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from ..vectors import dot
from .compression import FEW_TERMS, MOST_TERMS, code_bytes
from .edge_bisection import Halving
from .occluders import Occluders
from .pieces import triangle_angles
from .refinement import Vertices
from .sites import Corners, Faces, Sites, sites_at
from .tracing import MAP

#: Least difference, root mean square, of the maps of bent distances at the ends of an edge whose middle becomes a site.
#: In a mesh of 3,000 vertices, coarse for its shapes, half of the vertices have such an edge; in finely divided ones
#: hardly any.
APART = 0.25
#: Most middles per vertex, and most bytes per vertex with them.
MOST_A_VERTEX, MOST_BYTES = 0.5, 98.0
# Bytes beside the codes: a vertex has its normal and two site numbers, a middle two vertices as well.
_VERTEX_BYTES, _MIDDLE_BYTES = 12, 20
# Edges per block: 50 MB of codes.
_BLOCK = 1 << 16


def most_terms(vertices: int, sites: int) -> int:
    """Limit the terms of codes by the number of sites."""
    return MOST_TERMS if vertices * (MOST_BYTES - _VERTEX_BYTES) >= sites * code_bytes(MOST_TERMS) else FEW_TERMS


def most_middles(refinement: Halving, codes: Float[np.ndarray, "S K"] | None = None, sheets: bool = False) -> int:
    """Limit the middles of a scene; sheets have two sites in each. codes : of all sites, once these are known."""
    vertices, whole = (len(np.unique(some)) for some in (refinement.pieces, refinement.pieces[refinement.whole]))
    most = int(MOST_A_VERTEX * whole)
    if codes is None:
        return most
    code = code_bytes(codes.shape[1])
    room = MOST_BYTES - _VERTEX_BYTES - code * len(codes) / vertices
    return min(most, int(vertices * max(room, 0.0) / (_MIDDLE_BYTES + code * (2 if sheets else 1))))


def far_apart(
    ends: Int[np.ndarray, "E 2"],
    facing: Float[np.ndarray, "V 3"],
    fronts: Int[np.ndarray, " V"],
    backs: Int[np.ndarray, " V"],
    codes: Float[np.ndarray, "S K"],
    most: int,
) -> Int[np.ndarray, "A 2"]:
    """Select the edges, by the vertices at their ends, that get a site in the middle; the `most` that differ most where
    there are too many.

    facing : normals of the vertices. codes : of all sites.
    """
    apart = np.empty(len(ends))
    for start in range(0, len(ends), _BLOCK):
        some = ends[start : start + _BLOCK]
        apart[start : start + _BLOCK] = np.maximum(_differ(codes, fronts[some]), _differ(codes, backs[some]))
    wanted = np.flatnonzero((apart > APART) & (dot(facing[ends[:, 0]], facing[ends[:, 1]]) > 0.0))
    return ends[np.sort(wanted[np.argsort(-apart[wanted], kind="stable")[:most]])]


def middle_sites(
    faces: Faces,
    refinement: Halving,
    vertices: Vertices,
    fronts: Int[np.ndarray, " V"],
    pairs: Int[np.ndarray, "A 2"],
    occluders: Occluders,
) -> tuple[Halving, Sites]:
    """Triangles cut in the middles of pairs of vertices, and the sites in those, numbered by themselves: found as those
    of vertices are, from the pieces around them.

    faces, occluders : of the scene, which has radius 1 about the origin. refinement, fronts : before these middles.
    vertices : with them.
    """
    finer, first = refinement.cut(fronts, pairs), len(fronts)
    mine = (finer.pieces >= first).any(axis=1)
    triangles, of = vertices.places[finer.pieces[mine]], finer.of[mine]
    around = Corners(
        triangles,
        finer.pieces[mine].ravel(),
        vertices.facing,
        triangle_angles(triangles).ravel(),
        faces.face_normals[of],
        faces.part[of],
        faces.solid[of],
    )
    all_sites = sites_at(around, occluders)
    front, back = all_sites.fronts[first:], all_sites.backs[first:]
    ours = np.unique(np.concatenate([front, back[back >= 0]]))
    numbers = np.searchsorted(ours, front), np.where(back >= 0, np.searchsorted(ours, back), -1)
    return finer, Sites(all_sites.starts[ours], all_sites.normals[ours], *numbers)


def _differ(codes: Float[np.ndarray, "S K"], sites: Int[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """Root mean square over the map; 0 where there is no site."""
    used, at = np.unique(np.maximum(sites.T, 0), return_inverse=True)
    one, other = codes[used].astype(np.float32)[at.reshape(2, -1)]
    return np.where((sites >= 0).all(axis=1), np.linalg.norm(one - other, axis=1) / MAP, 0.0)
