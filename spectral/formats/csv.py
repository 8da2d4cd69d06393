"""Spectra in text tables, as spreadsheets and instruments write them, wavelengths down a column or across the header.

`read` takes whatever people have, and notes what it made of it; `read_csv_spectra` is for the project's own tables,
where anything unexpected is an error.
"""

from __future__ import annotations

import csv
import re
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import read_text
from ..spectrum import Quantity, Spectrum, check_values
from ..wavelengths import validated_wavelengths
from .colours_only import UnclearColoursError, read_colours
from .import_options import NO_ANSWER, ImportOptions
from .registry import HEAD, SpectralFile, names_its_file
from .shared.decisions import colours_alone
from .shared.text import head_text, is_jcamp, is_number
from .tables.dialect import LONGEST_LINE, comment, dialect_of, two_numbers
from .tables.entries import table_entries
from .tables.layout import layout_of
from .tables.parsing import parse_table
from .tables.section import ragged

NAME = "table (CSV, TSV)"
ASKS = True
SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")


# Lines that a table is recognised by.
_FEW_LINES = 4
# Columns of numbers that are known for something else: colour look-up tables, photometric files of lamps, meshes.
_OTHER = re.compile(r"\A(?:[^\0]{0,2000}\n)?\s*(?:LUT_[13]D_SIZE|CSPLUTV100|SPILUT 1\.0|IESNA|TILT=)")
_OTHERS = (".cube", ".csp", ".spi1d", ".spi3d", ".3dl", ".mga", ".look", ".ies", ".ldt", ".obj", ".ply", ".off", ".stl")


def recognises(path: Path, head: bytes) -> bool:
    """Text with a table of wavelengths and numbers in it, or one that is named .csv or .tsv."""
    text = head_text(head)
    if text.lstrip()[:1] in ("", "<", "{") or is_jcamp(text) or _OTHER.search(text):
        return False
    if path.suffix.casefold() in _OTHERS:
        return False
    if path.suffix.casefold() in (".csv", ".tsv"):
        return True
    if len(head) >= HEAD and (path.suffix.casefold() in SUFFIXES or text.count("\n") < _FEW_LINES):
        text = head_text(opening(path)) or text
    lines = [line for line in text.splitlines() if line.strip() and comment(line) is None]
    if not any(map(two_numbers, lines)):
        return False
    dialect = dialect_of(lines)
    rows = [(index, dialect.cells(line)) for index, line in enumerate(lines[:-1] if len(lines) > 2 else lines)]
    return layout_of(rows, dialect) is not None


def opening(path: Path) -> bytes:
    """Return the start of a file with its first rows, which titles of an instrument or many columns make long."""
    with suppress(OSError), path.open("rb") as file:
        start = file.read(16 * HEAD)
        if start.count(b"\n") < _FEW_LINES:
            start += file.read(_FEW_LINES * LONGEST_LINE - len(start))
        return start
    return b""


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read every spectrum of a table; what the file does not call anything is what the `answer` says, or refused.

    Raises
    ------
    InputError
        No table of wavelengths and numbers, or none of its spectra can be used.
    """
    try:
        table = parse_table(path, answer)
    except InputError:
        _refuse_colours(path)
        raise
    return table_entries(table, path, NAME, answer)


def _refuse_colours(path: Path) -> None:
    """Refuse a table of colours that has no spectra by what it is."""
    try:
        found = f"{len(read_colours(path))} of them"
    except UnclearColoursError:
        found = "columns of them"
    except InputError:
        return
    raise colours_alone(found)


@names_its_file
def read_csv_spectra(path: Path, quantity: Quantity = "reflectance") -> dict[str, Spectrum]:
    """Read every spectrum of a table, by name.

    Layout: one header row, then numbers. Either the first column holds wavelengths in nm and each further column is a
    spectrum named by the header, or the header holds wavelengths and each row is a spectrum named by its first cell.
    A table that starts with its numbers has wavelengths down the first column; its spectra are called by the file's
    name, or, if there are more than one, "column 2", "column 3", ... Lines that start with `#` are comments.

    Raises
    ------
    InputError
        Missing, empty, binary or ragged files; cells that are no numbers; wavelengths in another unit, descending or
        repeated; values that `quantity` cannot take.
    """
    lines, rows = _rows(path)
    first_column = [row[0] for row in rows]
    if _looks_like_nm(first_column) and all(float(a) < float(b) for a, b in pairwise(first_column)):
        named = [path.stem] if len(rows[0]) == 2 else [f"column {number}" for number in range(2, len(rows[0]) + 1)]
        lines, rows = [0, *lines], [["nm", *named], *rows]
    header, first_column = rows[0], [row[0] for row in rows[1:]]
    down = is_number(first_column[0])
    across = len(header) > 2 and all(map(is_number, header[1:]))
    across = across and (not down or (_looks_like_nm(header[1:]) and not _looks_like_nm(first_column)))
    if not across and not down:
        raise _without_wavelengths("first column", first_column)
    for line, row in zip(lines, rows, strict=True):
        if len(row) != len(header):
            raise ragged(line, len(row), len(header))
    table = np.array([[_number(cell, line) for cell in row[1:]] for line, row in zip(lines[1:], rows[1:], strict=True)])
    axis, names, field = (header[1:], first_column, "header") if across else (first_column, header[1:], "first column")
    if not all(map(is_number, axis)) or table.size == 0:
        raise _without_wavelengths(field, axis)
    wavelengths_nm = validated_wavelengths([float(cell) for cell in axis], field=field)
    spectra: dict[str, Spectrum] = {}
    for name, values in zip(names, table if across else table.T, strict=True):
        if name in spectra:
            raise InputError("two spectra share a name", field=name or "no name", expected="each name once")
        check_values(values, wavelengths_nm, quantity, field=name)
        spectra[name] = Spectrum.sampled(wavelengths_nm, values, quantity)
    return spectra


def _without_wavelengths(field: str, cells: list[str]) -> InputError:
    return InputError(
        "no wavelengths in this table",
        field=field,
        found=", ".join(cells[:3]) or "nothing",
        expected="wavelengths in nm down the first column or across the header",
        hint="instruments put their own lines before the numbers; save the spectra as a plain table",
    )


def _rows(path: Path) -> tuple[list[int], list[list[str]]]:
    """Line numbers and stripped cells of the rows that are neither blank nor comments; a last column that is empty
    throughout, as spreadsheets leave it, is left out.
    """
    kept = [(n, text) for n, text in enumerate(read_text(path).splitlines(), 1) if text.strip()[:1] not in ("", "#")]
    delimiter = max("\t;,", key=kept[0][1].count) if kept else ","
    rows = [[cell.strip() for cell in next(csv.reader([text], delimiter=delimiter))] for _, text in kept]
    if all(len(row) == len(rows[0]) > 2 and not row[-1] for row in rows):
        rows = [row[:-1] for row in rows]
    if len(rows) < 2 or len(rows[0]) < 2:
        expected = "a header row and at least one row of numbers"
        raise InputError("not a table of spectra", found=f"{len(rows)} rows", expected=expected)
    return [line for line, _ in kept], rows


def _number(cell: str, line: int) -> float:
    if not is_number(cell):
        expected = "a number with a point as decimal mark"
        raise InputError("not a number", field=f"line {line}", found=repr(cell), expected=expected)
    return float(cell)


def _looks_like_nm(cells: list[str]) -> bool:
    return len(cells) > 1 and all(is_number(cell) and 100 <= float(cell) <= 20000 for cell in cells)
