"""Directions that every renderer shares."""

import numpy as np
from metamer.lighting.vectors import LEAST_COSINE, dot, facing_viewer, unit, welded


def test_normals_that_see_the_viewer_stay_and_others_are_bent_no_farther_than_needed():
    normals, to_viewer = (unit(np.random.default_rng(seed).normal(size=(2, 500, 3))) for seed in (0, 1))
    bent = facing_viewer(normals, to_viewer)
    np.testing.assert_allclose(np.linalg.norm(bent, axis=-1), 1.0, atol=1e-15)
    before, after = dot(normals, to_viewer), dot(bent, to_viewer)
    seen = before >= LEAST_COSINE
    assert 0.3 < seen.mean() < 0.7
    np.testing.assert_allclose(bent[seen], normals[seen], atol=1e-15)
    # Bent in the plane of normal and viewer, onto the least cosine before its length is made one again.
    sine = np.sqrt(1.0 - before[~seen] ** 2)
    np.testing.assert_allclose(after[~seen], LEAST_COSINE / np.hypot(LEAST_COSINE, sine), rtol=1e-9)
    across = np.cross(normals, to_viewer)
    np.testing.assert_allclose(dot(bent, across), 0.0, atol=1e-14)


def test_points_are_welded_as_unique_rows_are():
    rng = np.random.default_rng(3)
    points = rng.integers(-2, 3, (500, 3)) * np.array([0.1, -1e-30, 1e9])
    points[::7] *= -1.0
    points[::5] = 0.0
    points[::10] = -0.0
    unique, which = np.unique(points, axis=0, return_inverse=True)
    found, numbers = welded(points)
    np.testing.assert_array_equal(found, unique)
    np.testing.assert_array_equal(numbers, which.reshape(-1))
