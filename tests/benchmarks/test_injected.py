"""The benchmark of injected changes, small: what it puts in is found or below its floor, and nothing else is."""

import importlib.util
import json

import numpy as np
import pytest
from metamer.benchmarks import injected_changes


@pytest.mark.slow
def test_each_change_is_found_or_below_its_floor_and_nothing_is_not(write_matt, tmp_path):
    write_matt(tmp_path, "paint/red", np.linspace(0.1, 0.6, 81))
    found = injected_changes.run(tmp_path, size=16)
    assert json.loads(json.dumps(found)) == found and found["materials"] == 1
    rows = {row["change"]: row for row in found["rows"]}
    assert (rows["nothing"]["found"], rows["nothing"]["below"], rows["nothing"]["alarms"]) == (0, 0, 0)
    assert "other observers" in rows["observer swapped"]["refused"]
    assert "different whites" in rows["observer swapped, and not said"]["refused"]
    compared = [row for row in rows.values() if "refused" not in row]
    assert all(row["rows"] == 3 and row["missed"] == 0 for row in compared)
    for name in ("light turned by 0.5 degrees", "one wrong pixel, ΔE94 5", "a drift of ΔE94 0.2"):
        assert rows[name]["found"] == rows[name]["alarms"] == 3, name
    # A metamer is one under D65 alone; a pixel that half precision cannot tell is not claimed.
    assert rows["a metamer under D65"]["found"] >= 2
    assert rows["one wrong pixel, ΔE94 0.05"]["below"] == 3
    assert rows["1 % of one band, 600 nm"]["size"] < rows["1 % of one band, 600 nm"]["floor"]
    assert "drift" in injected_changes.report(found)
    # Beside it, where the extra is there, what FLIP sees on a display: more of a drift of 0.2 than of one of 0.01.
    if importlib.util.find_spec("flip_evaluator") is not None:
        drifts = [rows[f"a drift of ΔE94 {size}"]["flip"] for size in (0.01, 0.2)]
        assert 0.0 == rows["nothing"]["flip"] <= drifts[0] < drifts[1] < 0.05
