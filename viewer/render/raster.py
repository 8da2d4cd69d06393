"""Integer rasteriser that finds the visible triangle at each sample, bit-identical to OpenGL.

Vertices are snapped to a grid of 1/256 sample in float64, before any GL call, so that OpenGL's own snapping changes
nothing. Coverage is then decided in integers: three edge functions and the top-left rule. Depth is compared by an
integer key, computed with the same float32 multiplications and additions, in the same order, as in `visibility.frag`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

# Grid steps between neighbouring samples: the eight sub-pixel bits of OpenGL implementations.
SUBSTEPS = 256
# Bits of keys, which a 24-bit depth buffer stores a quarter of a step away from any rounding (see `visibility.frag`).
DEPTH_BITS = 22
# Samples tested at once by the numpy rasteriser.
_BATCH = 1 << 21


@dataclass(frozen=True)
class TileWindow:
    """Rectangle of samples: its size and the position of its top left corner in the whole image, in samples."""

    left: int
    top: int
    width: int
    height: int


@dataclass(frozen=True)
class WindowTriangles:
    """Triangles clipped to a window, in drawing order.

    Attributes
    ----------
    corners : (T, 3, 2) x to the right and y down from the window's top left corner, in 1/256 of a sample.
    nearness : (T, 3) in (0, 1], affine in the window and larger nearer; 1/w up to a factor in a perspective view.
    inverse_w : (T, 3) weights for perspective-correct interpolation, largest 1.
    parent : (T,) index of the triangle that each one was clipped from; non-decreasing.
    cut : (C,) indices of pieces of clipped triangles; increasing.
    weights : (C, 3, 3) barycentric coordinates of these pieces' corners in the parent.
    key_base, key_shift : parameters of depth keys from float32 nearness (`depth_keys`).
    """

    corners: Int[np.ndarray, "T 3 2"]
    nearness: Float[np.ndarray, "T 3"]
    inverse_w: Float[np.ndarray, "T 3"]
    parent: Int[np.ndarray, " T"]
    cut: Int[np.ndarray, " C"]
    weights: Float[np.ndarray, "C 3 3"]
    key_base: int
    key_shift: int

    def at_corners(self, values: Float[np.ndarray, "F 3 c"]) -> Float[np.ndarray, "T 3 c"]:
        """Interpolate attributes that are linear on the scene's triangles to the corners of these."""
        found = values[self.parent]
        found[self.cut] = self.weights @ found[self.cut]
        return found

    def of_parents(self, number: Int[np.ndarray, " n"], weights: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Convert barycentric coordinates in triangles `number` to those in their parents."""
        if not len(self.cut):
            return weights
        at = np.minimum(np.searchsorted(self.cut, number), len(self.cut) - 1)
        pieces = self.cut[at] == number
        weights = weights.copy()
        weights[pieces] = np.einsum("nk,nkj->nj", weights[pieces], self.weights[at[pieces]])
        return weights

    def depth_planes(self) -> tuple[Int[np.ndarray, "T 2"], Float[np.ndarray, "T 5"]]:
        """Compute a reference sample (x, y) and float32 (d/dx, d/dy, value, lowest, highest) of every triangle's
        nearness.

        The plane is evaluated at a sample (x, y) as `(d/dx (x - x0) + d/dy (y - y0)) + value`, every operation in
        float32, then clamped: thin triangles have steep planes.
        """
        corners = self.corners.astype(np.float64) / SUBSTEPS
        reference = self.corners[:, 0] // SUBSTEPS
        x1, y1, x2, y2 = _sides(corners)
        first, second, third = self.nearness.T
        d1, d2 = second - first, third - first
        area = x1 * y2 - x2 * y1
        slope_x, slope_y = (d1 * y2 - d2 * y1) / area, (d2 * x1 - d1 * x2) / area
        across, down = (reference[:, axis] + 0.5 - corners[:, 0, axis] for axis in range(2))
        planes = np.empty((len(corners), 5), dtype=np.float32)
        planes[:, 0], planes[:, 1] = slope_x, slope_y
        planes[:, 2] = first + slope_x * across + slope_y * down
        planes[:, 3], planes[:, 4] = least_of(self.nearness), most_of(self.nearness)
        return reference, planes


def _sides(corners: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return x and y (T,) of the vectors from the first corner (T, 3, 2) to the second and third, by columns, since
    numpy is slow for short rows.
    """
    (x0, y0), (x1, y1), (x2, y2) = corners.transpose(1, 2, 0)
    return x1 - x0, y1 - y0, x2 - x0, y2 - y0


def least_of(corners: Float[np.ndarray, "T 3 *c"]) -> Float[np.ndarray, "T *c"]:
    """Return the least value of three corners, several times faster than numpy's reduction."""
    return np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])


def most_of(corners: Float[np.ndarray, "T 3 *c"]) -> Float[np.ndarray, "T *c"]:
    """Return the largest value of three corners."""
    return np.maximum(np.maximum(corners[:, 0], corners[:, 1]), corners[:, 2])


def depth_keys(nearness: Float[np.ndarray, " n"], key_base: int, key_shift: int) -> Int[np.ndarray, " n"]:
    """Compute integers that order float32 `nearness`, larger is nearer: its bits relative to `key_base`, without the
    last few.
    """
    return (nearness.view(np.int32).astype(np.int64) - key_base) >> key_shift


def window_triangles(
    clip: Float[np.ndarray, "V 3"],
    depth: Float[np.ndarray, " V"],
    faces: Int[np.ndarray, "F 3"],
    perspective: bool,
    size: tuple[int, int],
    window: TileWindow,
    farthest: float | None = None,
) -> WindowTriangles:
    """Clip triangles to the frustum of `window`, and snap them to the grid.

    Parameters
    ----------
    clip : (V, 3) x, y and w of every vertex in clip space, y up.
    depth : (V,) distances along the viewing direction; clipped below 1e-5 of the farthest (perspective), or behind the
        camera (orthographic).
    faces : (F, 3) vertex indices of corners.
    size : width and height of the whole image in samples.
    farthest : largest `depth` of the scene, if these are only some of its vertices.

    Triangles without area on the grid are dropped, since they cover no sample.
    """
    farthest = float(depth.max(initial=0.0)) if farthest is None else farthest
    least = 1e-5 * max(farthest, 1e-30) if perspective else 0.0
    x, y, w = clip.T
    # Homogeneous window coordinates, so that clipping is linear: x/w and y/w are in samples from the window's corner.
    across = (0.5 * (x + w)) * size[0] - window.left * w
    down = (0.5 * (w - y)) * size[1] - window.top * w
    points = np.stack([across, down, w, depth], axis=-1)
    planes = (
        lambda p: p[..., 3] - least,
        lambda p: p[..., 0],
        lambda p: window.width * p[..., 2] - p[..., 0],
        lambda p: p[..., 1],
        lambda p: window.height * p[..., 2] - p[..., 1],
    )
    beyond = _beyond(points, planes)
    whole, cut = _whole_and_cut(beyond.take(faces))
    # Once per vertex instead of per corner; vertices beyond a plane are corners of no unclipped triangle.
    places, inside = np.empty((len(points), 2), dtype=np.int64), beyond == 0
    divisor = np.where(inside, w, 1.0)
    for axis, one in enumerate((across, down)):
        places[:, axis] = np.rint(np.where(inside, one, 1.0) / divisor * SUBSTEPS)
    ends = faces if len(whole) == len(faces) else faces.take(whole, axis=0)
    corners, depth, parent = places.take(ends, axis=0), depth.take(ends), whole
    pieces, weights, which = _cut_by_all(points[faces[cut]], planes)
    # Pieces take the position of their triangles.
    order = np.argsort(which, kind="stable")
    pieces, weights, which = pieces[order], weights[order], cut[which[order]]
    at = np.searchsorted(whole, which)
    if len(at):
        corners, depth = np.insert(corners, at, _on_grid(pieces), axis=0), np.insert(depth, at, pieces[..., 3], axis=0)
        parent = np.insert(parent, at, which)
    cut = at + np.arange(len(at))
    x1, y1, x2, y2 = _sides(corners)
    solid = x1 * y2 != y1 * x2
    if not solid.all():
        kept, weights = np.flatnonzero(solid), weights[solid[cut]]
        corners, depth, parent = (one.take(kept, axis=0) for one in (corners, depth, parent))
        cut = np.searchsorted(kept, cut[solid[cut]])
    if perspective:
        nearest = depth.min(initial=np.inf)
        nearness = nearest / depth
        inverse_w = 1.0 / depth
        most = most_of(inverse_w)
        for column in inverse_w.T:
            column /= most
    else:
        low, high = depth.min(initial=np.inf), depth.max(initial=-np.inf)
        nearness = 1.0 - 0.5 * (depth - low) / max(high - low, 1e-300)
        inverse_w = np.ones_like(depth)
    base = int(np.float32(nearness.min(initial=1.0)).view(np.int32))
    span = int(np.float32(1.0).view(np.int32)) - base
    shift = max(0, span.bit_length() - DEPTH_BITS)
    return WindowTriangles(corners, nearness, inverse_w, parent, cut, weights, base, shift)


def _on_grid(points: Float[np.ndarray, "*n 4"]) -> Int[np.ndarray, "*n 2"]:
    """Round homogeneous window coordinates to steps of the vertex grid."""
    return np.rint(points[..., :2] / points[..., 2:3] * SUBSTEPS).astype(np.int64)


_Planes = Sequence[Callable[[np.ndarray], np.ndarray]]


def cut_triangles(
    points: Float[np.ndarray, "F 3 c"], planes: _Planes
) -> tuple[Float[np.ndarray, "T 3 c"], Float[np.ndarray, "T 3 3"], Int[np.ndarray, " T"]]:
    """Clip triangles to the region where the signed distances from all planes, linear in the c coordinates, are not
    negative.

    Returns the pieces, their corners as barycentric coordinates in the original triangle, and its index,
    non-decreasing. Triangles that no plane intersects are unchanged.
    """
    whole, cut = _whole_and_cut(_beyond(points, planes))
    eye = np.broadcast_to(np.eye(3), (len(whole), 3, 3))
    if not len(cut):
        return points if len(whole) == len(points) else points[whole], eye, whole
    pieces, weights, which = _cut_by_all(points[cut], planes)
    parent = np.concatenate([whole, cut[which]])
    order = np.argsort(parent, kind="stable")
    points, weights = np.concatenate([points[whole], pieces]), np.concatenate([eye, weights])
    return points[order], weights[order], parent[order]


def _beyond(points: Float[np.ndarray, "*n c"], planes: _Planes) -> Int[np.ndarray, "*n"]:
    """Return a bit mask per point of the planes that it is beyond."""
    found = np.zeros(points.shape[:-1], dtype=np.uint8)
    for number, plane in enumerate(planes):
        found |= (plane(points) < 0.0).view(np.uint8) << np.uint8(number)
    return found


def _whole_and_cut(beyond: Int[np.ndarray, "F 3"]) -> tuple[Int[np.ndarray, " W"], Int[np.ndarray, " C"]]:
    """Separate triangles inside all planes from intersected ones, and omit those beyond a plane."""
    first, second, third = beyond.T
    crossing, outside = (first | second | third) != 0, (first & second & third) != 0
    return np.flatnonzero(~crossing), np.flatnonzero(crossing & ~outside)


def _cut_by_all(
    points: Float[np.ndarray, "C 3 c"], planes: _Planes
) -> tuple[Float[np.ndarray, "T 3 c"], Float[np.ndarray, "T 3 3"], Int[np.ndarray, " T"]]:
    """Clip triangles by one plane after another; see `cut_triangles`."""
    weights, parent = np.broadcast_to(np.eye(3), (len(points), 3, 3)), np.arange(len(points))
    for plane in planes:
        points, weights, parent = _cut(points, weights, parent, plane)
    return points, weights, parent


def _cut(points, weights, parent, plane):
    """Clip each triangle to where `plane` is not negative: zero, one or two triangles.

    A new corner is computed from the inner to the outer end of its edge, so that triangles sharing an edge get the same
    one.
    """
    distance = plane(points)
    inside = distance >= 0.0
    count = inside.sum(axis=1)

    def turned(chosen, first):
        index = (first[:, None] + np.arange(3)) % 3
        rows = np.flatnonzero(chosen)[:, None]
        return points[rows, index], weights[rows, index], distance[rows, index], parent[chosen]

    def between(values, d, a, b):
        t = d[:, a] / (d[:, a] - d[:, b])
        return values[:, a] + t[:, None] * (values[:, b] - values[:, a])

    results: list[tuple[np.ndarray, ...]] = [(points[count == 3], weights[count == 3], parent[count == 3])]
    one = count == 1
    if one.any():  # the inner corner comes first
        p, q, d, owner = turned(one, inside[one].argmax(axis=1))
        kept = [np.stack([v[:, 0], between(v, d, 0, 1), between(v, d, 0, 2)], axis=1) for v in (p, q)]
        results.append((*kept, owner))
    two = count == 2
    if two.any():  # the outer corner comes first
        p, q, d, owner = turned(two, (~inside[two]).argmax(axis=1))
        for corners in (
            lambda v, d: (between(v, d, 1, 0), v[:, 1], v[:, 2]),
            lambda v, d: (between(v, d, 1, 0), v[:, 2], between(v, d, 2, 0)),
        ):
            results.append((np.stack(corners(p, d), axis=1), np.stack(corners(q, d), axis=1), owner))
    return tuple(np.concatenate(parts) for parts in zip(*results, strict=True))


def rasterise(
    triangles: WindowTriangles,
    width: int,
    height: int,
    there: Callable[[np.ndarray, np.ndarray], Bool[np.ndarray, " n"]] | None = None,
) -> Int[np.ndarray, "height width"]:
    """Find the visible triangle at every sample, -1 for none; row 0 on top.

    there : returns whether triangles (n,) exist at samples (n, 2), column and row; None is always.

    Of two triangles with the same depth key the first drawn is kept, as with OpenGL's strict comparison.
    """
    corners = triangles.corners
    reference, planes = triangles.depth_planes()
    x1, y1, x2, y2 = _sides(corners)
    area = x1 * y2 - y1 * x2
    # With y down, a positive area is clockwise on the screen; others are reversed.
    ring = np.where(area[:, None, None] > 0, corners, corners[:, [0, 2, 1]])
    half = SUBSTEPS // 2
    # First and last sample whose centre is inside the bounding box.
    low = np.maximum(-((half - least_of(ring)) // SUBSTEPS), 0)
    high = np.minimum((most_of(ring) - half) // SUBSTEPS, [width - 1, height - 1])
    extent = high - low + 1
    far = np.int64(1) << 62
    nearest = np.full(width * height, far, dtype=np.int64)
    seen = np.flatnonzero((extent > 0).all(axis=1))
    # Triangles with similar boxes are processed together, in classes of powers of two in width and height.
    classes = np.ceil(np.log2(np.maximum(extent[seen], 1))).astype(np.int64)
    code = classes[:, 0] * 64 + classes[:, 1]
    for kind in np.unique(code):
        members = seen[code == kind]
        across, down = extent[members].max(axis=0)
        step = max(1, _BATCH // int(across * down))
        for start in range(0, len(members), step):
            chosen = members[start : start + step]
            x = low[chosen, 0, None] + np.tile(np.arange(across), down)
            y = low[chosen, 1, None] + np.repeat(np.arange(down), across)
            covered = (x <= high[chosen, 0, None]) & (y <= high[chosen, 1, None])
            for k in range(3):
                a, b = ring[chosen, k], ring[chosen, (k + 1) % 3]
                dx, dy = (b - a).T[..., None]
                # An edge owns its samples if it is a top edge (horizontal, going right) or a left one (going up).
                owner = (dy < 0) | ((dy == 0) & (dx > 0))
                offset = dx * (half - a[:, 1, None]) - dy * (half - a[:, 0, None]) - ~owner
                covered &= (dx * SUBSTEPS) * y - (dy * SUBSTEPS) * x + offset >= 0
            which, sample = np.nonzero(covered)
            number = chosen[which]
            x, y = x[which, sample], y[which, sample]
            if there is not None:
                kept = there(number, np.stack([x, y], axis=1))
                number, x, y = number[kept], x[kept], y[kept]
            plane = planes[number]
            dx = (x - reference[number, 0]).astype(np.float32)
            dy = (y - reference[number, 1]).astype(np.float32)
            value = (plane[:, 0] * dx + plane[:, 1] * dy) + plane[:, 2]
            value = np.minimum(np.maximum(value, plane[:, 3]), plane[:, 4])
            key = depth_keys(value, triangles.key_base, triangles.key_shift)
            np.minimum.at(nearest, y * width + x, (((1 << DEPTH_BITS) - key) << 32) | number)
    return np.where(nearest == far, -1, nearest & 0xFFFFFFFF).reshape(height, width)
