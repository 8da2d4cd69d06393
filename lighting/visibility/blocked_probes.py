"""Blocked sites: covered by another part, or inside of one.

They are never seen themselves, but their codes are interpolated with those beside them: the floor along a wall would be
as dark as the floor below it. They take over the visibility of open neighbours.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from ..vectors import dot
from .occluders import Occluders
from .sites import Sites

# Rays of the test, of which most sites need few; the largest share of uniform light that reaches a blocked site; and
# the distance at which a hit counts as contact, in radii of the scene.
_RAYS, _REACHES, _AT_ONCE = 32, 0.1, 0.003
# Sites per block: some 50 MB of rays.
_BLOCK = 1 << 15


def shut_sites(
    where: Sites,
    occluders: Occluders,
    face_normals: Float[np.ndarray, "F 3"],
    solid: Bool[np.ndarray, " F"],
) -> Bool[np.ndarray, " S"]:
    """Find sites from which nearly all rays hit the inner side of a solid, or anything in contact.

    face_normals, solid : normals of the triangles of `occluders`, and whether each belongs to a closed body.
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
    """Return the end points of the edges of triangles; an edge shared by two triangles appears twice."""
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])


def beside_shut(
    values: Float[np.ndarray, "S *K"], shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]
) -> Float[np.ndarray, "S *K"]:
    """Replace values at blocked sites by the mean of their open neighbours, so that triangles between the two are not
    half dark; a blocked site without open neighbours keeps its value.

    ends : see `edges`, as site indices; -1 for none.
    """
    both = _from_shut_to_open(shut, ends)
    sites, place, count = np.unique(both[:, 0], return_inverse=True, return_counts=True)
    total = np.zeros((len(sites), *values.shape[1:]), dtype=np.float64)
    np.add.at(total, place, values[both[:, 1]])
    found = values.copy()
    found[sites] = total / count.reshape(-1, *[1] * (values.ndim - 1))
    return found


def rim_of_shut(shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, " r"]:
    """Return the blocked sites with open neighbours, ascending; `ends` as in `beside_shut`."""
    return np.unique(_from_shut_to_open(shut, ends)[:, 0])


def _from_shut_to_open(shut: Bool[np.ndarray, " S"], ends: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, "m 2"]:
    """Return the edges between blocked and open sites, each once, the blocked end first."""
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
    """Return the absolute cosine of a direction, reversed where it points below the horizon; 0 where its ray hits the
    inner side of a solid or anything in contact.
    """
    cosine = normals @ way
    to = np.where((cosine < 0.0)[:, None], -way, way)
    triangle, far = occluders.met(starts, to)
    dark = solid[triangle] & (dot(to, face_normals[triangle]) > 0.0)
    return np.where((triangle >= 0) & (dark | (far < _AT_ONCE)), 0.0, np.abs(cosine))


def _spiral(count: int) -> Float[np.ndarray, "count 3"]:
    """Return unit directions distributed evenly over the sphere, no two of them opposite."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    # Ordered so that any few consecutive directions cover the sphere.
    order = np.argsort((np.arange(count) * 0.618033988749895) % 1.0)
    turn = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(turn), height, across * np.sin(turn)], axis=1)[order]
