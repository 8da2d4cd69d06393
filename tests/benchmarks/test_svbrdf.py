"""`metamer bench svbrdf`: its truth against what is known, and what its rows say."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.svbrdf import benchmark, cases, meshes, methods, rendering, spectrum_cost
from metamer.benchmarks.svbrdf.hiding import Wall
from metamer.benchmarks.svbrdf.light import PreparedLight
from metamer.benchmarks.svbrdf.surface import ShadedPoints
from metamer.benchmarks.svbrdf.truth import true_terms
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.prefiltering import Irradiance
from metamer.lighting.visibility import precompute, refinement
from metamer.spectral.illuminants import illuminant

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def points():
    return ShadedPoints.of_sphere(10)


@pytest.fixture(scope="module")
def sky():
    light = cases.window_sky()
    return PreparedLight(replace(light, fields=light.fields[:, ::2, ::2]))


@pytest.fixture(scope="module")
def uniform():
    """Luminance 1 from everywhere."""
    return PreparedLight(EnvironmentLight(np.ones((1, 64, 128)), (illuminant("D65"),), illuminance_lux=np.pi))


def _task(surface, points, light, hiding=None, lobes=4):
    return methods.MethodTask(surface, points, light, hiding, lobes)


def test_the_truth_of_a_matt_surface_is_its_illuminance(points, sky):
    found = true_terms(_task(cases.matt_red(), points, sky))[0][:, :, 0]
    np.testing.assert_allclose(found, Irradiance.of(sky.light)(points.normals) / np.pi, rtol=0.01)


def test_in_a_furnace_a_smooth_metal_gives_back_almost_everything(points, uniform):
    body, normal, grazing = true_terms(_task(cases.gold(0.2), points, uniform))[0][:, 0].T
    np.testing.assert_allclose(body, 1.0, rtol=1e-2)
    # Facets that reflect all lose what they mask from each other alone.
    facing = points.viewer[:, 2] > 0.5
    whole = (normal + grazing)[facing]
    assert (whole < 1.0).all() and (whole > 0.85).all()


def test_a_directional_light_is_exact_and_lobes_at_the_half_vector_near_it(points):
    task = _task(cases.gold(0.3), points, PreparedLight(cases.case_lights(None)["sun"]()), lobes=6)
    exact, same = true_terms(task)
    assert exact is same
    found = methods.at_half_vectors(task)
    np.testing.assert_allclose(found, exact, rtol=0.02, atol=1e-3 * exact.max())
    warped = methods.by_paper_locally(task)
    assert np.abs(warped - exact).sum() > 5.0 * np.abs(found - exact).sum()


def test_a_lamp_nearby_is_a_lobe_as_wide_as_its_ball_and_as_bright(points):
    light = PreparedLight(cases.case_lights(None)["lamp"]())
    lobes, at = light.local_lobes(points), light.arrivals(points)
    np.testing.assert_allclose(lobes.integral, at.illuminance_lux)
    # A tenth of its top at the radius of a disc of twice the solid angle that the ball has (eq. 32).
    edge = np.arccos(1.0 + np.log(0.1) / lobes.sharpness)
    np.testing.assert_allclose(edge * at.distance, np.sqrt(2.0) * 0.01, rtol=1e-3)


def test_the_paper_knows_a_wall_that_others_do_not(points, uniform):
    """Under uniform light, half of what a metal mirrors is hidden where it mirrors the wall's edge."""
    task = _task(cases.gold(0.1), points, uniform, Wall(cases.WALL))
    exact, open_ = true_terms(task)[0][:, 0, 1], true_terms(replace(task, hiding=None))[0][:, 0, 1]
    seen = open_ > 0.3 * open_.max()
    share = exact[seen] / open_[seen]
    assert share.min() < 0.05 and share.max() > 0.95
    by_paper = methods.by_paper(task)[seen, 0, 1] / methods.without_visibility(task)[seen, 0, 1]
    assert np.abs(by_paper - share).mean() < 0.05
    occluded = methods.with_ambient_occlusion(task)[seen, 0, 1] / methods.without_visibility(task)[seen, 0, 1]
    assert np.abs(occluded - share).mean() > 0.15


def test_harmonics_hold_a_matt_surface_and_one_lobe_for_the_cosine_does_not(points, sky):
    task = _task(cases.matt_red(), points, sky)
    exact = true_terms(task)[0][:, :, 0]

    def error(method):
        return np.abs(method(task)[:, :, 0] / exact - 1.0).mean()

    assert error(methods.by_harmonics) < 0.03 < error(methods.by_paper) < 0.25


@pytest.fixture(scope="module")
def figures():
    patch = pytest.MonkeyPatch()
    patch.setattr(rendering, "ACROSS", (6, 6))
    patch.setattr(rendering, "ROWS", (32, 32))
    patch.setattr(rendering, "PICTURE", (8, 8))
    patch.setattr(meshes, "SUBDIVISIONS", 2)
    patch.setattr(refinement, "MOST_VERTICES", 200)
    patch.setattr(precompute, "_TRAINING", 400)
    # It has a test of its own.
    patch.setattr(spectrum_cost, "spectrum_cost", lambda *given: [])
    yield benchmark.run()
    patch.undo()


def test_rows_say_what_was_rendered_how_and_how_well(figures):
    assert figures["missing"] == [*cases.FILES, *meshes.FILES]
    keys = {
        "case", "method", "light", "lobes", "delta_e94", "reference_noise", "cpu_seconds_per_1000_vertices",
        "bytes_per_vertex", "ms_per_megapixel",
    }  # fmt: skip
    for row in figures["rows"]:
        assert set(row) == keys and set(row["delta_e94"]) == {"mean", "p95", "p99"}
        assert row["ms_per_megapixel"] > 0.0
        assert all(np.isfinite(row["delta_e94"][figure]) for figure in row["delta_e94"])
    json.dumps(figures)
    floor = [row for row in figures["rows"] if row["case"].endswith("floor")]
    assert floor and all(row["bytes_per_vertex"] > 0 for row in floor)
    assert all(row["cpu_seconds_per_1000_vertices"] > 0.0 for row in floor)
    by_name = {(row["case"], row["method"], row["lobes"]): row["delta_e94"]["mean"] for row in figures["rows"]}
    brushed = "Ashikhmin-Shirley 75, 1200, sun"
    assert by_name[brushed, "half-vector", 7] < by_name[brushed, "half-vector", 1]
    assert by_name["gold 0.3, sun", "half-vector", 4] < by_name["gold 0.3, sun", "paper", 4]
    assert by_name["matt red", "sh25", 0] < by_name["matt red", "paper", 0]
    assert by_name["matt red", "ours", 0] < 0.1
    assert by_name["gold 0.3", "ours", 4] < 0.5 * by_name["gold 0.3", "paper", 4]
    for case, lobes in (("gold 0.2, floor", 4), ("matt red, floor", 0)):
        assert by_name[case, "ours", lobes] < 0.5 * min(by_name[case, name, lobes] for name in methods.METHODS)


def test_measured_environments_join_in(shared_data):
    light = cases.case_lights(shared_data)["kiara-dawn"]()
    assert light.fields.shape[1:] == (256, 512)
    assert light.origin == "made"
