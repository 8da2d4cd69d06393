"""Excel workbooks (.xlsx, .xlsm): each sheet is read as the table that a text of its cells would be.

A cell is its stored value, not what its format shows of it: all digits of a number, ISO 8601 of a date. A number whose
format is a percentage is written with its percent sign, 0.512 as 51.2%, which states the scale. What a text of the
cells would lose is asked about: formulas without a value, hidden sheets, rows and columns, a heading that is merged
over some of the columns.

Source: ECMA-376, Office Open XML, part 1; read by openpyxl (the extra `xlsx`).
"""

from __future__ import annotations

import math
import re
import struct
import warnings
import zipfile
from dataclasses import dataclass, replace
from datetime import date, time
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.distribution import install_hint
from ...runtime.errors import InputError
from ..measurement import conditions_in
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralEntry, SpectralFile, names_its_file
from .shared.text import MOST_LINES, shortened
from .shared.words import quantity_in_lines
from .tables.entries import table_entries
from .tables.parsing import parse_lines

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

NAME = "Excel workbook"
ASKS = True
SUFFIXES = (".xlsx", ".xlsm")

_WORKBOOK = "xl/workbook.xml"
#: Bytes of all parts unpacked, parts, and cells of a sheet with the empty ones between: beyond, it is no measurement.
LARGEST, _MOST_PARTS, _MOST_CELLS = 32 * 2**20, 4096, 4_000_000
_NO_TABLE, _UNVALUED = "no table of wavelengths and values", "formulas without a value"
# Letters in a number format that stand for themselves, colours and conditions.
_LETTERS = re.compile(r'"[^"]*"|\\.|\[[^\]]*\]|[_*].')
# Merged or linked regions: openpyxl makes a cell of each place in them, however many there are.
_REGION = re.compile(
    rb"(?:mergeCell|hyperlink)\s[^<>]{0,400}?\bref\s?=\s?[\"']\$?([A-Za-z]{1,3})\$?(\d{1,9}):\$?([A-Za-z]{1,3})\$?(\d{1,9})"
)


@dataclass(frozen=True)
class _Sheet:
    """A sheet as text, tabs between its cells, and what is to be asked about it; "" where nothing is."""

    title: str
    lines: list[str]
    percent: bool
    question: InputError | None


def recognises(path: Path, head: bytes) -> bool:
    """By what the container holds, or by its name where it is a damaged one."""
    if head[:4] != b"PK\3\4":
        return False
    return path.suffix.casefold() in SUFFIXES or _WORKBOOK in _parts(path)


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read the spectra of all sheets; of several sheets with spectra, each name begins with that of its sheet.

    Sheets without a table of spectra are left out with a note, and one that cannot be used is rejected alone.

    Raises
    ------
    InputError
        No workbook, openpyxl is not installed, or no sheet has spectra that can be used.
    """
    sheets = _sheets(path)
    read_ones: list[tuple[_Sheet, SpectralFile]] = []
    rejected: list[tuple[str, InputError]] = []
    without: list[str] = []
    notes: list[str] = []
    for sheet in sheets:
        place = f"sheet {shortened(sheet.title, 60)!r}"
        try:
            if not any(sheet.lines):
                raise InputError(_NO_TABLE, found="an empty sheet")
            try:
                table = parse_lines(sheet.lines, answer)
            except InputError as reason:
                # Formulas without a value may be what a table lacks; nothing else keeps one from being seen.
                asked = sheet.question is not None and sheet.question.problem == _UNVALUED
                raise (reason if reason.problem == _NO_TABLE and not asked else sheet.question or reason) from None
            if sheet.question is not None:
                raise sheet.question
            for column in (column for block in table.blocks for column in block):
                if quantity_in_lines(column.around)[0] is None:
                    column.around = f"{column.around}\n{sheet.title}"
            named = path.with_name(_file_name(sheet.title)) if len(sheets) > 1 else path
            read_ones.append((sheet, table_entries(table, named, NAME, answer)))
        except InputError as reason:
            if reason.problem == _NO_TABLE:
                without.append(sheet.title)
            else:
                field = f"{place}, {reason.field}" if reason.field else place
                rejected.append((sheet.title, reason.at(file=path, field=field)))
    if not read_ones:
        if rejected:
            raise rejected[0][1]
        raise InputError(
            _NO_TABLE,
            field="sheets",
            found=", ".join(shortened(title, 40) for title in without[:6]) or "no sheet",
            expected="a sheet with wavelengths down its first column or across a header, numbers beside them",
        )
    if without:
        notes.append(f"sheets without spectra are left out: {', '.join(shortened(one, 40) for one in without[:6])}")
    several = len(read_ones) + len(rejected) > 1
    entries: list[SpectralEntry] = []
    for sheet, file in read_ones:
        begin = f"sheet {shortened(sheet.title, 40)!r}: " if several else ""
        notes += [f"{begin}{note}" for note in file.notes]
        if sheet.percent:
            notes.append(f"{begin}numbers that are formatted as percentages are taken as these: 0.5 as 50 %")
        entries += [_of_sheet(entry, sheet.title, several) for entry in file.entries]
        rejected += [
            (f"{sheet.title} {name}" if several else name, reason.at(file=path)) for name, reason in file.rejected
        ]
    details = dict(read_ones[0][1].details) if len(read_ones) == 1 else {}
    return SpectralFile(NAME, tuple(entries), details, tuple(dict.fromkeys(notes)), tuple(rejected))


def has_no_table(path: Path) -> bool:
    """Return whether a workbook has no table of wavelengths in any sheet: lists and reports lie beside measurements."""
    try:
        read(path)
    except InputError as reason:
        return reason.problem == _NO_TABLE
    return False


def _of_sheet(entry: SpectralEntry, title: str, several: bool) -> SpectralEntry:
    """Return the entry with its sheet, and the conditions that its title states, among its details; the sheet is in its
    name where there are several.
    """
    name = entry.name
    if several and not name.startswith(title):
        name = f"{title} {name}"
    return replace(entry, name=name, details={**conditions_in(title), **entry.details, "sheet": shortened(title)})


def _file_name(title: str) -> str:
    """Return a name of a file that has the title of a sheet for its stem."""
    return "".join(sign if sign.isprintable() and sign not in "/\\" else "_" for sign in title).strip(".") + ".xlsx"


def _parts(path: Path) -> dict[str, int]:
    """Bytes of each part of a container, {} where it cannot be read."""
    try:
        with zipfile.ZipFile(path) as opened:
            return {part.filename: part.file_size for part in opened.infolist()}
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError, RuntimeError, struct.error):
        return {}


def _sheets(path: Path) -> list[_Sheet]:
    """Return every sheet of cells, in the order of the workbook."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise InputError(
            "a workbook needs openpyxl",
            found="no openpyxl",
            expected="the extra `xlsx`",
            hint=f"{install_hint('xlsx')}, or save each sheet as CSV",
        ) from None
    parts = _parts(path)
    if _WORKBOOK not in parts:
        raise InputError("not a workbook, or a damaged one", found=f"no {_WORKBOOK}", expected="a container with it")
    if sum(parts.values()) > LARGEST or len(parts) > _MOST_PARTS:
        raise InputError(
            "too large for a workbook of spectra",
            found=f"{sum(parts.values()) / 2**20:.0f} MB unpacked, {len(parts)} parts",
            expected=f"at most {LARGEST >> 20} MB and {_MOST_PARTS} parts",
            hint="split it, or save the sheets as CSV",
        )
    _refuse_endless_regions(path, parts)
    # Whatever a library makes of damage, it is the file's; what it does not know of a workbook is not of its cells.
    try:
        with warnings.catch_warnings(), path.open("rb") as file:
            warnings.simplefilter("ignore")
            valued = load_workbook(file, data_only=True, keep_links=False)
            written = load_workbook(file, keep_links=False)
            return [_sheet(sheet, written[sheet.title]) for sheet in valued.worksheets]
    except InputError:
        raise
    except Exception as reason:
        raise InputError(
            "a damaged workbook",
            found=shortened(f"{type(reason).__name__}: {reason}", 120),
            expected="a workbook that a spreadsheet opens",
            hint="open it in a spreadsheet, and save it again",
        ) from None


def _refuse_endless_regions(path: Path, parts: dict[str, int]) -> None:
    """Refuse a workbook whose merged or linked regions have more cells than any table of spectra."""
    area = 0
    try:
        with zipfile.ZipFile(path) as opened:
            for part in (name for name in parts if name.startswith("xl/worksheets/") and name.endswith(".xml")):
                for left, top, right, bottom in _REGION.findall(opened.read(part)):
                    area += (abs(_column(right) - _column(left)) + 1) * (abs(int(bottom) - int(top)) + 1)
    except Exception as reason:  # as zipfile and zlib have many for damage
        raise InputError(
            "a damaged workbook",
            found=shortened(f"{type(reason).__name__}: {reason}", 120),
            expected="a whole container",
        ) from None
    if area > _MOST_CELLS:
        raise InputError(
            "merged or linked regions without end",
            found=f"{area} cells",
            expected=f"at most {_MOST_CELLS}",
            hint="split the merged cells, or save each sheet as CSV",
        )


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters.upper():
        number = 26 * number + letter - ord("A") + 1
    return number


def _sheet(sheet: Worksheet, written: Worksheet) -> _Sheet:
    """Return a sheet's cells; `written` is the same with formulas in place of their values."""
    # The rows and columns that a format reaches have no end: what is there is kept by its place.
    cells: dict[tuple[int, int], Any] = {place: cell for place, cell in sheet._cells.items() if cell.value is not None}
    empty = [cell.coordinate for place, cell in written._cells.items() if cell.data_type == "f" and place not in cells]
    texts = {place: _text(cell) for place, cell in cells.items()}
    percent = any(_percentage(cell) for cell in cells.values())
    question = _question(sheet, cells, sorted(empty))
    for region in sheet.merged_cells.ranges:
        corner = (region.min_row, region.min_col)
        # A word that is merged over rows is that of each of them; a number was measured once.
        if corner in cells and isinstance(cells[corner].value, str) and region.min_col == region.max_col:
            for row in range(region.min_row + 1, region.max_row + 1):
                texts.setdefault((row, region.min_col), texts[corner])
    rows: dict[int, dict[int, str]] = {}
    for (row, column), text in texts.items():
        rows.setdefault(row, {})[column] = text
    last = max(rows, default=0)
    if last > MOST_LINES or last + sum(map(max, rows.values())) > _MOST_CELLS:
        raise InputError(
            "a sheet is too large for spectra",
            field=f"sheet {shortened(sheet.title, 60)!r}",
            found=f"{last} rows, {sum(map(max, rows.values()))} cells",
            expected=f"at most {_MOST_CELLS} cells, with the empty ones between",
            hint="split it, or save the sheet as CSV",
        )
    lines = ["" for _ in range(last)]
    for row, filled in rows.items():
        lines[row - 1] = "\t".join(filled.get(column, "") for column in range(1, max(filled) + 1))
    return _Sheet(sheet.title, lines, percent, question)


def _text(cell: Any) -> str:
    """Return the value of a cell as a text table has it."""
    value = cell.value
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, int | float):
        if (power := _percentage(cell)) is not None:
            return f"{Decimal(repr(value)).scaleb(power).normalize():f}%"
        return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, date | time):
        return value.isoformat()
    text = " ".join(str(value).split())
    return '"' + text.replace('"', '""') + '"' if '"' in text else text


def _percentage(cell: Any) -> int | None:
    """Return the power of ten by which a number is shown as a percentage: 2, or 0 where the sign is no more than a
    letter of its format; None where it is shown as none.
    """
    value, shown_as = cell.value, str(cell.number_format)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or "%" not in shown_as:
        return None
    return 2 if "%" in _LETTERS.sub("", shown_as) else 0


def _question(sheet: Worksheet, cells: dict[tuple[int, int], Any], empty: list[str]) -> InputError | None:
    """Return the refusal of a sheet of which nobody can tell from its cells what was meant; None where all is plain."""
    if sheet.sheet_state != "visible":
        return InputError(
            "spectra in a hidden sheet", found="a sheet that is not shown", expected="a sheet in sight",
            hint="show it, or delete it",
        )  # fmt: skip
    if empty:
        return InputError(
            _UNVALUED,
            field=f"cell {empty[0]}",
            found=f"{len(empty)} of them",
            expected="the value that each had when the workbook was saved",
            hint="open it in a spreadsheet, and save it again",
        )
    rows, columns = {row for row, _ in cells}, {column for _, column in cells}
    hidden = [f"row {row}" for row in sorted(rows) if sheet.row_dimensions[row].hidden]
    for size in sheet.column_dimensions.values():
        low, high = size.min or 0, size.max or 0
        hidden += [f"column {column}" for column in sorted(columns) if size.hidden and low <= column <= high]
    if hidden:
        return InputError(
            "hidden rows or columns in a table of spectra",
            found=", ".join(hidden[:6]),
            expected="all of the table in sight",
            hint="show them, or delete them",
        )
    return _merged_heading(sheet, cells)


def _merged_heading(sheet: Worksheet, cells: dict[tuple[int, int], Any]) -> InputError | None:
    """Return the refusal of a heading right above the table that is merged over some of its columns, beside another
    one.
    """
    first = _first_row_of_numbers(cells)
    for region in sorted(sheet.merged_cells.ranges, key=lambda one: one.coord):
        if region.min_col == region.max_col or not first - 2 <= region.max_row <= first:
            continue
        row = region.min_row
        beside = [one for one in sheet.merged_cells.ranges if one.min_row == row and one.min_col < one.max_col]
        others = [column for at, column in cells if at == row and column > region.max_col]
        others += [one.min_col for one in beside if one.max_col < region.min_col]
        if (region.min_row, region.min_col) in cells and others:
            return InputError(
                "a heading that is merged over some of the columns",
                field=f"cells {region.coord}",
                found=shortened(str(cells[region.min_row, region.min_col].value), 60),
                expected="a heading of its own above each column",
                hint="split the merged cells, and write the whole name above each column",
            )
    return None


def _first_row_of_numbers(cells: dict[tuple[int, int], Any]) -> int:
    """Return the first row with two numbers or more, 0 where there is none."""
    counts: dict[int, int] = {}
    for (row, _), cell in cells.items():
        if isinstance(cell.value, int | float) and not isinstance(cell.value, bool):
            counts[row] = counts.get(row, 0) + 1
    return min((row for row, count in counts.items() if count > 1), default=0)
