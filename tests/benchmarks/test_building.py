"""The benchmark of building rays, small."""

import json

from metamer.benchmarks.transfer import building


def test_its_figures(tmp_path, capsys):
    file = tmp_path / "found.json"
    assert building.main(["--rays", "8", "--most", "4000", "--times", "1", "--json", str(file)]) == 0
    rows = json.loads(file.read_text())
    assert [row["vertices"] for row in rows] == [4 + 3 * 642 + 4, 4 + 6 * 642 + 4]
    assert rows[0]["bytes_beside_first"] == 1.0
    assert abs(rows[1]["bytes_beside_first"] - 1.0) < 0.2
    assert "beside the first" in capsys.readouterr().out
