"""The fluorescence benchmark on the dyes made up for it, and on the real image where there is one."""

import json

import pytest
from metamer.benchmarks import fluorescence


@pytest.fixture(scope="module")
def rows():
    return fluorescence.two_surfaces(fluorescence.made_up(), (3, 8, 16))


def test_more_numbers_less_error_and_less_than_peercy(rows):
    assert [row["J"] for row in rows] == [3, 8, 16]
    assert rows[0]["max"] > rows[1]["max"] > rows[2]["max"], rows
    assert rows[1]["max"] < 1.2 and rows[2]["max"] < 0.02, rows
    assert all(row["max"] < 0.3 * row["peercy_max"] for row in rows), rows


def test_direct_light_as_text_and_json(rows, tmp_path):
    direct = fluorescence.direct(fluorescence.made_up())
    assert {row["light"] for row in direct} == {"D65", "A", "D65 UV-free", "FL11"} and len(direct) == 8
    assert all(row["diagonal"] > 2 for row in direct), direct
    figures = {"direct": direct, "two_surfaces": rows}
    assert json.loads(json.dumps(figures)) == figures
    lines = fluorescence.report(figures).splitlines()
    assert lines[0].startswith("Direct light") and not any(line.endswith(" ") for line in lines)


def test_real_sticky_notes(shared_data, tmp_path, capsys):
    file = shared_data / "spectra" / "exr" / "BiSpectral.exr"
    assert fluorescence.main([str(file), "--json", str(tmp_path / "out.json")]) == 0
    assert "Two surfaces" in capsys.readouterr().out
    figures = json.loads((tmp_path / "out.json").read_text())
    assert len(figures["direct"]) == 8
    by_size = {row["J"]: row for row in figures["two_surfaces"]}
    assert by_size[8]["max_fluorescent"] < 0.4 and by_size[12]["max"] < 0.1, by_size
