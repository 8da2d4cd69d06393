"""Figures that pages share: histograms of ΔE, shifts as arrows, earlier runs."""

import numpy as np
import pytest
from metamer.calibration.report.histogram import ABOVE, BELOW, histogram, histogram_plot
from metamer.calibration.report.history import Run, earlier_figures, history_text, read_history, trend_plot, with_run
from metamer.calibration.report.shift_plot import SIZE, ShiftArrow, shift_plots
from metamer.calibration.report.statistics import mean_shift


@pytest.mark.parametrize("budget", [1.0, 0.3])
def test_a_histogram_counts_every_pixel_with_a_number_on_its_side_of_the_budget(budget):
    values = budget * np.array([[0.0, 0.5, 1.0, np.nextafter(1.0, 2.0)], [3.0, 1e6, np.inf, np.nan]])
    counts = histogram(values, budget)
    assert len(counts) == BELOW + ABOVE and sum(counts) == 6
    assert sum(counts[:BELOW]) == 3 and counts[0] == 1 and counts[-1] == 1
    plot = histogram_plot(counts, budget)
    assert plot["words"] == f"3 pixels up to ΔE94 {budget:g}, 3 above it"
    assert plot["path"].count("V") == len(counts) + 1


def test_one_pixel_of_thousands_is_seen_in_a_histogram():
    plot = histogram_plot((100_000, *[0] * 26, 1), 1.0)
    tops = [float(bar.partition("h")[0]) for bar in plot["path"].split("V")[1:-1]]
    assert tops == [0.0, *[36.0] * 26, 35.0]
    assert histogram_plot((0,) * 28, 1.0)["words"] == "no pixels"


def test_arrows_are_as_many_times_longer_in_both_planes():
    shifts = [
        ShiftArrow("a", (50.0, 10.0, 0.0), (0.0, 0.3, 0.0)),
        ShiftArrow("b", (60.0, -40.0, 20.0), (0.1, 0.0, 0.0)),
    ]
    found = shift_plots([*shifts, ShiftArrow("none", (np.nan, 0.0, 0.0), (0.0, 0.0, 0.0))])
    factor = found["factor"]
    assert factor in (20, 50) and found["largest"].name == "a"
    for plane, off, axis in zip(found["planes"], ((0.3, 0.0), (0.3, 0.0)), (0, 0), strict=True):
        assert [one["name"] for one in plane["arrows"]] == ["a", "b"]
        start = np.array(plane["arrows"][0]["at"])
        line = plane["arrows"][0]["path"].split("M")[1].partition("L")[2]
        end = np.array([float(number) for number in line.split()])
        ticks = plane["x_ticks"]
        scale = (ticks[1][0] - ticks[0][0]) / (float(ticks[1][1]) - float(ticks[0][1]))
        np.testing.assert_allclose((end - start)[axis], factor * off[0] * scale, atol=0.11)
        assert ((start >= 0.0) & (start <= SIZE)).all()
    assert shift_plots([]) is None
    assert shift_plots([ShiftArrow("still", (50.0, 0.0, 0.0), (0.0, 0.0, 0.0))])["factor"] == 1


def test_the_mean_shift_is_that_of_pixels_with_a_number():
    reference = np.zeros((2, 2, 3))
    sample = reference + np.array([1.0, -2.0, 0.5])
    sample[0, 0] = 99.0
    delta_e = np.array([[np.nan, 1.0], [2.0, 3.0]])
    assert mean_shift(delta_e, reference, sample) == (1.0, -2.0, 0.5)
    assert mean_shift(np.full((2, 2), np.inf), reference, sample) is None


def test_runs_are_kept_in_order_and_one_that_came_out_alike_takes_the_place_of_the_last(tmp_path):
    runs = ()
    for day, p99 in enumerate((0.5, 0.7, 0.7, 0.4), 1):
        runs = with_run(runs, Run(f"2026-01-0{day}T00:00:00+00:00", "1", "pass", {"a@D65": p99, "b@D65": np.inf}))
    assert [(run.created[:10], run.largest) for run in runs] == [
        ("2026-01-01", 0.5),
        ("2026-01-03", 0.7),
        ("2026-01-04", 0.4),
    ]
    assert earlier_figures(runs, "a@D65") == (0.5, 0.7) and earlier_figures(runs, "b@D65") == ()
    path = tmp_path / "history.json"
    path.write_text(history_text(runs), encoding="utf-8")
    assert read_history(path) == runs
    plot = trend_plot(runs, "p99")
    assert plot["words"] == "p99 over 3 runs: largest 0.50 to 0.40; mean 0.50 to 0.40"
    assert trend_plot(runs[:1], "p99") is None


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"schema": "other"}', '{"schema": "metamer.history/1", "runs": [1]}']
)
def test_a_damaged_history_stops_no_work(tmp_path, text):
    path = tmp_path / "history.json"
    assert read_history(path) == ()
    path.write_text(text, encoding="utf-8")
    assert read_history(path) == ()
