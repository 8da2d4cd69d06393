"""The scenes of `metamer bench svbrdf`: meshes seen by cameras, gold, catalogues, fits, bumps, spectra beside RGB."""

import numpy as np
import pytest
from metamer.benchmarks.svbrdf import benchmark, cases, catalogued, gold, measured, meshes, minified, rendering
from metamer.benchmarks.svbrdf.light import PreparedLight
from metamer.benchmarks.svbrdf.spectrum_cost import NAME
from metamer.lighting.environment.booth import light_booth
from metamer.lighting.environment.prefiltering import Irradiance
from metamer.lighting.visibility import precompute, refinement
from metamer.materials.analytic.cook_torrance import fresnel
from metamer.materials.analytic.lambert import Lambert
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from PIL import Image


def silent(_line):
    """Says nothing."""


def test_gold_reflects_as_its_refractive_index_says():
    """Johnson and Christy's n and k at 2.26 eV (548.6 nm), and what is between the angles that are kept."""
    at = np.array([1.0, 0.8, 0.5, 0.25, 0.12, 0.03])
    surface = gold.real_gold(0.2)
    kept = surface.shares(at) @ surface.facets
    np.testing.assert_allclose(kept, gold.reflectance(at), atol=0.005)
    green = np.array([np.interp(548.6, WORKING_WAVELENGTHS_NM, one) for one in kept])
    exact = fresnel(at**2, 1.0 - at**2, np.array([0.43]), np.array([2.455]))[:, 0]
    np.testing.assert_allclose(green, exact, atol=0.01)


def test_shares_of_gold_add_up_to_one_and_none_is_negative():
    shares = gold.real_gold(0.2).shares(np.linspace(0.0, 1.0, 101))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)
    assert shares.min() >= 0.0


@pytest.fixture(scope="module")
def on_floor():
    patch = pytest.MonkeyPatch()
    patch.setattr(meshes, "SUBDIVISIONS", 2)
    patch.setattr(refinement, "MOST_VERTICES", 200)
    yield meshes.shape_on_floor(12)
    patch.undo()


def test_points_that_a_camera_sees_see_the_camera(on_floor):
    hiding, points = on_floor
    back = np.einsum("nij,nj->ni", points.world_from_local, points.viewer)
    np.testing.assert_allclose(back, np.broadcast_to(back[0], back.shape), atol=1e-12)
    assert len(points) > 50 and hiding.seen(back[:1]).all()


def test_what_is_under_a_point_is_not_seen_and_some_of_the_sky_is_hidden(on_floor):
    hiding, points = on_floor
    down = hiding.seen(np.array([[0.0, -1.0, 0.0]]))
    assert not down[points.normals[:, 1] > 0.0].any()
    slanting = np.array([[-0.8, 0.3, -0.52], [0.8, 0.3, 0.52]])
    free = hiding.seen(slanting / np.linalg.norm(slanting, axis=1, keepdims=True))
    # Away from the camera the shape stands before its floor.
    level = points.normals[:, 1] > 0.999
    assert 0.1 < free[level, 0].mean() < 0.95


@pytest.mark.slow
def test_a_matt_cow_under_a_measured_sky(shared_data, monkeypatch):
    monkeypatch.setattr(rendering, "PICTURE", (10, 10))
    monkeypatch.setattr(rendering, "ROWS", (64, 64))
    monkeypatch.setattr(precompute, "_TRAINING", 400)
    rows = benchmark.run(data=shared_data, pattern="matt red, spot")["rows"]
    by_method = {row["method"]: row for row in rows}
    assert set(by_method) == {"ours", "paper", "no-visibility", "ambient-occlusion", "sh25"}
    mean = {name: row["delta_e94"]["mean"] for name, row in by_method.items()}
    assert mean["ours"] < 0.25 * min(one for name, one in mean.items() if name != "ours")
    assert by_method["ours"]["reference_noise"] < 0.1
    assert by_method["ours"]["bytes_per_vertex"] <= 100.0


def test_meshes_and_lights_that_are_not_there_are_named(tmp_path):
    assert benchmark.run(data=tmp_path, pattern="*, spot on floor")["rows"] == []
    assert set(meshes.mesh_places(tmp_path)) == {"floor"}


def test_cases_that_are_not_there_are_refused_with_those_that_are():
    with pytest.raises(InputError, match="matt red, spot on floor"):
        benchmark.run(pattern="teapot")


def test_the_reference_of_a_white_matt_sphere_is_its_illuminance(monkeypatch):
    monkeypatch.setattr(catalogued, "RINGS", (4, 6))
    booth = light_booth("D65")
    compared = catalogued._Compared({"booth": PreparedLight(booth)}, True)
    white = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.ones(len(WORKING_WAVELENGTHS_NM))))
    found = compared._seen(white, compared._arriving(catalogued.FINE))[:, 0, 1]
    normals = compared._sphere.points.normals
    np.testing.assert_allclose(found, Irradiance.of(booth)(normals)[:, 0] / np.pi, rtol=0.01)


def test_spheres_are_seen_from_the_front_whichever_material_they_are_of():
    for isotropic in (True, False):
        sphere = catalogued._sphere(isotropic)
        points = sphere.points
        np.testing.assert_allclose(points.world(points.viewer), np.tile([0.0, 0.0, 1.0], (len(points), 1)), atol=1e-12)
        turn = np.swapaxes(points.world_from_local, 1, 2) @ points.world_from_local
        np.testing.assert_allclose(turn, np.broadcast_to(np.eye(3), turn.shape), atol=1e-12)
        # Equal areas of the disc: the mean square of its radius is a half.
        np.testing.assert_allclose((points.normals[:, :2] ** 2).sum(axis=1).mean(), 0.5, atol=1e-12)


@pytest.mark.slow
def test_materials_of_a_catalogue_have_a_row_each(tiny_catalogue, monkeypatch):
    monkeypatch.setattr(catalogued, "RINGS", (4, 6))
    figures = benchmark.run(pattern="tiny/*", catalogue=tiny_catalogue)
    assert {row["light"] for row in figures["rows"]} == {catalogued.BOOTH}
    assert all(row["case"].startswith("tiny/") and row["method"] == "ours" for row in figures["rows"])
    for row in figures["rows"]:
        assert row["delta_e94"]["p95"] < 2.0 and row["reference_noise"] < 0.1
    assert any("under booth-D65" in note for note in figures["notes"])


@pytest.mark.slow
def test_a_measured_material_in_three_lobes(shared_data):
    ((row, seconds),) = measured.measured_rows(shared_data, lambda name: name == "MERL gray-plastic", silent)
    assert row["lobes"] == 3 and row["delta_e94"]["mean"] < 0.5 and seconds > 0.0
    assert len(measured.materials(shared_data)) >= 12


def test_bumps_from_afar(tmp_path, monkeypatch):
    monkeypatch.setattr(minified, "BLOCKS", 200)
    folder = tmp_path / "maps" / "brick"
    folder.mkdir(parents=True)
    y, x = np.mgrid[0:64, 0:64]
    lean = np.stack([0.3 * np.sin(2 * np.pi * x / 16), 0.2 * np.cos(2 * np.pi * y / 8)], axis=-1)
    normal = np.concatenate([lean, np.sqrt(1.0 - (lean**2).sum(axis=-1, keepdims=True))], axis=-1)
    Image.fromarray(np.round(127.5 * (normal + 1.0)).astype(np.uint8)).save(folder / "brick_normal.png")
    rows = list(minified.minified(tmp_path, lambda name: name.endswith("0.4"), silent))
    ours, alone = (row["delta_e94"]["mean"] for row in rows)
    assert [row["method"] for row in rows] == ["ours", "one-texel"]
    assert ours < 0.2 * alone


@pytest.mark.slow
def test_spectra_are_exact_and_rgb_is_not(gl, monkeypatch):
    from metamer.benchmarks.svbrdf import spectrum_cost

    monkeypatch.setattr(refinement, "MOST_VERTICES", 200)
    monkeypatch.setattr(spectrum_cost, "PIXELS", 16)
    monkeypatch.setattr(spectrum_cost, "TURNS", 1)
    monkeypatch.setattr(meshes, "SUBDIVISIONS", 2)
    found = {row["method"]: row for row in benchmark.run(pattern=NAME)["rows"]}
    assert set(found) == {"ours", "rgb"}
    assert found["ours"]["delta_e94"]["p99"] < 1e-6 < 0.1 < found["rgb"]["delta_e94"]["mean"]
    assert all(row["ms_per_megapixel"] > 0.0 for row in found.values())


def test_scenes_are_in_the_runs_that_they_are_said_to_be_in():
    quick, long = ({case.name for case in cases.svbrdf_cases(full)} for full in (False, True))
    assert {"matt red, spot", "matt red, spot on floor", "gold n k 0.1, spot"} <= quick
    assert "gold n k 0.4, shaderball" in long - quick
