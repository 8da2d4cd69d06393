"""The benchmark of interreflection: rows, scenes and errors, on small ones."""

import json

import numpy as np
import pytest
from metamer.benchmarks.transfer import benchmark, ours, scenes
from metamer.benchmarks.transfer.pixels import difference, seen_sites, truth_of
from metamer.lighting.shapes import sphere
from metamer.lighting.transfer.hits import scene_hits
from metamer.materials.tensors.brdf_tensor import brdf_tensor
from metamer.materials.tensors.components import components_of
from metamer.materials.tensors.disc import Disc
from metamer.materials.tensors.tuned import Tuned
from metamer.spectral.errors import InputError

CT = scenes.family()


@pytest.fixture(scope="module")
def small():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(scenes, "SIDE", 16)
        patched.setattr(scenes, "sphere", lambda fineness: sphere(1))
        patched.setattr(benchmark, "QUICK", (24, 8, 0.8))
        patched.setattr(benchmark, "OUR_RAYS", ((32,), (32,)))
        patched.setattr(benchmark, "OUR_BOUNCES", (0, 1, None))
        patched.setattr(ours, "ALL", 3)
        patched.setattr(ours, "SITES", 24)
        patched.setattr(ours, "PATHS", 64)
        patched.setattr(benchmark, "shared_by_all", lambda: (brdf_tensor(CT, disc=Disc(10)), components_of(CT)))
        yield benchmark.run()


def test_rows_have_what_is_promised(small):
    papers = [row for row in small["rows"] if row["method"] == "paper"]
    assert [row["bounces"] for row in papers] == [0, 1, 2]
    ours = [(row["bounces"], row["at"]) for row in small["rows"] if row["method"] == "ours"]
    assert ours == [(0, "pixels"), *((n, at) for n in (1, "all") for at in ("pixels", "sites"))]
    for row in small["rows"]:
        assert (row["scene"], row["light"], row["method"], row["regions"]) == ("table", "sky", row["method"], 5)
        assert row["vertices"] > 100 and row["bytes"] > 1e4 and row["precompute_cpu_seconds"] > 0.0
        assert set(row["relight_ms"]) - {"matt"} == {"view", "material", "light", "all"}
        assert row["relight_ms"]["all"] >= row["relight_ms"]["view"] > 0.0
        off = row["delta_e94"]
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
    hits = scene_hits(case.scene, 16, longest_edge=0.3)
    seen = seen_sites(case.scene, hits, 0.3)
    assert len(seen.pixel) > 0.3 * scenes.SIDE**2
    np.testing.assert_allclose(seen.shares.sum(axis=1), 1.0, rtol=1e-9)
    truth = truth_of(scenes.TransferScene("matt", "sky", case.scene, matt), 0, lambda line: None)
    # Between sites, places are what places are.
    low, high = case.scene.bounds
    places = hits.sites.starts * (0.5 * np.linalg.norm(high - low)) + 0.5 * (low + high)
    to = seen.picture(places) - np.asarray(case.scene.camera().position)
    assert (np.linalg.norm(to, axis=1) < 5.0).all()
    assert difference(case, truth, seen, np.zeros((len(places), 3))).mean() > 20.0
