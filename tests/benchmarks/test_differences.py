"""The benchmark of colour differences, small, so that it keeps working; no time is judged here."""

import json

from metamer.benchmarks import differences


def test_each_formula_is_measured_beside_colour_science():
    found = differences.run(width=50, height=80, repeats=1)
    assert json.loads(json.dumps(found)) == found and found["pixels"] == [50, 80]
    assert [row["formula"] for row in found["rows"]] == ["CIE 1994", "CIE 2000", "CAM16-UCS"]
    for row in found["rows"]:
        assert row["off"] < (0.05 if row["formula"] == "CAM16-UCS" else 1e-3)
        assert min(row["ms"].values()) > 0.0 and row["ratio"] > 0.0
    assert "colour-science" in differences.report(found)
