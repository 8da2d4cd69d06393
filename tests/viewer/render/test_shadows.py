"""Shadows by cells of the light's view: no leaks through closed surfaces, true edges, and a ramp instead of a flip."""

import numpy as np
import pytest
from metamer.lighting.mesh import shapes
from metamer.viewer.render.shadows import CONTACT, OUTLINE_RAMP, shadow_grid, sorted_triangles, visibility

SUN = np.array([0.48, 0.6, 0.64])
LAMP = np.array([0.7, 0.9, -0.4])
NOBODY = -1


def grid_of(corners, directional=True, vector=SUN):
    return shadow_grid(sorted_triangles(np.asarray(corners, dtype=float)), np.array([*vector, 1.0 - directional]))


def seen(grid, points, own=NOBODY):
    points = np.asarray(points, dtype=float)
    return visibility(grid, points, np.full(len(points), own))


def square(half: float, height: float) -> np.ndarray:
    a, b, c, d = np.array([[-half, height, -half], [half, height, -half], [half, height, half], [-half, height, half]])
    return np.array([[a, c, b], [a, d, c]])


@pytest.mark.parametrize(
    ("directional", "vector"),
    [(True, SUN), (True, (0, 1, 0)), (False, LAMP), (False, (3, 9, 4)), (False, (30, 90, 40))],
)
def test_nothing_leaks_through_a_closed_surface(directional, vector):
    mesh = shapes.sphere(4, 0.5)
    grid = grid_of(mesh.vertices[mesh.faces], directional, vector)
    rng = np.random.default_rng(0)
    inside = rng.normal(size=(20_000, 3))
    inside *= (0.45 * rng.random(20_000) ** (1 / 3) / np.linalg.norm(inside, axis=1))[:, None]
    light = seen(grid, inside)
    assert light.max() == 0.0, f"{(light > 0).sum()} leaks, first at {inside[np.argmax(light)]}"


def test_shared_edges_are_tight_for_rays_right_through_vertices_and_edges():
    mesh = shapes.sphere(2, 0.5)
    grid = grid_of(mesh.vertices[mesh.faces], True, (0, 1, 0))
    corners = mesh.vertices[mesh.faces].astype(np.float32).astype(float)
    upper = corners[(corners[..., 1] > 0.1).all(axis=1)]
    through = np.concatenate([upper.reshape(-1, 3), (upper[:, 0] + upper[:, 1]) / 2])
    below = through * [1, 0, 1] - [0, 0.05, 0]
    np.testing.assert_array_equal(seen(grid, below), 0.0)


@pytest.mark.parametrize("directional", [True, False])
def test_a_square_shades_what_it_should(directional):
    grid = grid_of(square(0.3, 0.5), directional, (0, 1, 0) if directional else (0, 0.9, 0))
    reach = 0.3 if directional else 0.3 * 0.9 / 0.4
    x = np.linspace(-0.95, 0.95, 400)
    points = np.stack([x, np.zeros_like(x), 0.1 * np.ones_like(x)], axis=1)
    clear = np.abs(np.abs(x) - reach) > 2 * OUTLINE_RAMP * 3
    np.testing.assert_array_equal(seen(grid, points)[clear], (np.abs(x) > reach)[clear].astype(float))


def test_what_is_beyond_a_lamp_casts_no_shadow():
    grid = grid_of(square(0.3, 0.8), False, (0, 0.5, 0))
    np.testing.assert_array_equal(seen(grid, [[0, 0, 0], [0.1, 0.2, 0.1]]), 1.0)


def test_an_outline_is_a_ramp_about_its_true_place():
    grid = grid_of(square(0.3, 0.5), True, (0, 1, 0))
    x = 0.3 + np.linspace(-2, 2, 401) * OUTLINE_RAMP
    light = seen(grid, np.stack([x, 0 * x, 0 * x], axis=1))
    assert (np.diff(light) >= 0).all() and light[0] == 0.0 and light[-1] == 1.0
    assert np.abs(np.diff(light)).max() < 0.02
    # The corners are kept in float32.
    assert light[200] == pytest.approx(0.5, abs=1e-3)


def test_contact_is_a_ramp_too():
    grid = grid_of(square(0.3, 0.5), True, (0, 1, 0))
    gap = np.array([0.0, 0.9, 1.5, 2.2]) * CONTACT
    light = seen(grid, np.stack([0 * gap, 0.5 - gap, 0 * gap + 0.05], axis=1), own=0)
    assert light[0] == light[1] == 1.0 and 0.3 < light[2] < 0.7 and light[3] < 0.1


def test_a_triangle_never_shades_itself():
    corners = square(0.3, 0.5)
    grid = grid_of(corners[:1])
    on_it = corners[0].mean(axis=0) - 1e-3 * SUN
    assert seen(grid, on_it[None])[0] == 0.0 and seen(grid, on_it[None], own=0)[0] == 1.0


def test_a_light_that_sees_every_triangle_edge_on_casts_no_shadow():
    grid = grid_of(square(0.3, 0.5), True, (1, 0, 0))
    assert len(grid.entries) == 0
    np.testing.assert_array_equal(seen(grid, [[-0.9, 0.5, 0.0], [0, 0, 0]]), 1.0)


def test_cells_list_the_nearest_triangles_first():
    mesh = shapes.cloth(20)
    corners = mesh.vertices[mesh.faces] * 0.5
    for directional, vector in ((True, SUN), (False, LAMP)):
        grid = grid_of(corners, directional, vector)
        for start, stop in zip(grid.first[:-1], grid.first[1:], strict=True):
            assert (np.diff(grid.starts[start:stop]) >= 0).all()


def test_a_far_lamp_still_casts_the_shadow_of_where_it_stands():
    """Its view is made parallel, its rays are not: the shadow of a square is wider than the square."""
    grid = grid_of(square(0.3, 0.5), False, (0, 25, 0))
    assert grid.parallel and grid.convergence == 1 / 25
    reach = 0.3 * 25 / 24.5
    x = np.concatenate([reach + np.array([-2, 2]) * OUTLINE_RAMP, -reach + np.array([-2, 2]) * OUTLINE_RAMP])
    points = np.stack([x, np.zeros_like(x), 0.1 * np.ones_like(x)], axis=1)
    np.testing.assert_array_equal(seen(grid, points), [0, 1, 1, 0])
