"""Share of a Gaussian that a triangle's own plane hides, beside the integral, and in a picture of few triangles."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.svbrdf import cases, meshes
from metamer.benchmarks.svbrdf.light import PreparedLight
from metamer.benchmarks.svbrdf.methods import MethodTask
from metamer.benchmarks.svbrdf.ours import by_slices
from metamer.benchmarks.svbrdf.rendering import at_most_rows
from metamer.benchmarks.svbrdf.truth import true_terms
from metamer.lighting.camera import Camera
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.scene import Part
from metamer.lighting.visibility.free_share import share_above


@pytest.mark.parametrize("sharpness", [25.0, 400.0, 1e4])
@pytest.mark.parametrize("apart", [0.0, 0.05, 0.2, 0.5])
def test_it_is_the_integral_over_parallel_horizons(sharpness, apart):
    sigma = sharpness**-0.5
    for shading in np.linspace(-1.5 * sigma, 0.9, 12):
        x = np.linspace(0.0, shading + 8.0 * sigma, 40_001)
        light = x * np.exp(-0.5 * ((x - shading) / sigma) ** 2)
        exact = light[x >= apart].sum() / light.sum()
        found = share_above(np.array([shading - apart]), np.array([shading]), sharpness)[0]
        assert found == pytest.approx(exact, abs=0.02)


def test_it_is_exactly_all_where_the_triangle_is_not_steeper():
    shading = np.linspace(-1.0, 1.0, 101)
    for more in (0.0, 1e-15, 0.3):
        assert (share_above(shading + more, shading, 300.0) == 1.0).all()


def test_it_falls_from_all_to_nothing_without_a_jump():
    shading = np.full(4001, 0.1)
    found = share_above(np.linspace(0.3, -0.9, 4001), shading, 300.0)
    assert found[0] == 1.0 and found[-1] < 1e-9
    assert np.diff(found).max() < 1e-6 and np.diff(found).min() > -0.01


@pytest.mark.slow
def test_triangles_that_look_away_from_a_low_light_are_dark():
    """A ball of 80 triangles, which shading normals take for round: its triangles' own planes end the light."""
    small = sphere(1, 0.1).placed(translate=(0.0, 3.0, 0.0))
    parts = (Part("ball", sphere(1), "paint"), Part("small", small, "paint"))
    view = Camera("view", (-3.0, 0.5, 1.0), (0, 0, 0), projection="orthographic", height=2.2)
    hiding, points = meshes.pixel_points(parts, (view,), 22)
    light = PreparedLight(at_most_rows(cases.window_sky(), 64))
    task = MethodTask(cases.matt_red(), points, light, hiding, 0)
    exact = true_terms(task)[0][..., 0]
    own = by_slices(task)[..., 0]
    blind = by_slices(replace(task, hiding=replace(hiding, geometric=points.normals)))[..., 0]
    off, off_blind = (np.sqrt(np.mean((one - exact) ** 2)) for one in (own, blind))
    assert off < 0.6 * off_blind
