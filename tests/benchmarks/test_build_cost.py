"""The benchmark of building rays, small."""

import json

import pytest
from metamer.benchmarks.transfer import build_cost


@pytest.mark.slow
def test_its_figures(tmp_path, capsys):
    file = tmp_path / "found.json"
    assert build_cost.main(["--rays", "8", "--most", "4000", "--times", "1", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())
    # Vertices of the meshes, and some in the middle of edges on which light between parts is not linear.
    for row, balls in zip(rows, (3, 6), strict=True):
        assert 4 + balls * 642 < row["vertices"] < 1.2 * (4 + balls * 642)
    assert rows[0]["bytes_beside_first"] == 1.0
    assert abs(rows[1]["bytes_beside_first"] - 1.0) < 0.2
    assert "beside the first" in capsys.readouterr().out
