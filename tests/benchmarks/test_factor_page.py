"""Plots of the factorisation benchmark's page, from made-up figures."""

import pytest
from metamer.benchmarks.factor.page import growth_plots, method_plots, polar_plots, scatter_plots, two_surface_plot


def point(kind, p99, **more):
    found = {"delta_e94": {"D65": {"p99": p99}}, "fit_seconds": 1.0, "ms_per_megapixel": 10.0}
    return {"case": "paint", "kind": kind, "configuration": kind, **found, **more}


def test_points_of_the_paper_have_marks_and_no_numbers():
    points = [point("paper", 9.0, frame="io", method="joint", packs=1), point("ranks", 1.0), point("spectra", 2.0)]
    (plot,) = scatter_plots(points)
    assert [found["kind"] for found in plot["points"]] == ["ranks", "spectra"]
    assert plot["kinds"] == ["ranks", "spectra", "paper"] and len(plot["plots"]) == 2
    for drawn in plot["plots"]:
        assert len(drawn["marks"]) == 3 and [label["text"] for label in drawn["labels"]] == ["1", "2"]
    # Colour is not all that tells kinds apart.
    assert len({mark["path"] for mark in plot["plots"][0]["marks"]}) == 3


def test_points_without_seconds_are_drawn_against_milliseconds_alone():
    (plot,) = scatter_plots([point("filtering", 1.0, fit_seconds=None), point("filtering", 0.5, fit_seconds=None)])
    assert [drawn["x_label"] for drawn in plot["plots"]] == ["milliseconds a megapixel"]


def test_methods_are_lines_and_ours_is_a_point():
    points = [
        *(point("paper", 8.0 / packs, frame="io", method="joint", packs=packs) for packs in (1, 2, 4)),
        point("ranks", 1.0),
    ]
    needed = [{"case": "paint", "light": "D65", "p99": 0.5, "ours": 2}]
    (shown,) = method_plots(points, needed)
    (plot,) = shown["plots"]
    assert [(line["name"], len(line["places"])) for line in plot["lines"]] == [("here", 1), ("io, joint", 3)]
    assert shown["case"] == "paint" and plot["light"] == "D65"


def test_growth_has_seconds_bytes_and_errors_for_each_direction_there_is():
    rows = [
        {
            "over": "rank",
            "rank": rank,
            "seconds": rank,
            "peak_bytes": 2e6,
            "table_bytes": 1e6,
            "relative_error": 1 / rank,
        }
        for rank in (4, 8)
    ]
    (shown,) = growth_plots(rows)
    assert shown["over"] == "rank" and [plot["y_label"] for plot in shown["plots"]] == [
        "seconds",
        "MB",
        "relative error",
    ]
    assert [line["name"] for line in shown["plots"][1]["lines"]] == ["at most held", "the table"]
    assert growth_plots([]) == []


def test_two_surfaces_without_figures_have_no_plot():
    assert two_surface_plot([]) is None
    rows = [{"J": size, "max": 1.0 / size, "max_fluorescent": 0.5 / size, "peercy_max": 9.0 / size} for size in (3, 8)]
    plot = two_surface_plot(rows)
    assert plot is not None and len(plot["lines"]) == 3


@pytest.mark.parametrize("top", [0.03, 0.4, 2.0, 7.9])
def test_polar_rings_are_few_and_round(top):
    polar = {"angles_deg": [-60.0, 0.0, 60.0], "incidence_deg": [30.0], "radii": {"reference": [[0.1 * top, top, 0.2]]}}
    (plot,) = polar_plots(polar)
    assert 1 <= len(plot["rings"]) <= 4
    # The light stands on the right.
    assert plot["light"][0] > 0 > plot["light"][1]
