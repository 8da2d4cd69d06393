"""Shadows with sharp, true edges: rays to the light against the few triangles that lie in the way.

A shadow map answers with the nearest depth at fixed points, so its edges wander by a texel. Here the light's view is
divided into cells, a cell lists the triangles that reach into it, and a sample is tested against the list of its own
cell: exact where a shadow map is approximate, at about ten triangles a sample.

Two renderers of different precision must agree on every pixel, so nothing flips. Across an edge that two triangles
share the test is decided by one number that both compute alike, and either answer is shadow; across an outline, and
with growing distance from the surface, the answer changes on a ramp that is far below a pixel and far above float32's
rounding. The tests are those of `shadows.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from .raster import cut_triangles

# Width of the ramp across an outline, in radii of the scene.
OUTLINE_RAMP = 1e-4
# An occluder nearer than this to the surface casts no shadow on it; at twice the distance it casts a full one.
CONTACT = 2e-5
# Point lights see nothing nearer than this.
LEAST_DISTANCE = 1e-3
# Rays handled at once: their arrays stay in the second-level cache.
_BLOCK = 16384


@dataclass(frozen=True, eq=False)
class SortedTriangles:
    """Triangles whose corners are in the order of their welded numbers, so that a shared edge is the same to both.

    corners (F, 3, 3) rounded to float32; edges (F, 3, 2) : welded ends of the edges 01, 12 and 02; normals (F, 3) by
    the order of the corners, of any length.
    """

    corners: Float[np.ndarray, "F 3 3"]
    edges: Int[np.ndarray, "F 3 2"]
    normals: Float[np.ndarray, "F 3"]


@dataclass(frozen=True, eq=False)
class ShadowGrid:
    """Which triangles a light sees in each cell of its view.

    basis : (3, 3) rows u, v and depth of a directional light's view (coordinates within [-1, 1]); for a point light the
        view is a cube whose faces are +x, -x, +y, -y, +z, -z, with u and v the next two coordinates over the depth.
    resolution : cells along a side of a face.
    first : (faces * resolution^2 + 1,) where each cell's entries begin, row by row of v.
    entries : triangle << 4 | facing << 3 | outlines: whether its corners run anticlockwise as the light sees them, and
        which of its edges 01, 12 and 02 (bits 0, 1 and 2) are outlines.
    """

    basis: Float[np.ndarray, "3 3"]
    resolution: int
    first: Int[np.ndarray, "_"]
    entries: Int[np.ndarray, " E"]


def sorted_triangles(corners: Float[np.ndarray, "F 3 3"]) -> SortedTriangles:
    """Weld corners by position and sort each triangle's corners by their welded numbers."""
    unique, weld = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    numbers = np.sort(weld.reshape(-1, 3), axis=1)
    exact = unique[numbers]
    normals = np.cross(exact[:, 1] - exact[:, 0], exact[:, 2] - exact[:, 0])
    edges = np.stack([numbers[:, [0, 1]], numbers[:, [1, 2]], numbers[:, [0, 2]]], axis=1)
    return SortedTriangles(exact.astype(np.float32).astype(np.float64), edges, normals)


def shadow_grid(triangles: SortedTriangles, directional: bool, vector: Float[np.ndarray, "3"]) -> ShadowGrid:
    """Sort triangles into the cells of a light's view.

    `vector` is the unit direction to a directional light or the position of a point light.
    """
    to_light = np.broadcast_to(vector, triangles.normals.shape) if directional else vector - triangles.corners[:, 0]
    facing = np.sign(np.einsum("ni,ni->n", triangles.normals, to_light)).astype(np.int64)
    outlines = _outlines(triangles.edges, facing)
    usable = np.flatnonzero(facing != 0)
    resolution = int(np.clip(1.5 * np.sqrt(len(usable)), 4, 512))
    basis = _basis(vector) if directional else np.eye(3)
    cells, owners = [], []
    for face in range(1 if directional else 6):
        if directional:
            view = triangles.corners[usable] @ basis.T
            flat, owner = view[..., :2], usable
            margin = np.full(len(usable), OUTLINE_RAMP)
        else:
            view = _cube_view(triangles.corners[usable] - vector, face)
            flat, depth, owner = _before_the_face(view, usable)
            margin = OUTLINE_RAMP / depth
        cell, which = _cells(flat, margin + 1e-6, resolution)
        cells.append(cell + face * resolution**2)
        owners.append(owner[which])
    pairs = np.unique(np.concatenate(cells) * len(facing) + np.concatenate(owners))
    cell, owner = np.divmod(pairs, len(facing))
    faces = 1 if directional else 6
    first = np.searchsorted(cell, np.arange(faces * resolution**2 + 1))
    return ShadowGrid(basis, resolution, first, (owner << 4) | ((facing[owner] > 0) << 3) | outlines[owner])


def _outlines(edges: Int[np.ndarray, "F 3 2"], facing: Int[np.ndarray, " F"]) -> Int[np.ndarray, " F"]:
    """Bits of the edges that do not have exactly one triangle on either side, as the light sees them."""
    # An anticlockwise triangle lies left of its edges 01 and 12 and right of 02.
    side = (facing[:, None] * np.array([1, 1, -1])).reshape(-1)
    keys = edges[..., 0].reshape(-1) * (edges.max() + 1) + edges[..., 1].reshape(-1)
    _, edge = np.unique(keys, return_inverse=True)
    shared = (np.bincount(edge) == 2) & (np.bincount(edge, weights=side) == 0) & (np.bincount(edge, side**2) == 2)
    outline = ~shared[edge].reshape(-1, 3)
    return outline @ np.array([1, 2, 4])


def _basis(direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    across = across / np.linalg.norm(across)
    return np.stack([across, np.cross(direction, across), direction])


def _cube_view(offsets: Float[np.ndarray, "*n 3"], face: int) -> Float[np.ndarray, "*n 3"]:
    """u, v (times depth) and depth before a face of the cube."""
    axis, sign = face // 2, 1.0 - 2.0 * (face % 2)
    return np.stack([offsets[..., (axis + 1) % 3], offsets[..., (axis + 2) % 3], sign * offsets[..., axis]], axis=-1)


def _before_the_face(view, owner):
    """Triangles cut to a cube face's pyramid: (n, 3, 2) u and v, the least depth (n,), and whose they are."""
    near = LEAST_DISTANCE / np.sqrt(3.0)
    wide = 1.0 + OUTLINE_RAMP / near
    planes = (
        lambda p: p[..., 2] - near,
        lambda p: wide * p[..., 2] - p[..., 0],
        lambda p: wide * p[..., 2] + p[..., 0],
        lambda p: wide * p[..., 2] - p[..., 1],
        lambda p: wide * p[..., 2] + p[..., 1],
    )
    pieces, _, which = cut_triangles(view, planes)
    return pieces[..., :2] / pieces[..., 2:], pieces[..., 2].min(axis=1), owner[which]


def _cells(flat, margin, resolution):
    """Every (cell, triangle) pair where triangle `flat` (n, 3, 2), widened by `margin` (n,), meets the cell."""
    scale = 0.5 * resolution
    low = np.clip(np.floor((flat.min(axis=1) - margin[:, None] + 1.0) * scale), 0, resolution - 1).astype(np.int64)
    high = np.clip(np.floor((flat.max(axis=1) + margin[:, None] + 1.0) * scale), 0, resolution - 1).astype(np.int64)
    columns, rows = (high - low + 1).T
    counts = columns * rows
    which = np.repeat(np.arange(len(flat)), counts)
    within = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y = low[which, 0] + within % columns[which], low[which, 1] + within // columns[which]
    # A cell that lies wholly outside one edge does not meet the triangle.
    edges = flat[:, [1, 2, 0]] - flat
    (ax, ay), (bx, by) = edges[:, 0].T, edges[:, 1].T
    inward = np.stack([-edges[..., 1], edges[..., 0]], axis=-1) * np.sign(ax * by - ay * bx)[:, None, None]
    reach = np.abs(inward).sum(axis=-1) / resolution + np.linalg.norm(inward, axis=-1) * margin[:, None]
    start = np.einsum("nki,nki->nk", inward, flat)
    meets = np.ones(len(which), dtype=bool)
    u, v = (x + 0.5) / scale - 1.0, (y + 0.5) / scale - 1.0
    for k in range(3):
        along = inward[which, k, 0] * u + inward[which, k, 1] * v - start[which, k]
        meets &= along >= -reach[which, k]
    return (y * resolution + x)[meets], which[meets]


def visibility(
    triangles: SortedTriangles,
    grid: ShadowGrid,
    directional: bool,
    vector: Float[np.ndarray, "3"],
    points: Float[np.ndarray, "n 3"],
    own: Int[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Share of a light that reaches each point, 0 to 1; `own` is the triangle it lies on, which never shades it."""
    out = np.empty(len(points))
    for start in range(0, len(points), _BLOCK):
        rows = slice(start, start + _BLOCK)
        out[rows] = _visibility(triangles, grid, directional, vector, points[rows], own[rows])
    return out


def _visibility(triangles, grid, directional, vector, points, own):
    size = grid.resolution
    if directional:
        flat = points @ grid.basis[:2].T
        face, reach = np.zeros(len(points), dtype=np.int64), np.full(len(points), np.inf)
        to_light = np.broadcast_to(vector, points.shape)
    else:
        offset = points - vector
        axis = np.abs(offset).argmax(axis=1)
        row = np.arange(len(points))
        depth = offset[row, axis]
        flat = offset[row[:, None], (axis[:, None] + [1, 2]) % 3] / np.abs(depth)[:, None]
        face = 2 * axis + (depth < 0.0)
        reach = np.linalg.norm(offset, axis=1)
        to_light = -offset / reach[:, None]
    column, line = np.clip(np.floor((flat + 1.0) * (0.5 * size)), 0, size - 1).astype(np.int64).T
    cell = (face * size + line) * size + column
    entry, last = grid.first[cell], grid.first[cell + 1]
    visible = np.ones(len(points))
    active = np.flatnonzero(entry < last)
    while len(active):
        code = grid.entries[entry[active]]
        other = active[(code >> 4) != own[active]]
        code = code[(code >> 4) != own[active]]
        shade = _shade(triangles.corners[code >> 4], code, points[other], to_light[other], reach[other])
        visible[other] = np.minimum(visible[other], 1.0 - shade)
        entry[active] += 1
        active = active[(entry[active] < last[active]) & (visible[active] > 0.0)]
    return visible


def _shade(corners, code, points, to_light, reach):
    """How much of the ray from each point to the light one triangle each stops; `corners` (n, 3, 3)."""
    sign = np.where(code & 8, 1.0, -1.0)
    inside = np.ones(len(points), dtype=bool)
    cover = np.ones(len(points))
    weights = []
    # Corner opposite each edge, and the sense in which the edge runs about the triangle.
    for k, (a, b, sense) in enumerate(((0, 1, 1.0), (1, 2, 1.0), (0, 2, -1.0))):
        side = _cross(corners[:, b] - corners[:, a], points - corners[:, a])
        along = sense * sign * np.einsum("ni,ni->n", to_light, side)
        outline = (code >> k) & 1 == 1
        inside &= outline | (along >= 0.0)
        if outline.any():
            soft = np.flatnonzero(outline)
            length = np.linalg.norm(_cross(to_light[soft], (corners[:, b] - corners[:, a])[soft]), axis=1)
            ramp = np.clip(along[soft] / (np.maximum(length, 1e-12) * OUTLINE_RAMP) + 0.5, 0.0, 1.0)
            cover[soft] = np.minimum(cover[soft], ramp)
        weights.append(np.maximum(along, 0.0))
    cover = np.where(inside, cover, 0.0)
    total = np.maximum(weights[0] + weights[1] + weights[2], 1e-30)
    opposite = (weights[1], weights[2], weights[0])
    ahead = sum(w * np.einsum("ni,ni->n", corners[:, k] - points, to_light) for k, w in enumerate(opposite)) / total
    between = np.clip(ahead / CONTACT - 1.0, 0.0, 1.0)
    return np.where(ahead < reach, cover * between, 0.0)


def _cross(a, b):
    ax, ay, az = a.T
    bx, by, bz = b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
