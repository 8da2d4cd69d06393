"""A comparison as one flat table, a line a layer of a row: for CSV, spreadsheets and whatever reads them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...runtime.sheets import Cell, csv_text, write_workbook
from .result import Figures, Result, RowResult
from .row import RowName

#: What stands above the columns; ΔE is ΔE94.
HEADINGS = (
    *RowName._fields,
    "state",
    "status",
    "layer",
    "mean",
    "median",
    "p95",
    "p99",
    "max",
    "floor of mean",
    "floor of max",
    "shift L*",
    "shift a*",
    "shift b*",
    "pixels",
    "undefined pixels",
    "share reshaped",
    "approximation p99 before",
    "approximation p99 after",
    "notes",
)


def table(result: Result) -> Iterator[list[Cell]]:
    """Yield the lines under `HEADINGS`, the worst row first; None where there is nothing to say."""
    for row in result.worst_first:
        for kind, figures in row.layers.items():
            yield _line(row, kind, figures)
        if not row.layers:
            yield _line(row, None, None)


def as_csv(result: Result) -> str:
    """Return the table as RFC 4180 has it."""
    return csv_text(HEADINGS, table(result))


def write_xlsx(result: Result, path: Path) -> None:
    """The table as a workbook; raises as `write_workbook` does."""
    write_workbook(path, "regression", HEADINGS, table(result))


def _line(row: RowResult, kind: str | None, found: Figures | None) -> list[Cell]:
    off = row.approximation or (None, None)
    figures: list[Cell] = [None] * 13
    if found is not None:
        statistics = (found.mean, found.median, found.p95, found.p99, found.max, found.floor_mean, found.floor_max)
        figures = [*statistics, *found.shift, found.pixels, found.undefined, found.reshaped]
    return [*row.name, row.state, row.tier, kind, *figures, *off, " ".join(row.notes) or None]
