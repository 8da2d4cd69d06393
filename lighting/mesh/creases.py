"""Vertex normals for meshes without, and groups of triangle corners that share one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float, Int

from ..vectors import Number, dot, unit, welded


def creased_normals(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"], crease_deg: Number = 40.0
) -> tuple[Int[np.ndarray, "C"], Float[np.ndarray, "C 3"], Int[np.ndarray, "F 3"]]:
    """Compute vertex normals, smooth across blunt edges and split along sharp ones.

    Corners at the same position are joined across every edge whose two triangles differ by less than `crease_deg`; each
    group has one normal: the mean of its triangles' normals weighted by their angles at the corner, which does not
    depend on the triangulation of flat polygons (Thuermer and Wuethrich 1998).

    Returns `source` (C,), the old vertex of each new one, the normals (C, 3), and the faces (F, 3) as new indices.
    """
    joined = welded(vertices)[1][faces]
    points = vertices[faces]
    normals = unit(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]))

    limit = np.cos(np.deg2rad(crease_deg))
    groups, label = corner_groups(joined, lambda one, other: dot(normals[one], normals[other]) > limit)
    count = len(faces)
    corner = np.arange(3 * count).reshape(count, 3)

    total = np.zeros((groups, 3))
    for k in range(3):
        to_next = points[:, (k + 1) % 3] - points[:, k]
        to_last = points[:, (k + 2) % 3] - points[:, k]
        angle = np.arctan2(np.linalg.norm(np.cross(to_next, to_last), axis=1), dot(to_next, to_last))
        np.add.at(total, label[corner[:, k]], angle[:, None] * normals)
    # Groups whose normals cancel (a fold closed on itself) fall back to one of their triangles.
    lost = np.linalg.norm(total, axis=1) < 1e-12
    if lost.any():
        one = np.zeros((groups, 3))
        one[label] = np.repeat(normals, 3, axis=0)
        total[lost] = one[lost]
    # Old vertices stay distinct, so that uv seams are preserved.
    pairs, number = np.unique(label * len(vertices) + faces.reshape(-1), return_inverse=True)
    return pairs % len(vertices), unit(total)[pairs // len(vertices)], number.reshape(count, 3).astype(np.int64)


def corner_groups(
    joined: Int[np.ndarray, "F 3"],
    joins: Callable[[Int[np.ndarray, " E"], Int[np.ndarray, " E"]], Bool[np.ndarray, " E"]],
) -> tuple[int, Int[np.ndarray, "C"]]:
    """Group the 3 F corners of triangles: return the number of groups, and the group of each corner, row by row.

    Corners at one vertex (indices in `joined`) are in a group if their triangles share an edge, directly or through
    others; `joins` selects the pairs of adjacent triangles that count.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(joined)
    corner = np.arange(3 * count).reshape(count, 3)
    start = np.concatenate([joined[:, 0], joined[:, 1], joined[:, 2]])
    stop = np.concatenate([joined[:, 1], joined[:, 2], joined[:, 0]])
    corner_start = np.concatenate([corner[:, 0], corner[:, 1], corner[:, 2]])
    corner_stop = np.concatenate([corner[:, 1], corner[:, 2], corner[:, 0]])
    turned = start > stop
    low, high = np.where(turned, stop, start), np.where(turned, start, stop)
    corner_low = np.where(turned, corner_stop, corner_start)
    corner_high = np.where(turned, corner_start, corner_stop)
    edge = low * (int(joined.max()) + 1) + high
    order = np.argsort(edge, kind="stable")
    same = edge[order][1:] == edge[order][:-1]
    first, second = order[:-1][same], order[1:][same]
    kept = joins(first % count, second % count)
    first, second = first[kept], second[kept]
    ends = np.concatenate([[corner_low[first], corner_low[second]], [corner_high[first], corner_high[second]]], axis=1)
    links = coo_matrix((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(3 * count, 3 * count))
    groups, label = connected_components(links, directed=False)
    # scipy's labels have 32 bits, too few for products of indices above some 46,000 vertices.
    return groups, label.astype(np.int64)
