"""`metamer bench`: figures as text and as JSON; the benchmarks themselves are tested in tests/benchmarks."""

import json

import pytest
from metamer.benchmarks import basis, false_alarms, heads, injected_changes, shading
from metamer.benchmarks.btf import benchmark as btf
from metamer.benchmarks.factor import benchmark
from metamer.benchmarks.svbrdf import benchmark as svbrdf


@pytest.fixture(scope="module")
def small():
    return basis.run(sizes=(8,), spectra=200)


def test_basis_prints_and_writes_the_same_figures(metamer, small, monkeypatch, tmp_path):
    monkeypatch.setattr(basis, "run", lambda: small)
    code, out, _ = metamer("bench", "basis", "--json", tmp_path / "bench.json")
    assert code == 0
    assert "Basis of J coefficients" in out and str(tmp_path / "bench.json") in out
    written = json.loads((tmp_path / "bench.json").read_text())
    assert set(written) == {"basis"}
    assert written["basis"]["one_bounce"]["balanced"]["8"] == small["one_bounce"]["balanced"][8] <= 0.30
    assert {"balanced", "peercy"} <= set(written["basis"]["one_bounce"])


def test_all_runs_both(metamer, small, monkeypatch, gl, tmp_path):
    timed = shading.run(size=16, rank=2, repeats=1)
    monkeypatch.setattr(basis, "run", lambda: small)
    monkeypatch.setattr(shading, "run", lambda: timed)
    code, out, _ = metamer("bench", "--json", tmp_path / "bench.json")
    assert code == 0
    assert "Basis of J coefficients" in out and "folded / RGB" in out
    assert json.loads((tmp_path / "bench.json").read_text())["shading"] == timed


def test_catalogue_asks_for_so_many_materials(metamer, monkeypatch, tmp_path):
    row = {"query": "nearest", "cold_s": 0.1, "warm_s": 0.01, "after_a_change_s": 0.02, "peak_mb": 150.0}
    figures = {"built_s": 2.0, "built_per_s": 3.5, "index_mb": 0.6, "rows": [row]}
    monkeypatch.setattr(heads, "run", lambda materials, say: figures | {"materials": materials})
    code, out, _ = metamer("bench", "catalogue", "--materials", 7, "--json", tmp_path / "bench.json")
    assert code == 0 and "7 materials: index built in 2.0 s" in out
    assert json.loads((tmp_path / "bench.json").read_text()) == figures | {"materials": 7}
    assert metamer("bench", "catalogue", "--materials", 0)[0] == 64


def test_shading_without_gl_is_said(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    code, _, err = metamer("bench", "shading")
    assert code == 4
    assert "apt-get install" in err


def test_folder_that_is_a_file(metamer, small, monkeypatch, tmp_path):
    monkeypatch.setattr(basis, "run", lambda: small)
    (tmp_path / "file").touch()
    code, _, err = metamer("bench", "basis", "--json", tmp_path / "file" / "bench.json")
    assert code == 4
    assert str(tmp_path / "file") in err


def test_factor_writes_rows_at_the_top_and_a_page(metamer, monkeypatch, tmp_path):
    asked = {}

    def run(cases, **options):
        asked.update(options, cases=cases)
        row = {
            "case": "matt",
            "light": "D65",
            "frames": ["io"],
            "packs": 1,
            "rank": 4,
            "fit_seconds": 0.5,
            "table_bytes": 8,
            "peak_bytes": 8,
            "relative_error": 0.1,
            "delta_e94": {"mean": 0.1, "p95": 0.2, "p99": 0.3, "max": 0.4},
            "ms_per_megapixel": 1.0,
            "baseline": {
                "tensorly_seconds": None,
                "tensorly_relative_error": None,
                "dbrdf_delta_e94": {"mean": 1.0, "p95": 2.0, "p99": 3.0, "max": 4.0},
            },
        }
        words = dict.fromkeys(("renderer", "timing", "protocol", "dbrdf", "tensorly"), "words")
        lists = {name: [] for name in ("points", "packs_needed", "speed", "growth", "figures")}
        return {"rows": [row], **lists, "fluorescence": {"without": []}, **words}

    monkeypatch.setattr(benchmark, "run", run)
    monkeypatch.delenv("METAMER_DATA", raising=False)
    json_file, page = tmp_path / "f.json", tmp_path / "f.html"
    code, out, _ = metamer("bench", "factor", "--cases", "matt", "--json", json_file, "--html", page, "--no-points")
    assert code == 0
    assert asked["cases"] == ("matt",) and asked["data"] is None and not asked["points"] and not asked["baseline"]
    assert not asked["growth"]
    assert "every row" in out
    written = json.loads(json_file.read_text())
    assert written["rows"][0]["case"] == "matt" and "figures" not in written
    assert "<!DOCTYPE html>" in page.read_text(encoding="utf-8")


def test_factor_takes_measured_data_from_the_environment_and_the_full_sizes(metamer, monkeypatch, tmp_path):
    asked = {}

    def run(cases, **options):
        asked.update(options, cases=cases)
        raise KeyboardInterrupt

    monkeypatch.setattr(benchmark, "run", run)
    monkeypatch.setenv("METAMER_DATA", str(tmp_path))
    metamer("bench", "factor", "--growth", "--baseline")
    assert asked["cases"] is None and asked["data"] == tmp_path and asked["growth"] and asked["baseline"]
    metamer("bench", "factor", "--data", tmp_path / "other")
    assert asked["data"] == tmp_path / "other" and not asked["growth"]


def test_factor_names_the_cases_that_there_are(metamer, monkeypatch):
    monkeypatch.delenv("METAMER_DATA", raising=False)
    code, _, err = metamer("bench", "factor", "--cases", "velvet")
    assert code == 64
    assert "velvet" in err and "oren-nayar-0.52" in err


def test_svbrdf_prints_and_writes_its_rows(metamer, monkeypatch, tmp_path):
    row = {
        "case": "gold 0.2, wall", "method": "paper", "light": "sun", "lobes": 4,
        "delta_e94": {"mean": 1.0, "p95": 2.0, "p99": 3.0}, "reference_noise": 0.0,
        "cpu_seconds_per_1000_vertices": None, "bytes_per_vertex": None, "ms_per_megapixel": 7.0,
    }  # fmt: skip
    figures = {"missing": ["studio"], "notes": ["12 fits"], "rows": [row]}
    asked = []
    monkeypatch.setattr(svbrdf, "run", lambda *given: asked.append(given) or figures)
    monkeypatch.delenv("METAMER_DATA", raising=False)
    code, out, _ = metamer("bench", "svbrdf", "--case", "gold*", "--json", tmp_path / "bench.json")
    assert code == 0
    ((full, data, _, pattern, catalogue),) = asked
    assert (full, data, pattern, catalogue) == (False, None, "gold*", None)
    assert "gold 0.2, wall" in out and "12 fits" in out and "set METAMER_DATA" in out
    assert json.loads((tmp_path / "bench.json").read_text()) == {"rows": [row]}


def test_svbrdf_opens_a_catalogue_where_materials_are_asked_for(metamer, tmp_path):
    code, _, err = metamer("bench", "svbrdf", "--case", "metal/*", "--catalogue", tmp_path / "none")
    assert code == 4 and "no such catalogue" in err


def test_btf_prints_and_writes_its_rows(metamer, monkeypatch, tmp_path):
    row = {
        "case": "wool", "method": "lpca", "texels": 16384, "bytes_per_texel": 29.0, "fit_cpu_seconds": 40.0,
        "fold_ms": None, "ms_per_megapixel": 300.0, "light": "D65", "delta_e94": {"mean": 2.5, "p95": 4.0, "p99": 6.0},
        "epsilon": 0.02, "published_epsilon": None, "registered": True,
        "size": "medium", "dictionary_bytes": None, "offset": 4.1, "bar": {"mean": 2.1, "p95": 4.7, "p99": 6.8},
    }  # fmt: skip
    asked, figures = [], {"missing": ["corduroy"], "rows": [row], "claims": []}
    monkeypatch.setattr(btf, "run", lambda *given: asked.append(given) or figures)
    monkeypatch.setenv("METAMER_DATA", str(tmp_path))
    words = ["--case", "wool", "--method", "lpca*", "--texels", "256", "--full", "--json", tmp_path / "bench.json"]
    code, out, _ = metamer("bench", "btf", *words)
    assert code == 0
    ((full, data, _, case, method, texels),) = asked
    assert (full, data, case, method, texels) == (True, tmp_path, "wool", "lpca*", 256)
    assert "2.1/4.7/6.8 over" in out and "without corduroy" in out
    assert json.loads((tmp_path / "bench.json").read_text()) == {"rows": [row]}


def test_btf_names_the_cases_that_there_are(metamer, monkeypatch):
    monkeypatch.delenv("METAMER_DATA", raising=False)
    code, _, err = metamer("bench", "btf", "--case", "velvet")
    assert code == 64 and "velvet" in err and "synthetic-leather" in err


@pytest.mark.parametrize(("more", "size", "repeats"), [((), 24, 8), (("--full",), 64, 24)])
def test_report_measures_what_is_found_and_what_is_not_there(
    metamer, monkeypatch, tiny_catalogue, tmp_path, more, size, repeats
):
    found = {"change": "x", "rows": 3, "found": 3, "below": 0, "missed": 0, "alarms": 3, "size": 0.2, "floor": 0.02}
    found |= {"flip": None}
    quiet = {"renderer": "gl", "threads": 1, "kernel": "Haswell", "rows": 3, "identical": 2, "same": 1, "alarms": 0}
    quiet |= {"mean": 0.001, "floor_mean": 0.02, "max": 0.01, "floor_max": 0.1}
    asked = []
    changed, unchanged = {"materials": 1, "size": 24, "rows": [found]}, {"size": 24, "kernels": ["a"], "rows": [quiet]}
    monkeypatch.setattr(injected_changes, "run", lambda *words: asked.append(words) or changed)
    monkeypatch.setattr(false_alarms, "run", lambda *words, say: asked.append(words) or unchanged)
    words = ["--materials", "tiny/*", "--catalogue", tiny_catalogue, "--json", tmp_path / "bench.json"]
    code, out, _ = metamer("bench", "report", *more, *words)
    assert code == 0 and "below the floor" in out and "1 repeats, 3 rows, 0 false alarms" in out
    assert asked[0][:3] == (tiny_catalogue, "tiny/*", size) and asked[1] == (tiny_catalogue, "tiny/*", size, repeats)
    assert json.loads((tmp_path / "bench.json").read_text()) == {"injected": changed, "false_alarms": unchanged}
