"""The benchmark of interreflection: rows, scenes and errors, on small ones."""

import json
import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from metamer.benchmarks.papers.transfer_tensors.brdf_tensor import brdf_tensor
from metamer.benchmarks.papers.transfer_tensors.components import components_of
from metamer.benchmarks.papers.transfer_tensors.disc import Disc
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.benchmarks.timing import best_ms
from metamer.benchmarks.transfer import (
    bars,
    benchmark,
    growth,
    ours,
    path_tracing,
    pixels,
    scenes,
    spectral,
    tensors,
    whole_pictures,
)
from metamer.benchmarks.transfer.pixels import pixel_differences, seen_sites, truth_of
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.visibility import precompute, refinement
from metamer.materials.fitting.fit import fit
from metamer.runtime.errors import InputError

pytestmark = pytest.mark.slow

CT = scenes.family()


@pytest.fixture(scope="module")
def small():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(scenes, "SIDE", 16)
        patched.setattr(scenes, "sphere", lambda fineness: sphere(1))
        patched.setattr(benchmark, "QUICK", (24, 8, 1e8))
        patched.setattr(benchmark, "QUICK_EDGE", 0.8)
        patched.setattr(tensors, "_FINEST", 1.6)
        patched.setattr(tensors, "best_ms", partial(best_ms, times=1))
        patched.setattr(ours, "best_ms", partial(best_ms, times=1))
        patched.setattr(benchmark, "OUR_RAYS", ((32,), (32,)))
        patched.setattr(benchmark, "OUR_BOUNCES", (0, 1, None))
        patched.setattr(ours, "ALL", 3)
        patched.setattr(pixels, "ALL", 3)
        patched.setattr(ours, "SITES", 24)
        patched.setattr(ours, "PATHS", 64)
        # The renderer's picture.
        patched.setattr(refinement, "MOST_VERTICES", 400)
        patched.setattr(precompute, "_TRAINING", 400)
        patched.setattr(whole_pictures, "fit", partial(fit, budget=2.0, pixels=32))
        patched.setattr(benchmark, "shared_by_all", lambda: (brdf_tensor(CT, disc=Disc(6)), components_of(CT)))
        yield benchmark.run()


def test_rows_have_what_is_promised(small):
    papers = [row for row in small["rows"] if row["method"] == "paper"]
    assert [row["bounces"] for row in papers] == [0, 1, 2]
    ours = [(row["bounces"], row["at"]) for row in small["rows"] if row["method"] == "ours"]
    assert ours == [(0, "pixels"), *((n, at) for n in (1, "all") for at in ("pixels", "sites")), ("all", "renderer")]
    for row in small["rows"]:
        assert (row["scene"], row["light"], row["method"], row["regions"]) == ("table", "sky", row["method"], 5)
        assert row["vertices"] > 100 and row["bytes"] > 1e4 and row["precompute_cpu_seconds"] > 0.0
        if row["at"] == "renderer":
            assert not row["relight_ms"] and row["delta_e94"]["p95"] < 4.0
        else:
            assert set(row["relight_ms"]) - {"matt"} == {"view", "material", "light", "all"}
            assert row["relight_ms"]["all"] >= row["relight_ms"]["view"] > 0.0
        off = row["delta_e94"]
        if row["at"] == "sites":
            assert {"mean", "p95", "p99"} == set(row["delta_e94_matt"]) == set(row["delta_e94_glossy"])
        if row["method"] == "ours" and row["bounces"] == 0:
            # The paths' own direct light, and nothing beside.
            assert off["p99"] == 0.0
        else:
            assert 0.0 < off["mean"] < off["p95"] <= off["p99"]
        assert 0.0 < row["reference_noise"] < 1.0
    json.dumps(small)


def test_the_table_says_what_the_paper_says(small):
    text = benchmark.report(small)
    assert "Tweety" in text and "noise" in text and "table" in text


def test_another_scene_is_refused():
    with pytest.raises(InputError, match="no scene is called so"):
        benchmark.run(case="kitchen")


def test_scenes_are_what_they_are_called(monkeypatch):
    monkeypatch.setattr(scenes, "SIDE", 16)
    found = scenes.scenes(full=True)
    assert [(one.name, one.light) for one in found[::3]] == [("table", "sky"), ("box", "sky"), ("car", "sky")]
    for one in found:
        assert len(one.scene.parts) == len(one.materials) >= 5
        assert len(one.scene.lights[0].spectra) == (2 if one.light == "two-lamps" else 1)
        for tuned in one.materials.values():
            # Nothing sends out more than it receives.
            assert (tuned.diffuse + tuned.specular * (tuned.parameters[0] + 0.3) <= 1.35).all()


def test_matt_pixels_are_the_paths():
    """The truth and what lies between sites, of a scene without highlights and without bounces."""
    case = scenes.scenes(full=False)[0]
    matt = {
        name: Tuned(one.wavelengths_nm, one.diffuse, np.zeros_like(one.diffuse), one.family, one.parameters)
        for name, one in case.materials.items()
    }
    bodies = placed(case.scene, 0.3)
    hits = bodies.traced(16)
    seen = seen_sites(bodies.scene, hits)
    assert len(seen.pixel) > 0.3 * scenes.SIDE**2
    np.testing.assert_allclose(seen.shares.sum(axis=1), 1.0, rtol=1e-9)
    truth = truth_of(scenes.TransferScene("matt", "sky", case.scene, matt, 0.3), 0, lambda line: None)
    # Between sites, places are what places are.
    low, high = case.scene.bounds
    places = hits.sites.starts * (0.5 * np.linalg.norm(high - low)) + 0.5 * (low + high)
    to = seen.picture(places) - np.asarray(case.scene.camera().position)
    # The far corner of the floor is 5.12 off.
    assert (np.linalg.norm(to, axis=1) < 5.13).all()
    assert pixel_differences(case, truth, seen, np.zeros((len(seen.pixel), 3))).mean() > 20.0


def test_the_price_of_the_spectrum(monkeypatch):
    monkeypatch.setattr(spectral, "RAYS", 16)
    monkeypatch.setattr(spectral, "TIMES", 1)
    monkeypatch.setattr(spectral, "scenes", coarse)
    rows = spectral.coefficient_rows(lambda line: None, ("table",))
    assert [row["light"] for row in rows] == ["D65", "A", "FL11"]
    for row in rows:
        assert 0.0 < row["delta_e94"]["mean"] <= row["delta_e94"]["max"] <= 0.1
        assert 3 < row["coefficients"] < 81 and row["rgb_surcharge"] > 0.0


def coarse(full):
    """The scenes with few sites."""
    return [replace(one, longest_edge=0.8) for one in scenes.scenes(full)]


def test_growth_is_beside_the_first():
    few, more = growth.growth_rows(lambda line: None, (3, 6), 8)
    assert few["beside_first"]["bytes"] == 1.0
    assert more["beside_first"]["bytes"] == pytest.approx(1.0, abs=0.01)
    assert more["vertices"] > 1.9 * few["vertices"]


def test_mitsuba_is_held_to_our_error(monkeypatch):
    """At few paths: the colours are the same, and what is needed follows from the noise."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if "scalar_spectral" not in pytest.importorskip("mitsuba", reason="needs the mitsuba extra").variants():
            pytest.skip("this Mitsuba has no scalar_spectral variant")
    monkeypatch.setattr(path_tracing, "VARIANT", "scalar_spectral")
    monkeypatch.setattr(path_tracing, "ALL", 3)
    monkeypatch.setattr(scenes, "SIDE", 16)
    own, theirs = path_tracing.path_rows(lambda line: None, 64, 32, 0.4)
    assert theirs["delta_e94"]["p95"] == pytest.approx(own["delta_e94"]["p95"])
    assert theirs["level"] == pytest.approx(1.0, abs=0.03)
    assert theirs["faster"] == pytest.approx(theirs["relight_ms"]["light"] / own["relight_ms"]["light"])
    assert theirs["rays"] > 0


def test_without_mitsuba_its_row_is_left_out_and_said(monkeypatch):
    monkeypatch.setattr(path_tracing, "VARIANT", "no_such_variant")
    said = []
    assert path_tracing.path_rows(said.append) == []
    assert "left out" in said[0]


def test_bars_name_the_worst(small):
    def row(light, **more):
        return {"scene": "table", "light": light, "vertices": 13_000, "method": "ours", "at": "wavelengths"} | more

    rows = [
        row(name, rays=256, bounces=4, precompute_cpu_seconds=1.0, bytes=2e7, relight_ms={}, rgb_surcharge=share,
            delta_e94={"max": 0.01})
        for name, share in (("D65", 1.1), ("A", 1.3))
    ]  # fmt: skip
    found = {line[0]: line[1:] for line in bars.bars(rows)}
    assert found["surcharge over RGB"] == ["1.15", "1.3", "table, A, 13,000 sites"]
    assert found["rays kept, 256 rays, MB"][1] == "20"
    # Too few sites for what is said of 13,000, and no bar is made up for what was not measured.
    assert not [line for line in bars.bars(small["rows"]) if line[0].startswith("relight")]
