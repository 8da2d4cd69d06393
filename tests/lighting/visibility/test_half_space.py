"""Triangles before a light, cut by its plane."""

import numpy as np
from metamer.lighting.visibility.half_space import Before


def areas(triangles):
    return 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)


def test_both_sides_together_are_the_triangle():
    triangles = np.random.default_rng(1).normal(size=(200, 3, 3))
    point, facing = np.array([0.1, 0.2, 0.0]), np.array([0.6, 0.0, 0.8])
    one, other = Before(point, facing).cut(triangles), Before(point, -facing).cut(triangles)
    assert abs(areas(one).sum() + areas(other).sum() - areas(triangles).sum()) < 1e-9
    assert ((one - point) @ facing).min() > -1e-12
    # Corners run the way they did.
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    whole = ((triangles - point) @ facing > 0.0).all(axis=1)
    assert np.array_equal(one[: whole.sum()], triangles[whole])
    assert (
        abs(
            np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]).sum(axis=0)
            + np.cross(other[:, 1] - other[:, 0], other[:, 2] - other[:, 0]).sum(axis=0)
            - normals.sum(axis=0)
        ).max()
        < 1e-9
    )


def test_what_lies_in_the_plane_hides_nothing():
    flat = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    assert len(Before(np.zeros(3), np.array([0.0, 0.0, 1.0])).cut(flat)) == 0
