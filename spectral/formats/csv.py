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

from ..errors import InputError
from ..files import read_text
from ..spectrum import Quantity, Spectrum, check_values
from ..wavelengths import validated_wavelengths
from .answer import NO_ANSWER, Answer
from .reading import HEAD, SpectralFile
from .shared.text import head_text, is_jcamp
from .tables.column import ragged
from .tables.dialect import comment, dialect_of, two_numbers
from .tables.entries import read_table
from .tables.layout import layout_of

NAME = "table (CSV, TSV)"
ASKS = True
SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")


# Columns of numbers that are known for something else: colour look-up tables, photometric files of lamps.
_OTHER = re.compile(r"\A(?:[^\0]{0,2000}\n)?\s*(?:LUT_[13]D_SIZE|CSPLUTV100|SPILUT 1\.0|IESNA|TILT=)")
_OTHERS = (".cube", ".csp", ".spi1d", ".spi3d", ".3dl", ".mga", ".look", ".ies", ".ldt")


def recognises(path: Path, head: bytes) -> bool:
    """Text with a table of wavelengths and numbers in it, or one that is named .csv or .tsv."""
    text = head_text(head)
    if text.lstrip()[:1] in ("", "<", "{") or is_jcamp(text) or _OTHER.search(text):
        return False
    if path.suffix.casefold() in _OTHERS:
        return False
    if path.suffix.casefold() in (".csv", ".tsv"):
        return True
    if len(head) >= HEAD and path.suffix.casefold() in SUFFIXES:
        # Titles of an instrument, or a header of many wavelengths, may be longer than what the reader was shown.
        with suppress(OSError), path.open("rb") as file:
            text = head_text(file.read(16 * HEAD))
    lines = [line for line in text.splitlines() if line.strip() and comment(line) is None]
    if not any(map(two_numbers, lines)):
        return False
    dialect = dialect_of(lines)
    rows = [(index, dialect.cells(line)) for index, line in enumerate(lines[:-1] if len(lines) > 2 else lines)]
    return layout_of(rows, dialect) is not None


def read(path: Path, answer: Answer = NO_ANSWER) -> SpectralFile:
    """Read every spectrum of a table; what the file does not call anything is what the `answer` says, or refused.

    Raises
    ------
    InputError
        No table of wavelengths and numbers, or none of its spectra can be used.
    """
    return read_table(path, NAME, answer)


def read_csv_spectra(path: str | Path, quantity: Quantity = "reflectance") -> dict[str, Spectrum]:
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
    path = Path(path)
    rows = _rows(path)
    if _is_number(rows[0][1][0]) and _ascends(rows):
        count = len(rows[0][1])
        named = [path.stem] if count == 2 else [f"column {number}" for number in range(2, count + 1)]
        rows.insert(0, (0, ["nm", *named]))
    header, body = rows[0][1], rows[1:]
    first_column = [row[0] for _, row in body]
    down = _is_number(first_column[0])
    across = (
        len(header) > 2
        and all(_is_number(cell) for cell in header[1:])
        and (not down or (_looks_like_nm(header[1:]) and not _looks_like_nm(first_column)))
    )
    if not across and not down:
        raise _without_wavelengths(path, "first column", first_column)
    for line, row in body:
        if len(row) != len(header):
            raise ragged(path, line, len(row), len(header))
    if across:
        axis, axis_field, names = header[1:], "header", first_column
        table = np.array([[_number(cell, path, line) for cell in row[1:]] for line, row in body])
    else:
        axis, axis_field, names = first_column, "first column", header[1:]
        table = np.array([[_number(cell, path, line) for cell in row[1:]] for line, row in body]).T
    if not all(_is_number(cell) for cell in axis) or table.size == 0:
        raise _without_wavelengths(path, axis_field, axis)
    wavelengths_nm = validated_wavelengths([float(cell) for cell in axis], file=path, field=axis_field)
    spectra: dict[str, Spectrum] = {}
    for name, values in zip(names, table, strict=True):
        if name in spectra:
            raise InputError("two spectra share a name", file=path, field=name or "no name", expected="each name once")
        check_values(values, wavelengths_nm, quantity, file=path, field=name)
        spectra[name] = Spectrum.sampled(wavelengths_nm, values, quantity)
    return spectra


def _without_wavelengths(path: Path, field: str, cells: list[str]) -> InputError:
    return InputError(
        "no wavelengths in this table",
        file=path,
        field=field,
        found=", ".join(cells[:3]) or "nothing",
        expected="wavelengths in nm down the first column or across the header",
        hint="instruments put their own lines before the numbers; save the spectra as a plain table",
    )


def _ascends(rows: list[tuple[int, list[str]]]) -> bool:
    """Whether the first column goes on from its first cell as wavelengths do: then there is no header."""
    column = [row[0] for _, row in rows]
    return _looks_like_nm(column) and all(float(a) < float(b) for a, b in pairwise(column))


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and stripped cells of each row that is neither blank nor a comment; a last column that is empty
    throughout, as spreadsheets leave it, is left out.
    """
    lines = [
        (n, line) for n, line in enumerate(read_text(path).splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"
    ]
    delimiter = max("\t;,", key=lambda mark: lines[0][1].count(mark)) if lines else ","
    rows = [(n, [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]) for n, line in lines]
    if all(len(row) == len(rows[0][1]) > 2 and not row[-1] for _, row in rows):
        rows = [(n, row[:-1]) for n, row in rows]
    if len(rows) < 2 or len(rows[0][1]) < 2:
        raise InputError(
            "not a table of spectra",
            file=path,
            found=f"{len(rows)} rows",
            expected="a header row and at least one row of numbers",
        )
    return rows


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _number(cell: str, path: Path, line: int) -> float:
    if not _is_number(cell):
        raise InputError(
            "not a number",
            file=path,
            field=f"line {line}",
            found=repr(cell),
            expected="a number with a point as decimal mark",
        )
    return float(cell)


def _looks_like_nm(cells: list[str]) -> bool:
    return len(cells) > 1 and all(_is_number(cell) and 100 <= float(cell) <= 20000 for cell in cells)
