"""The benchmark of decompositions at a small size, so that it keeps working; no figure is judged here."""

import importlib.util
from pathlib import Path

import pytest

FILE = Path(__file__).resolve().parents[2] / "benchmarks" / "decompose.py"


@pytest.fixture(scope="module")
def benchmark_module():
    pytest.importorskip("tensorly")
    spec = importlib.util.spec_from_file_location("decompose_benchmark", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_both_sides_are_run_and_compared_on_the_same_table(benchmark_module):
    rows = benchmark_module.run(shape=(12, 14, 12, 4), rank=3, iterations=5)
    assert [row["case"] for row in rows] == list(benchmark_module.CASES)
    for row in rows:
        assert row["times_faster"] == pytest.approx(row["tensorly"]["seconds"] / row["seconds"])
        assert row["relative_error"] == pytest.approx(row["declared_error"], rel=1e-3)
        assert row["relative_error"] <= 1.05 * row["tensorly"]["relative_error"]
        assert benchmark_module.line(row)
