"""A comparison as one flat table, a line a layer of a row: for CSV, spreadsheets and whatever reads them."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from ...spectral.errors import InputError
from ...spectral.files import written_whole
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
Cell = str | float | int | None


def table(result: Result) -> Iterator[list[Cell]]:
    """The lines under `HEADINGS`, the worst row first; None where there is nothing to say."""
    for row in result.worst_first:
        for kind, figures in row.layers.items():
            yield _line(row, kind, figures)
        if not row.layers:
            yield _line(row, None, None)


def as_csv(result: Result) -> str:
    """The table as RFC 4180 has it."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(HEADINGS)
    writer.writerows(["" if cell is None else cell for cell in line] for line in table(result))
    return text.getvalue()


def write_xlsx(result: Result, path: Path) -> None:
    """The table as a workbook, by openpyxl.

    Raises
    ------
    InputError : openpyxl is not installed, or the folder cannot be written to.
    """
    try:
        from openpyxl import Workbook
        from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE
    except ImportError:
        raise InputError(
            "a workbook needs openpyxl",
            file=path,
            expected="the extra `xlsx`",
            hint="pip install 'metamer[xlsx]', or ask for --csv",
        ) from None
    book = Workbook()
    sheet = book.worksheets[0]
    sheet.title = "regression"
    sheet.append(list(HEADINGS))
    for line in table(result):
        sheet.append([ILLEGAL_CHARACTERS_RE.sub("?", cell) if isinstance(cell, str) else cell for cell in line])
    for cells in sheet.iter_rows():
        for cell in cells:
            # A name that begins like a formula is a name.
            if isinstance(cell.value, str):
                cell.data_type = "s"
    sheet.freeze_panes = "A2"
    sheet.auto_filter.ref = sheet.dimensions
    with written_whole(path) as beside:
        book.save(beside)


def _line(row: RowResult, kind: str | None, found: Figures | None) -> list[Cell]:
    off = row.approximation or (None, None)
    figures: list[Cell] = [None] * 13
    if found is not None:
        statistics = (found.mean, found.median, found.p95, found.p99, found.max, found.floor_mean, found.floor_max)
        figures = [*statistics, *found.shift, found.pixels, found.undefined, found.reshaped]
    return [*row.name, row.state, row.tier, kind, *figures, *off, " ".join(row.notes) or None]
