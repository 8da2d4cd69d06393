"""Flat tables for CSV and spreadsheets: headings, and lines of as many cells."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from .distribution import install_hint
from .errors import InputError
from .files import written_whole

#: None where there is nothing to say.
Cell = str | float | int | None


def csv_text(headings: Sequence[str], lines: Iterable[Sequence[Cell]]) -> str:
    """Format the table by RFC 4180."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(headings)
    writer.writerows(["" if cell is None else cell for cell in line] for line in lines)
    return text.getvalue()


def check_workbook(path: Path) -> None:
    """Refuse an impossible workbook before any work: raises `InputError` if openpyxl is missing."""
    try:
        import openpyxl  # noqa: F401
    except ImportError:
        raise InputError(
            "a workbook needs openpyxl",
            file=path,
            expected="the extra `xlsx`",
            hint=f"{install_hint('xlsx')}, or ask for --csv",
        ) from None


def write_workbook(path: Path, title: str, headings: Sequence[str], lines: Iterable[Sequence[Cell]]) -> None:
    """Write the table as a workbook of one sheet, by openpyxl.

    Raises
    ------
    InputError : openpyxl is not installed, or the folder cannot be written to.
    """
    check_workbook(path)
    from openpyxl import Workbook
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

    book = Workbook()
    sheet = book.worksheets[0]
    sheet.title = title
    sheet.append(list(headings))
    for line in lines:
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
