"""The benchmark of false alarms, small: nothing has changed, and nothing is said to have."""

import json

import numpy as np
import pytest
from metamer.benchmarks import false_alarms
from metamer.runtime.errors import InputError


@pytest.mark.slow
def test_no_alarm_between_two_ways_of_rounding(write_matt, tmp_path, gl):
    del gl  # Without it half of the repeats are missing.
    write_matt(tmp_path, "paint/red", np.linspace(0.1, 0.6, 81))
    kernels = false_alarms.kernels_here()
    if len(kernels) < 2:
        pytest.skip("one kernel of BLAS runs here")
    found = false_alarms.run(tmp_path, size=16, repeats=4, kernels=kernels, crossed=False)
    assert json.loads(json.dumps(found)) == found
    ways = {(row["renderer"], row["threads"], row["kernel"]) for row in found["rows"]}
    assert ways == {(name, *way) for name in ("gl", "software") for way in ((1, kernels[0]), (2, kernels[1]))}
    for row in found["rows"]:
        assert (row["rows"], row["alarms"], row["identical"] + row["same"]) == (3, 0, 3)
        assert row["mean"] <= row["floor_mean"]
    # The renderer that recorded the baseline gives the same bytes again.
    assert sum(row["identical"] for row in found["rows"] if row["renderer"] == "software") >= 3
    assert "4 repeats, 12 rows, 0 false alarms" in false_alarms.report(found)


def test_one_kernel_is_none_to_compare_with(tmp_path):
    with pytest.raises(InputError, match="two of OpenBLAS"):
        false_alarms.run(tmp_path, kernels=("Haswell",))


@pytest.mark.slow
def test_a_process_that_fails_is_told_of(tmp_path):
    with pytest.raises(InputError, match="no such catalogue"):
        false_alarms.run(tmp_path / "none", kernels=("Haswell", "Prescott"))
