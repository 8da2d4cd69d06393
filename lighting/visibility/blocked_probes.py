"""Sites that are shut: another part stands on them, or they are inside of one.

What they see is seen from nowhere, but is mixed into what is seen beside them: the floor along a wall would be as dark
as the floor below it. They take what open sites next to them see.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from ..vectors import dot
from .occluders import Occluders
from .sites import Sites

# Rays of the test, of which most sites need few; the largest share of even light that reaches a shut site; and the
# distance within which a ray ends at once, in radii of the scene.
_RAYS, _REACHES, _AT_ONCE = 32, 0.1, 0.003
# Sites per block: some 50 MB of rays.
_BLOCK = 1 << 15


def shut_sites(
    where: Sites,
    occluders: Occluders,
    face_normals: Float[np.ndarray, "F 3"],
    solid: Bool[np.ndarray, " F"],
) -> Bool[np.ndarray, " S"]:
    """Find sites whose rays nearly all end on the inner side of a solid, or at once.

    face_normals, solid : of the triangles of `occluders`; whether they are of closed bodies.
    """
    found = np.zeros(len(where), dtype=bool)
    to = _spiral(_RAYS)
    for start in range(0, len(where), _BLOCK):
        some = np.arange(start, min(start + _BLOCK, len(where)))
        reached = np.zeros(len(some))
        for way in to:
            reached += _reached(where.starts[some], where.normals[some], way, occluders, face_normals, solid)
            # The mean cosine of directions above a surface is a half.
            left = reached <= _REACHES * 0.5 * _RAYS
            some, reached = some[left], reached[left]
            if not len(some):
                break
        found[some] = True
    return found


def edges(corners: Int[np.ndarray, "F 3"]) -> Int[np.ndarray, "n 2"]:
    """Return the ends of the edges of triangles, an edge of two triangles twice."""
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])


def beside_shut(
    values: Float[np.ndarray, "S *K"], shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]
) -> Float[np.ndarray, "S *K"]:
    """Return the same, with means of their open neighbours at sites that are shut; where they have none, as it is: what
    lies between a shut site and others is seen, and is not half dark.

    ends : see `edges`, by site; -1 where there is none.
    """
    both = _from_shut_to_open(shut, ends)
    sites, place, count = np.unique(both[:, 0], return_inverse=True, return_counts=True)
    total = np.zeros((len(sites), *values.shape[1:]), dtype=np.float64)
    np.add.at(total, place, values[both[:, 1]])
    found = values.copy()
    found[sites] = total / count.reshape(-1, *[1] * (values.ndim - 1))
    return found


def rim_of_shut(shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, " r"]:
    """Sites that are shut and stand beside open ones, ascending; `ends` as of `beside_shut`."""
    return np.unique(_from_shut_to_open(shut, ends)[:, 0])


def _from_shut_to_open(shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, "m 2"]:
    """Edges between the two, each once, the shut end first."""
    both = np.concatenate([ends, ends[:, ::-1]])
    both = both[(both >= 0).all(axis=1)]
    return np.unique(both[shut[both[:, 0]] & ~shut[both[:, 1]]], axis=0)


def _reached(
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    way: Float[np.ndarray, "3"],
    occluders: Occluders,
    face_normals: Float[np.ndarray, "F 3"],
    solid: Bool[np.ndarray, " F"],
) -> Float[np.ndarray, " n"]:
    """Return the cosine of a direction, turned round where it looks below the horizon; nought where its ray ends so."""
    cosine = normals @ way
    to = np.where((cosine < 0.0)[:, None], -way, way)
    triangle, far = occluders.met(starts, to)
    dark = solid[triangle] & (dot(to, face_normals[triangle]) > 0.0)
    return np.where((triangle >= 0) & (dark | (far < _AT_ONCE)), 0.0, np.abs(cosine))


def _spiral(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit directions, evenly over the sphere, no two opposite ones."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    # Far apart from first to last: any few of them go all round.
    order = np.argsort((np.arange(count) * 0.618033988749895) % 1.0)
    turn = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(turn), height, across * np.sin(turn)], axis=1)[order]
