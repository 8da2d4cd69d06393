"""The benchmark of injected changes, small: what it puts in is found, and nothing else."""

import json

import numpy as np
from metamer.benchmarks import injected


def test_each_change_is_found_and_nothing_is_not(write_matt, tmp_path):
    write_matt(tmp_path, "paint/red", np.linspace(0.1, 0.6, 81))
    found = injected.run(tmp_path, size=16)
    assert json.loads(json.dumps(found)) == found and found["materials"] == 1
    rows = {row["change"]: row for row in found["rows"]}
    assert (rows["nothing"]["found"], rows["nothing"]["alarms"]) == (0, 0)
    assert "other observers" in rows["swapped observer"]["refused"]
    # Under D65 a metamer is none; its two other rows are found.
    assert rows["metamer under D65"]["found"] >= 2
    others = rows.keys() - {"nothing", "swapped observer", "metamer under D65"}
    assert all(rows[name]["found"] == rows[name]["rows"] == 3 for name in others), rows
    assert "drift" in injected.report(found)
