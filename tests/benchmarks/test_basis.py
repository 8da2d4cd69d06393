"""The basis benchmark at a small size, so that it keeps working, and its shape, which is documented."""

import json

import pytest
from metamer.benchmarks.basis import FOLDED, GRIDS, RGB, SAMPLING_LIGHTS, report, run, tables

QUESTIONS = ("one_bounce", "two_bounces", "lights_outside", "unseen", "unseen, p95")


@pytest.fixture(scope="module")
def measured():
    return run(sizes=(3, 8), spectra=1000)


@pytest.mark.slow
def test_result_is_json(measured):
    assert json.loads(json.dumps(measured))["lights"][:2] == ["D65", "A"]


def test_lights_folded_first_beat_every_grid_of_samples(measured):
    sampling = measured["sampling"]
    assert set(sampling) == {FOLDED, *GRIDS, RGB}
    for light in SAMPLING_LIGHTS:
        assert sampling[FOLDED][light] < 0.01, light
        assert all(sampling[FOLDED][light] <= sampling[label][light] for label in GRIDS), light
    assert sampling["400-700 / 10 nm"]["FL11"] > 1 and sampling[RGB]["HP1"] > 40


def test_minimax_is_the_smallest_error_at_eight_and_no_worse_where_it_was_not_made_for(measured):
    errors = {question: {name: row[8] for name, row in measured[question].items()} for question in QUESTIONS}
    for question in ("one_bounce", "lights_outside"):
        assert min(errors[question], key=errors[question].get) == "minimax", errors[question]
    for question in QUESTIONS:
        assert errors[question]["balanced"] < errors[question]["peercy"], question
        # The gain for its own spectra is paid, in part, by those that it was not made for.
        assert errors[question]["minimax"] < 1.25 * errors[question]["balanced"], question
    assert errors["one_bounce"]["balanced"] <= 0.30


def test_tables_have_as_many_cells_as_columns(measured):
    for title, header, rows in tables(measured):
        assert rows and all(len(row) == len(header) for row in rows), title


def test_report_keeps_columns_under_each_other(measured):
    lines = report(measured).splitlines()
    start = lines.index("Basis of J coefficients, 14 lights")
    assert lines[start + 1].split()[:2] == ["J", "minimax"]
    first, second = lines[start + 3], lines[start + 4]
    assert len(first) == len(second) and first.rindex(".") == second.rindex(".")
    assert not any(line.endswith(" ") for line in lines)
