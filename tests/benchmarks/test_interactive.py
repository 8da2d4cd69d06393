"""The benchmark of another light and another camera, small, so that it keeps working; no time is judged here."""

import json

import pytest
from metamer.benchmarks.interactive import CAMERA, LIGHT, report, run


def test_it_measures_both():
    from metamer.viewer.context import NoGL

    try:
        measured = run(width=32, height=24, samples=2, subdivisions=2, repeats=2)
    except NoGL as reason:
        pytest.skip(str(reason))
    assert json.loads(json.dumps(measured)) == measured
    assert all(measured[name][key] > 0 for name in (LIGHT, CAMERA) for key in ("kept_ms", "else_ms", "faster"))
    assert LIGHT in report(measured) and CAMERA in report(measured)
