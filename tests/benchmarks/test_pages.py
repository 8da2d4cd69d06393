"""The benchmark of pages, small, so that it keeps working: every page is worked with, and no time is judged here."""

import json
import shutil

import pytest
from metamer.benchmarks import made_up_pages, pages
from metamer.calibration.report import plots
from metamer.runtime.errors import InputError


@pytest.mark.slow
@pytest.mark.skipif(not any(map(shutil.which, pages.BROWSERS)), reason="no Chromium here to open pages with")
def test_each_page_is_weighed_and_worked_with():
    pytest.importorskip("playwright")
    found = pages.run(rows=6, sized=3)
    assert json.loads(json.dumps(found)) == found and (found["rows"], found["sized"]) == (6, 3)
    assert [one["page"] for one in found["pages"]] == ["review", "regression", "match", "catalogue"]
    for one in found["pages"]:
        said = {step["step"].split(" ")[0] for step in one["steps"]}
        assert {"type", "delete", "choose", "press", "follow"} <= said
        # A catalogue and a match have no two pictures to compare.
        pictured = {"move", "point"} <= said
        assert pictured == (one["page"] in ("review", "regression"))
        assert one["bytes"] > 10_000 and 0.0 < one["cpu_ms_p95"] <= one["cpu_ms_max"]
    assert "catalogue" in pages.report(found)


def test_without_a_browser_it_says_so(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(InputError, match="no Chromium"):
        pages.run(rows=1, sized=1, only=("catalogue",))


@pytest.mark.slow_cases("regression", "review")
@pytest.mark.parametrize("page", ["review", "regression"])
def test_a_page_of_82_materials_under_three_lights_is_no_larger_than_6_mb(page, tmp_path, monkeypatch):
    """Of a few materials, at the size that pictures get where there are many: what each row adds."""
    few, more, many = 6, 18, 246
    side = plots.embedded_side
    # Pairs of pictures that a row has.
    each = {"review": 1, "regression": 2}[page]
    monkeypatch.setattr(plots, "embedded_side", lambda pairs, *text: side(each * many, *text))
    weights = []
    for rows in (few, more):
        (tmp_path / str(rows)).mkdir()
        weights.append(made_up_pages.PAGES[page](tmp_path / str(rows), rows).stat().st_size)
    assert weights[1] + (weights[1] - weights[0]) / (more - few) * (many - more) < 6e6
