"""`metamer bench`: figures as text and as JSON; the benchmarks themselves are tested in tests/benchmarks."""

import json

import pytest
from metamer.calibration import basis_benchmark
from metamer.viewer import shading_benchmark


@pytest.fixture(scope="module")
def small():
    return basis_benchmark.run(sizes=(8,), spectra=200)


def test_basis_prints_and_writes_the_same_figures(metamer, small, monkeypatch, tmp_path):
    monkeypatch.setattr(basis_benchmark, "run", lambda: small)
    code, out, _ = metamer("bench", "basis", "--json", tmp_path / "bench.json")
    assert code == 0
    assert "Basis of J coefficients" in out and str(tmp_path / "bench.json") in out
    written = json.loads((tmp_path / "bench.json").read_text())
    assert set(written) == {"basis"}
    assert written["basis"]["one_bounce"]["balanced"]["8"] == small["one_bounce"]["balanced"][8] <= 0.30
    assert {"balanced", "peercy"} <= set(written["basis"]["one_bounce"])


def test_all_runs_both(metamer, small, monkeypatch, gl, tmp_path):
    shading = shading_benchmark.run(size=16, rank=2, repeats=1)
    monkeypatch.setattr(basis_benchmark, "run", lambda: small)
    monkeypatch.setattr(shading_benchmark, "run", lambda: shading)
    code, out, _ = metamer("bench", "--json", tmp_path / "bench.json")
    assert code == 0
    assert "Basis of J coefficients" in out and "folded / RGB" in out
    assert json.loads((tmp_path / "bench.json").read_text())["shading"] == shading


def test_shading_without_gl_is_said(metamer, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    code, _, err = metamer("bench", "shading")
    assert code == 4
    assert "apt-get install" in err


def test_folder_that_is_a_file(metamer, small, monkeypatch, tmp_path):
    monkeypatch.setattr(basis_benchmark, "run", lambda: small)
    (tmp_path / "file").touch()
    code, _, err = metamer("bench", "basis", "--json", tmp_path / "file" / "bench.json")
    assert code == 4
    assert str(tmp_path / "file") in err
