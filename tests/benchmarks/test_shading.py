"""The shading benchmark at a small size, so that it keeps working; no figure is judged here."""

import json
import runpy
from pathlib import Path

import pytest
from metamer.viewer.shading_benchmark import CARRIED, FOLDED, RGB, SAMPLED, run, tables

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "shading.py"


@pytest.fixture(scope="module")
def measured(request):
    from metamer.viewer.context import NoGL

    try:
        return run(size=32, rank=6, repeats=2)
    except NoGL as reason:
        pytest.skip(str(reason))


def test_result_is_json(measured):
    assert json.loads(json.dumps(measured)) == measured
    assert set(measured["milliseconds"]) == {FOLDED, RGB, CARRIED, SAMPLED}
    assert measured["megapixels"] == pytest.approx(32 * 32 / 1e6)


def test_every_spectral_way_gives_the_same_picture(measured):
    assert measured["largest_difference"] < 1e-5


def test_tables_have_as_many_cells_as_columns(measured):
    for title, header, rows in tables(measured):
        assert rows and all(len(row) == len(header) for row in rows), title


def test_command_prints_and_writes(measured, tmp_path, capsys, monkeypatch):
    benchmark = runpy.run_path(str(BENCHMARK))
    monkeypatch.setattr("metamer.viewer.shading_benchmark.run", lambda *_: measured)
    benchmark["main"](["--json", str(tmp_path / "figures.json")])
    assert FOLDED in capsys.readouterr().out
    assert json.loads((tmp_path / "figures.json").read_text())["rank"] == 6
