"""`metamer bench display`, small."""

import pytest
from metamer.benchmarks.display import benchmark


@pytest.mark.slow
def test_a_row_for_each_number_of_bits(monkeypatch):
    monkeypatch.setattr(benchmark, "MODELS", ("gog",))
    found = benchmark.run(lambda line: None, "CRT", seeds=1, count=40)
    assert [row["bits"] for row in found["rows"]] == [8, 10]
    for row in found["rows"]:
        assert set(row) == {"display", "seed", "model", "bits", "delta_e94", "white", "grey_delta_c", "build_seconds"}
        assert row["delta_e94"]["mean"] < 0.5
    bars = {one["bar"]: one["measured"] for one in found["bars"]}
    assert bars["file against memory"] <= 1e-6 and bars["LUT against the inverse, max"] < 1.0
    assert "worst of all" in benchmark.report(found)
