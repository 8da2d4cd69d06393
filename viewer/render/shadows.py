"""Exact shadows: shadow rays against the few triangles in a cell of the light's view.

A shadow map stores the nearest depth at fixed points, so that its edges are off by up to a texel. Here each cell of the
light's view lists the triangles that overlap it, nearest to the light first, and a sample is tested exactly against
those of its own cell that begin before it.

Two renderers of different precision must agree on every pixel, so tests are continuous. At an edge shared by two
triangles both compute the same number, and either result is shadow; across an outline, and with the distance from the
surface, the result changes on a ramp far below a pixel and far above float32's rounding. The twin is `shadows.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ...lighting.vectors import welded
from .raster import cut_triangles

# Width of the ramp across an outline, in radii of the scene.
OUTLINE_RAMP = 1e-4
# Distance along the ray below which an occluder casts no shadow; at twice the distance it casts a full one. At grazing
# incidence it grows by `ROUNDING` over the cosine, the float32 error of a neighbour's height.
CONTACT = 2e-5
ROUNDING = 1e-6
# Near plane of point lights.
LEAST_DISTANCE = 1e-3
# Distance of a point light, in radii of the scene, beyond which float32 is too coarse for `CONTACT` and the scene too
# small for the cells of a cube: see `ShadowGrid.parallel`.
FAR = 20.0
# Rays per block, sized for the second-level cache.
_BLOCK = 16384


@dataclass(frozen=True, eq=False)
class SortedTriangles:
    """Triangles with corners sorted by welded vertex index, so that both triangles of an edge evaluate it identically.

    corners (F, 3, 3) rounded to float32; edges (F, 3, 2) : welded ends of the edges 01, 12 and 02; normals (F, 3) by
    the order of the corners, of any length.
    """

    corners: Float[np.ndarray, "F 3 3"]
    edges: Int[np.ndarray, "F 3 2"]
    normals: Float[np.ndarray, "F 3"]


@dataclass(frozen=True, eq=False)
class ShadowGrid:
    """Grid over a light's view with the triangles in each cell.

    parallel : whether the light's rays are parallel in its view: for directional lights, and for point lights beyond
        `FAR`, whose rays a projective map about the scene's centre makes parallel.
    basis : (3, 3) rows u, v and w, the last towards a light with a parallel view, which is the square u, v in [-1, 1].
        Else it is the identity, and the view is a cube with faces +x, -x, +y, -y, +z, -z, on each of which u
        and v are the next two coordinates over the depth.
    origin : (3,) of view coordinates `(p - origin) @ basis.T`: zero, or the point light.
    convergence : 1 / distance of a far point light, else 0; view coordinates are divided by 1 - convergence w.
    corners : (F, 3, 3) of the sorted triangles in view coordinates, rounded to float32.
    resolution : cells along a side of a face.
    first : (faces * resolution^2 + 1,) offset of each cell's entries, by rows of v.
    entries : (E,) triangle << 4 | facing << 3 | outlines: whether its corners are anticlockwise seen from the light,
        and bits 0, 1 and 2 for edges 01, 12 and 02 that are outlines.
    starts : (E,) least distance of each entry's triangle from the light: -w, or the depth along the cube's face.
    """

    parallel: bool
    basis: Float[np.ndarray, "3 3"]
    origin: Float[np.ndarray, "3"]
    convergence: float
    corners: Float[np.ndarray, "F 3 3"]
    resolution: int
    first: Int[np.ndarray, "_"]
    entries: Int[np.ndarray, " E"]
    starts: Float[np.ndarray, " E"]

    def view(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Transform points of the scene to view coordinates."""
        turned = (points - self.origin) @ self.basis.T
        return turned / (1.0 - self.convergence * turned[..., 2:]) if self.convergence else turned


def sorted_triangles(corners: Float[np.ndarray, "F 3 3"]) -> SortedTriangles:
    """Weld corners by position and sort each triangle's corners by their welded numbers."""
    unique, weld = welded(corners.reshape(-1, 3))
    numbers = np.sort(weld.reshape(-1, 3), axis=1)
    exact = unique[numbers]
    normals = np.cross(exact[:, 1] - exact[:, 0], exact[:, 2] - exact[:, 0])
    edges = np.stack([numbers[:, [0, 1]], numbers[:, [1, 2]], numbers[:, [0, 2]]], axis=1)
    return SortedTriangles(exact.astype(np.float32).astype(np.float64), edges, normals)


def shadow_grid(triangles: SortedTriangles, vector: Float[np.ndarray, "4"]) -> ShadowGrid:
    """Sort triangles into the cells of a light's view.

    `vector` is homogeneous: (direction to it, 0) of a directional light, (position, 1) of a point light.
    """
    ahead, near = vector[:3], float(vector[3])
    to_light = ahead - near * triangles.corners[:, 0]
    facing = np.sign(np.einsum("ni,ni->n", triangles.normals, to_light)).astype(np.int64)
    outlines = _outlines(triangles.edges, facing)
    usable = np.flatnonzero(facing != 0)
    resolution = int(np.clip(1.5 * np.sqrt(len(usable)), 4, 512))
    length = float(np.linalg.norm(ahead))
    parallel = length > FAR * near
    basis, origin = (_basis(ahead / length), np.zeros(3)) if parallel else (np.eye(3), ahead)
    grid = ShadowGrid(
        parallel=parallel,
        basis=basis,
        origin=origin,
        convergence=near / length if parallel else 0.0,
        corners=np.empty((0, 3, 3)),
        resolution=resolution,
        first=np.empty(0, dtype=np.int64),
        entries=np.empty(0, dtype=np.int64),
        starts=np.empty(0),
    )
    view = grid.view(triangles.corners)
    found = []
    for face in range(1 if parallel else 6):
        if parallel:
            flat, start, owner = view[usable][..., :2], -view[usable][..., 2].max(axis=1), usable
            margin = np.full(len(usable), OUTLINE_RAMP)
        else:
            flat, start, owner = _before_the_face(_cube_view(view[usable], face), usable)
            margin = OUTLINE_RAMP / start
        cell, which = _cells(flat, margin + 1e-6, resolution)
        found.append((cell + face * resolution**2, start[which], owner[which]))
    cell, start, owner = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort((start, cell))
    cell, start, owner = cell[order], start[order], owner[order]
    return replace(
        grid,
        corners=view.astype(np.float32).astype(np.float64),
        first=np.searchsorted(cell, np.arange(len(found) * resolution**2 + 1)),
        entries=(owner << 4) | ((facing[owner] > 0) << 3) | outlines[owner],
        starts=start.astype(np.float32).astype(np.float64),
    )


def _outlines(edges: Int[np.ndarray, "F 3 2"], facing: Int[np.ndarray, " F"]) -> Int[np.ndarray, " F"]:
    """Return bits of the edges without exactly one triangle on either side, seen from the light."""
    # An anticlockwise triangle is left of its edges 01 and 12 and right of 02.
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
    """Return u, v (times depth) and depth along a face of the cube."""
    axis, sign = face // 2, 1.0 - 2.0 * (face % 2)
    return np.stack([offsets[..., (axis + 1) % 3], offsets[..., (axis + 2) % 3], sign * offsets[..., axis]], axis=-1)


def _before_the_face(view, owner):
    """Clip triangles to a cube face's pyramid: return u and v (n, 3, 2), the least depth (n,), and the original
    triangles.
    """
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
    """Return all (cell, triangle) pairs where triangle `flat` (n, 3, 2), widened by `margin` (n,), overlaps the
    cell.
    """
    scale = 0.5 * resolution
    low = np.clip(np.floor((flat.min(axis=1) - margin[:, None] + 1.0) * scale), 0, resolution - 1).astype(np.int64)
    high = np.clip(np.floor((flat.max(axis=1) + margin[:, None] + 1.0) * scale), 0, resolution - 1).astype(np.int64)
    columns, rows = (high - low + 1).T
    counts = columns * rows
    which = np.repeat(np.arange(len(flat)), counts)
    within = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y = low[which, 0] + within % columns[which], low[which, 1] + within // columns[which]
    # A cell entirely outside one edge does not overlap the triangle.
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
    grid: ShadowGrid, points: Float[np.ndarray, "n 3"], own: Int[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the share of a light that reaches each point, 0 to 1; `own` is the point's triangle, which never occludes
    it, or -1 for a point in space.
    """
    normals = np.cross(grid.corners[:, 1] - grid.corners[:, 0], grid.corners[:, 2] - grid.corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    out = np.empty(len(points))
    for start in range(0, len(points), _BLOCK):
        rows = slice(start, start + _BLOCK)
        out[rows] = _visibility(grid, grid.view(points[rows]), own[rows], normals[own[rows]])
    return out


def _visibility(grid: ShadowGrid, points: np.ndarray, own: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return `visibility` of points in view coordinates, with the normals of their own triangles."""
    size, row = grid.resolution, np.arange(len(points))
    if grid.parallel:
        flat, face, depth = points[:, :2], 0, -points[:, 2]
    else:
        axis = np.abs(points).argmax(axis=1)
        depth = np.abs(points[row, axis])
        flat = points[row[:, None], (axis[:, None] + [1, 2]) % 3] / depth[:, None]
        face = 2 * axis + (points[row, axis] < 0.0)
    column, line = np.clip(np.floor((flat + 1.0) * (0.5 * size)), 0, size - 1).astype(np.int64).T
    cell = (face * size + line) * size + column
    to_light = None if grid.parallel else -points / np.linalg.norm(points, axis=1)[:, None]
    cosine = np.where(own < 0, 1.0, np.abs(_along(normals, to_light)))
    contact = CONTACT + ROUNDING / np.maximum(cosine, 1e-6)
    shade = np.zeros(len(points))
    entry, last = grid.first[cell], grid.first[cell + 1]
    waiting = np.flatnonzero(entry < last)
    while len(waiting):
        here = entry[waiting]
        waiting = waiting[grid.starts[here] < depth[waiting]]
        code = grid.entries[entry[waiting]]
        foreign = (code >> 4) != own[waiting]
        code, others = code[foreign], waiting[foreign]
        shade[others] = np.maximum(shade[others], _shade(grid, code, points[others], contact[others]))
        entry[waiting] += 1
        waiting = waiting[(entry[waiting] < last[waiting]) & (shade[waiting] < 1.0)]
    return 1.0 - shade


def _shade(grid: ShadowGrid, code: np.ndarray, points: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """Compute the occlusion of the ray from each point to the light by one triangle each."""
    corners = grid.corners[code >> 4]
    to_light = reach = None
    if not grid.parallel:
        reach = np.linalg.norm(points, axis=1)
        to_light = -points / reach[:, None]
    sign = np.where(code & 8, 1.0, -1.0)
    inside = np.ones(len(points), dtype=bool)
    cover = np.ones(len(points))
    sides = []
    # Ends of each edge, and its orientation in the triangle.
    for k, (a, b, sense) in enumerate(((0, 1, 1.0), (1, 2, 1.0), (0, 2, -1.0))):
        edge = corners[:, b] - corners[:, a]
        side = sense * sign * _area(edge, points - corners[:, a], to_light)
        outline = (code >> k) & 1 == 1
        inside &= outline | (side >= 0.0)
        soft = np.flatnonzero(outline)
        if len(soft):
            span = edge[soft, :2] if to_light is None else _cross(edge[soft], to_light[soft])
            width = np.maximum(np.linalg.norm(span, axis=1), 1e-12) * OUTLINE_RAMP
            cover[soft] = np.minimum(cover[soft], np.clip(side[soft] / width + 0.5, 0.0, 1.0))
        sides.append(np.maximum(side, 0.0))
    # The weight of a corner is the edge function of the opposite edge.
    weights = np.stack([sides[1], sides[2], sides[0]], axis=1)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-30)
    ahead = _along(np.einsum("nk,nki->ni", weights, corners) - points, to_light)
    shade = np.where(inside, cover * np.clip(ahead / contact - 1.0, 0.0, 1.0), 0.0)
    return shade if reach is None else np.where(ahead < reach, shade, 0.0)


def _along(vectors: np.ndarray, to_light: np.ndarray | None) -> np.ndarray:
    """Return the component towards the light; without `to_light` the third one."""
    return vectors[:, 2] if to_light is None else np.einsum("ni,ni->n", vectors, to_light)


def _area(a: np.ndarray, b: np.ndarray, to_light: np.ndarray | None) -> np.ndarray:
    """Return the area spanned by a and b, seen from the light."""
    if to_light is None:
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.einsum("ni,ni->n", _cross(a, b), to_light)


def _cross(a, b):
    ax, ay, az = a.T
    bx, by, bz = b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
