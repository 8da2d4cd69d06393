"""The benchmark of edits, small, so that it keeps working; no time is judged here, but that pictures are the same."""

import json

import pytest
from metamer.benchmarks import edits
from metamer.lighting.visibility import refinement


@pytest.mark.slow
def test_every_edit_is_measured_and_draws_what_a_new_renderer_draws(monkeypatch):
    some = edits._renderers
    monkeypatch.setattr(edits, "_renderers", lambda: some()[:1])
    monkeypatch.setattr(refinement, "MOST_VERTICES", 300)
    measured = edits.run(width=24, height=16, subdivisions=2, repeats=2, light_rows=32)
    assert json.loads(json.dumps(measured)) == measured
    for rows in measured["edits"].values():
        assert set(rows) == set(edits.REDONE)
        assert all(row["draw_ms"] > 0.0 and row["anew_ms"] > 0.0 and row["apart"] < 1e-3 for row in rows.values())
    text = edits.report(measured)
    assert all(name in text and what in text for name, what in edits.REDONE.items())
