"""Directions that every renderer shares."""

import numpy as np
from metamer.lighting.vectors import LEAST_COSINE, dot, facing_viewer, unit


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
