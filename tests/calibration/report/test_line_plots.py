"""Scales, lines and labels of plots, by their coordinates."""

import math

import pytest
from metamer.calibration.report.line_plots import SIZE, LogScale, line_plot, merged_labels, runs


def test_scale_holds_every_value_between_round_numbers():
    scale = LogScale([3.0, 40.0], 100.0)
    assert (10.0**scale.low, 10.0**scale.high) == pytest.approx((2.0, 50.0))
    assert scale.at(2.0) == pytest.approx(0.0) and scale.at(50.0) == pytest.approx(100.0)
    assert scale.at(10.0) == pytest.approx(100.0 * math.log(5.0) / math.log(25.0))
    assert [label for _, label in scale.ticks()] == ["2", "5", "10", "20", "50"]


def test_scale_upwards_counts_from_the_bottom():
    scale = LogScale([1.0, 10.0], 100.0, downwards=True)
    assert scale.at(1.0) > scale.at(10.0)


def test_many_decades_have_ticks_at_powers_of_ten_only():
    labels = [label for _, label in LogScale([0.003, 90.0], 100.0).ticks()]
    assert labels == ["0.01", "0.1", "1", "10", "100"]


def test_zero_stands_at_the_floor():
    scale = LogScale([0.0, 1.0], 100.0, floor=1e-3)
    assert 0.0 <= scale.at(0.0) == scale.at(1e-3) < 100.0


def test_one_value_alone_has_a_scale():
    scale = LogScale([4], 100.0)
    assert 0.0 < scale.at(4) < 100.0


def test_lines_go_through_their_points_and_one_point_has_none():
    plot = line_plot({"ours": [(1, 2.0)], "theirs": [(1, 4.0), (8, 1.0)]}, "packs", "error")
    ours, theirs = plot["lines"]
    assert ours["path"] == "" and len(ours["places"]) == 1
    assert theirs["path"].startswith("M") and theirs["path"].count("L") == 1
    (across, down), (_, lower) = theirs["places"]
    assert 0 <= across <= SIZE[0] and 0 <= down < lower <= SIZE[1]
    assert ours["number"] != theirs["number"]


def test_labels_of_points_in_one_place_are_merged():
    labels = merged_labels(
        [(10.0, 10.0), (12.0, 11.0), (11.0, 10.0), (200.0, 10.0), (0.95 * SIZE[0], 9.0)], range(1, 6)
    )
    assert [label["text"] for label in labels] == ["1–3", "4", "5"]
    assert [label["anchor"] for label in labels] == ["start", "start", "end"]


def test_runs_of_two_stay_apart():
    assert runs([4, 5]) == ["4", "5"] and runs([]) == []
