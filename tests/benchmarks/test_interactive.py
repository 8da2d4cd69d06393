"""The benchmark of another light and another camera, small, so that it keeps working; no time is judged here."""

import json

import pytest
from metamer.benchmarks.interactive import CAMERA, LIGHT, report, run


def test_it_measures_both():
    from metamer.viewer.gl.context import NoGL

    try:
        measured = run(width=32, height=24, samples=2, subdivisions=2, repeats=2)
    except NoGL as reason:
        pytest.skip(str(reason))
    assert json.loads(json.dumps(measured)) == measured
    assert all(measured[name][key] > 0 for name in (LIGHT, CAMERA) for key in ("kept_ms", "else_ms", "faster"))
    assert LIGHT in report(measured) and CAMERA in report(measured)


@pytest.mark.slow
def test_it_measures_the_review_window():
    from metamer.benchmarks import reviewing
    from metamer.viewer.gl.context import NoGL

    try:
        measured = reviewing.run(width=40, height=30, samples=2, subdivisions=2, repeats=1, switches=12, paths=2)
    except NoGL as reason:
        pytest.skip(str(reason))
    assert json.loads(json.dumps(measured)) == measured
    assert set(measured["rows"]) == {
        reviewing.RENDER,
        reviewing.ORBIT,
        reviewing.FOLD,
        reviewing.MOVING,
        reviewing.SETTLING,
        reviewing.REFERENCE,
    }
    left = measured["switches"]
    assert (left["gl_errors"], left["nan_pixels"]) == (0, 0) and left["memory_mb"] < 8.0
    assert all(name in reviewing.report(measured) for name in measured["rows"])
