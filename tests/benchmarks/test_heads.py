"""Queries on many materials, small."""

import pytest
from metamer.benchmarks import heads
from metamer.materials.catalogue import head_index

pytest.importorskip("duckdb")


def test_figures_are_of_an_index_that_answers(monkeypatch):
    monkeypatch.setattr(head_index, "WORTH", 50)
    monkeypatch.setattr(head_index, "TICK_NS", 20_000_000)
    monkeypatch.setattr(heads, "QUERIES", {"nearest": heads.QUERIES["nearest"]})
    said = []
    figures = heads.run(60, said.append)
    assert "60 heads are read into an index" in said[1] and figures["every_head_read_s"] > 0
    (row,) = figures["rows"]
    assert row["query"] == "nearest" and 0 < row["warm_s"] <= row["cold_s"] and row["peak_mb"] > 10
    assert "60 materials: index built" in heads.report(figures)


def test_fewer_than_take_an_index_are_refused(monkeypatch):
    monkeypatch.setattr(head_index, "TICK_NS", 0)
    with pytest.raises(RuntimeError, match="no index: 3 materials"):
        heads.run(3, lambda line: None)
