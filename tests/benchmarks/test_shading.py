"""The shading benchmark at a small size, so that it keeps working; no figure is judged here."""

import json

import pytest
from metamer.benchmarks.shading import CARRIED, FOLDED, RGB, SAMPLED, run, tables


@pytest.fixture(scope="module")
def measured(request):
    from metamer.viewer.gl.context import NoGL

    try:
        return run(size=32, rank=6, repeats=2)
    except NoGL as reason:
        pytest.skip(str(reason))


def test_result_is_json(measured):
    assert json.loads(json.dumps(measured)) == measured
    assert set(measured["milliseconds"]) == {FOLDED, RGB, CARRIED, SAMPLED}
    assert measured["megapixels"] == pytest.approx(32 * 32 / 1e6)


def test_every_spectral_way_gives_the_same_picture(measured):
    assert measured["largest_difference"] < 1e-5


def test_tables_have_as_many_cells_as_columns(measured):
    for title, header, rows in tables(measured):
        assert rows and all(len(row) == len(header) for row in rows), title
