"""The integer rasteriser: right by definition, the same as OpenGL, and unmoved by triangles that cannot be drawn."""

import numpy as np
import pytest
from metamer.viewer.gl.passes import Passes
from metamer.viewer.gl.resources import TRIANGLE_TEXELS, TRIANGLES_A_ROW, Owner, TriangleTables, triangle_texels
from metamer.viewer.render.raster import (
    SUBSTEPS,
    TileWindow,
    WindowTriangles,
    cut_triangles,
    depth_keys,
    rasterise,
    window_triangles,
)


def triangles_of(corners: np.ndarray, nearness: np.ndarray | None = None) -> WindowTriangles:
    """Corners in 1/256 sample, (T, 3, 2); triangles without area are left out."""
    corners = np.asarray(corners, dtype=np.int64)
    (x1, y1), (x2, y2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    solid = x1 * y2 != x2 * y1
    corners = corners[solid]
    count = len(corners)
    nearness = np.ones((count, 3)) if nearness is None else np.asarray(nearness, dtype=float)[solid]
    base = int(np.float32(0.5).view(np.int32))
    none, ones = np.zeros(0, dtype=np.int64), np.ones((count, 3))
    return WindowTriangles(corners, nearness, ones, np.arange(count), none, np.zeros((0, 3, 3)), base, 2)


def apart(clip: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles by their corners, none of which are one vertex."""
    return clip.reshape(-1, 3), depth.ravel(), np.arange(depth.size).reshape(-1, 3)


def seen_by_gl(gl, triangles: WindowTriangles, width: int, height: int) -> np.ndarray:
    owner, passes = Owner(gl), Passes(gl)
    ones = np.ones(len(triangles.parent))
    table = owner.table(triangle_texels(triangles, ones, ones), TRIANGLES_A_ROW, TRIANGLE_TEXELS)
    keys = triangles.key_base, triangles.key_shift
    # No positions: nothing but who sees what is drawn.
    tables = TriangleTables(table, table, table, triangles.parent, *keys)
    texture = passes.visibility(owner, TileWindow(0, 0, width, height), tables)
    seen = np.frombuffer(texture.read(), dtype=np.float32).reshape(height, width).astype(np.int64) - 1
    owner.release()
    passes.release()
    return seen


def random_triangles(seed: int, grid: int, width: int, height: int, count: int = 200) -> WindowTriangles:
    """Corners on a coarse grid, so that many samples lie exactly on edges and on corners."""
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, np.array([width, height]) * SUBSTEPS // grid + 1, size=(count, 3, 2)) * grid
    return triangles_of(corners, rng.uniform(0.5, 1.0, (count, 3)))


def test_one_triangle_covers_what_its_edges_say():
    # A right angle with corners on samples: the top-left rule keeps the top and left edge and drops the long one.
    corners = np.array([[[128, 128], [128 + 4 * 256, 128], [128, 128 + 4 * 256]]])
    seen = rasterise(triangles_of(corners), 6, 6)
    expected = np.array([[0 if x + y < 4 else -1 for x in range(6)] for y in range(6)])
    np.testing.assert_array_equal(seen, expected)


def test_winding_does_not_matter():
    corners = np.array([[[37, 91], [1410, 300], [500, 1333]]])
    one, other = (rasterise(triangles_of(corners[:, order]), 6, 6) for order in ([0, 1, 2], [0, 2, 1]))
    np.testing.assert_array_equal(one, other)
    assert (one == 0).any()


@pytest.mark.parametrize("grid", [1, 64, 128])
def test_triangles_that_share_edges_cover_every_sample_once(grid):
    rng = np.random.default_rng(grid)
    steps = 12
    x, y = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1))
    points = np.stack([x, y], axis=-1) * 512
    inner = rng.integers(-(128 // grid), 128 // grid + 1, size=(steps - 1, steps - 1, 2)) * grid
    points[1:-1, 1:-1] += inner
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    corners = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 2), np.stack([a, c, d], 2).reshape(-1, 3, 2)])
    size = 2 * steps
    total = np.zeros((size, size), dtype=int)
    for one in corners:
        total += rasterise(triangles_of(one[None]), size, size) >= 0
    np.testing.assert_array_equal(total, 1)


@pytest.mark.parametrize("grid", [1, 64, 128, 256])
@pytest.mark.parametrize(("width", "height"), [(64, 64), (201, 37)])
def test_equals_opengl_sample_for_sample(gl, grid, width, height):
    triangles = random_triangles(grid + width, grid, width, height)
    mine, theirs = rasterise(triangles, width, height), seen_by_gl(gl, triangles, width, height)
    worst = np.argwhere(mine != theirs)
    assert len(worst) == 0, (
        f"first of {len(worst)}: sample {worst[0]}, {mine[tuple(worst[0])]} {theirs[tuple(worst[0])]}"
    )


def test_large_and_tiny_triangles_together_equal_opengl(gl):
    big = random_triangles(1, 1, 500, 300, 10)
    rng = np.random.default_rng(2)
    start = rng.integers(0, np.array([500, 300]) * SUBSTEPS - 700, size=(3000, 1, 2))
    small = start + rng.integers(0, 700, size=(3000, 3, 2))
    corners = np.concatenate([small, big.corners])
    triangles = triangles_of(corners, rng.uniform(0.5, 1.0, (len(corners), 3)))
    np.testing.assert_array_equal(rasterise(triangles, 500, 300), seen_by_gl(gl, triangles, 500, 300))


def test_of_equal_depths_the_first_drawn_stays(gl):
    corners = np.array([[[0, 0], [2560, 0], [0, 2560]]] * 3)
    triangles = triangles_of(corners, np.array([[0.7] * 3, [0.8] * 3, [0.8] * 3]))
    seen = rasterise(triangles, 8, 8)
    assert set(np.unique(seen)) == {-1, 1}
    np.testing.assert_array_equal(seen, seen_by_gl(gl, triangles, 8, 8))


def test_depth_keys_grow_with_nearness():
    nearness = np.sort(np.random.default_rng(0).uniform(0.25, 1.0, 1000).astype(np.float32))
    keys = depth_keys(nearness, int(np.float32(0.25).view(np.int32)), 2)
    assert (np.diff(keys) >= 0).all() and keys[0] >= 0 and keys[-1] < 1 << 22


def clip_square(depth: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    clip = np.concatenate([corners * depth, np.full((4, 1), depth)], axis=1)[[[0, 1, 2], [0, 2, 3]]]
    return clip, np.full((2, 3), depth)


def test_what_is_behind_the_camera_is_gone():
    clip, depth = clip_square(-2.0)
    assert len(window_triangles(*apart(clip, depth), True, (16, 16), TileWindow(0, 0, 16, 16)).parent) == 0
    front, front_depth = clip_square(2.0)
    both = np.concatenate([clip, front]), np.concatenate([depth, front_depth])
    triangles = window_triangles(*apart(*both), True, (16, 16), TileWindow(0, 0, 16, 16))
    assert triangles.parent.tolist() == [2, 3]


def test_a_floor_that_runs_under_the_camera_is_cut_at_the_window():
    # Corners behind, beside and far ahead of a camera one unit above the floor.
    floor = np.array([[-50.0, -1.0, 40.0], [50.0, -1.0, 40.0], [0.0, -1.0, -3000.0]])
    clip = np.stack([floor[:, 0], floor[:, 1], -floor[:, 2]], axis=1)[None]
    triangles = window_triangles(*apart(clip, -floor[None, :, 2]), True, (64, 64), TileWindow(0, 0, 64, 64))
    assert (triangles.corners >= 0).all() and (triangles.corners <= 64 * SUBSTEPS).all()
    seen = rasterise(triangles, 64, 64)
    assert (seen[33:] >= 0).all() and (seen[:32] < 0).all()
    np.testing.assert_allclose(triangles.weights.sum(axis=2), 1.0, atol=1e-12)


def test_tiles_together_are_the_whole_picture():
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.uniform(-1.3, 1.3, (60, 3, 2)), np.ones((60, 3, 1))], axis=2)
    depth = rng.uniform(1.0, 2.0, (60, 3))
    whole = window_triangles(*apart(points, depth), False, (40, 40), TileWindow(0, 0, 40, 40))
    seen = whole.parent[rasterise(whole, 40, 40)]
    tiled = np.zeros_like(seen)
    for left in (0, 16, 32):
        for top in (0, 16, 32):
            window = TileWindow(left, top, min(16, 40 - left), min(16, 40 - top))
            part = window_triangles(*apart(points, depth), False, (40, 40), window)
            found = rasterise(part, window.width, window.height)
            tiled[top : top + window.height, left : left + window.width] = np.where(found < 0, -1, part.parent[found])
    seen = np.where(rasterise(whole, 40, 40) < 0, -1, seen)
    # Cutting moves an edge by up to half a step of the grid, 1/512 sample, and depths are scaled per tile.
    assert (seen != tiled).mean() < 0.005


def test_degenerate_triangles_are_dropped():
    point = np.array([[0.1, 0.1, 1.0]] * 3)
    line = np.array([[-0.5, -0.5, 1.0], [0.0, 0.0, 1.0], [0.5, 0.5, 1.0]])
    both = apart(np.stack([point, line]), np.ones((2, 3)))
    triangles = window_triangles(*both, False, (16, 16), TileWindow(0, 0, 16, 16))
    assert len(triangles.parent) == 0
    assert (rasterise(triangles, 16, 16) == -1).all()


def test_an_empty_window_equals_opengl(gl):
    nothing = triangles_of(np.zeros((0, 3, 2)))
    np.testing.assert_array_equal(rasterise(nothing, 5, 4), seen_by_gl(gl, nothing, 5, 4))


def test_cut_pieces_keep_the_area_on_the_inner_side():
    rng = np.random.default_rng(5)
    points = rng.normal(size=(200, 3, 2))
    pieces, weights, parent = cut_triangles(points, [lambda p: p[..., 0] - 0.2])
    assert (pieces[..., 0] >= 0.2 - 1e-12).all()
    np.testing.assert_allclose(np.einsum("tkj,tji->tki", weights, points[parent]), pieces, atol=1e-12)
    rest, _, _ = cut_triangles(points, [lambda p: 0.2 - p[..., 0]])

    def area(t):
        (x1, y1), (x2, y2) = (t[:, 1] - t[:, 0]).T, (t[:, 2] - t[:, 0]).T
        return np.abs(x1 * y2 - x2 * y1).sum() / 2

    np.testing.assert_allclose(area(pieces) + area(rest), area(points), rtol=1e-12)


def test_many_triangles_stay_quick_and_right():
    """A mesh of 80 000 triangles: every sample inside its outline is covered."""
    steps = 200
    u, v = np.meshgrid(np.linspace(-0.9, 0.9, steps + 1), np.linspace(-0.9, 0.9, steps + 1))
    points = np.stack([u, v, np.ones_like(u)], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    clip = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])
    triangles = window_triangles(*apart(clip, np.ones(clip.shape[:2])), False, (768, 768), TileWindow(0, 0, 768, 768))
    seen = rasterise(triangles, 768, 768)
    assert (seen[39:729, 39:729] >= 0).all() and (seen[:38] < 0).all()
