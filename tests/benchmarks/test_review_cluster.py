"""Speed of a review on a cluster: the schedule that it is simulated by, and a small run."""

from importlib.util import find_spec

import pytest
from metamer.benchmarks.review_cluster import report, run, scheduled, simulated

FIGURES = {"material_s": 1.0, "first_s": 0.0, "client_s": 0.0}


def test_equal_tasks_are_shared_out():
    assert scheduled([1.0] * 12, 1) == 12.0 and scheduled([1.0] * 12, 4) == 3.0 and scheduled([1.0] * 13, 4) == 4.0
    assert scheduled([3.0, 1.0, 1.0, 1.0], 2) == 3.0, "who is free takes the next"


def test_what_each_worker_needs_first_and_the_client_bound_the_speed():
    assert scheduled([1.0, 1.0], 2, first=5.0) == 6.0
    assert scheduled([1.0] * 100, 100, client=0.5) == 51.0
    assert simulated(FIGURES, 1000, 100) == 100.0
    assert simulated({**FIGURES, "client_s": 0.1}, 1000, 100) == pytest.approx(1000.1 / 101.0)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed; it is in the extra `cluster`")
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_small_run():
    figures = run(materials=2)
    assert figures["rows"] == 6 and 0.0 < figures["material_s"] < figures["one_process_s"]
    assert "6 rows" in report(figures) and "10000 materials by workers" in report(figures)
