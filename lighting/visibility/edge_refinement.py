"""Refinement of visibility at the midpoints of edges along which it changes much.

Linear interpolation between two vertices misses a shadow edge between them. The difference between the maps of
compressed distances (`compression`) at both ends detects such edges; most meshes have none. Sites at midpoints are like
those of vertices, and the triangles on both sides are bisected there (`edge_bisection`). Triangles that were cut for
their size (`refinement`) get no midpoints: with edges that short the gain was smaller than the cost.
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

#: Least root mean square difference of the maps of compressed distances at the ends of an edge that gets a midpoint. In
#: a mesh of 3,000 vertices, coarse for its shapes, half of the vertices have such an edge; in finely divided ones
#: hardly any.
APART = 0.25
#: Largest number of midpoints per vertex, and of bytes per vertex including them.
MOST_A_VERTEX, MOST_BYTES = 0.5, 98.0
# Bytes besides the codes: a normal and two site indices per vertex, and two vertices more per midpoint.
_VERTEX_BYTES, _MIDDLE_BYTES = 12, 20
# Edges per block: 50 MB of codes.
_BLOCK = 1 << 16


def most_terms(vertices: int, sites: int) -> int:
    """Return the largest number of terms of codes for a number of sites."""
    return MOST_TERMS if vertices * (MOST_BYTES - _VERTEX_BYTES) >= sites * code_bytes(MOST_TERMS) else FEW_TERMS


def most_middles(refinement: Halving, codes: Float[np.ndarray, "S K"] | None = None, sheets: bool = False) -> int:
    """Return the largest number of midpoints in a scene; on sheets each has two sites. codes : of all sites, once
    known.
    """
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
    """Select the edges, as pairs of vertices, that get a site at the midpoint: at most the `most` with the largest
    difference.

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
    """Bisect triangles at the midpoints of pairs of vertices, and find the sites there, numbered from 0, from the
    pieces around them as for vertices.

    faces, occluders : of the scene, of radius 1 about the origin. refinement, fronts : without these midpoints.
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
    """Compute the root mean square difference over the map; 0 without a site."""
    used, at = np.unique(np.maximum(sites.T, 0), return_inverse=True)
    one, other = codes[used].astype(np.float32)[at.reshape(2, -1)]
    return np.where((sites >= 0).all(axis=1), np.linalg.norm(one - other, axis=1) / MAP, 0.0)
