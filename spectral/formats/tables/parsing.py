"""Text tables of spectra: wavelengths down the columns or across the header, with titles above and anything beside."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from ..shared.gathering import MOST_SAMPLES
from ..shared.text import is_missing, read_lines, shortened
from ..shared.words import colour_axis
from .column import Column, ragged, trimmed
from .dialect import Dialect, checked_lines, comment, dialect_of, in_percent
from .down import DownReader
from .layout import (
    Layout,
    Row,
    is_name_header,
    is_units_row,
    layout_of,
    nm_per_unit,
)

# Lines, and characters of them, that the layout is looked for in.
_SHOWN_LINES, _SHOWN_CHARACTERS = 2000, 5_000_000


@dataclass
class Table:
    """What a text table holds.

    Parameters
    ----------
    blocks : the spectra; several lists where the wavelengths start again further down.
    preamble, words : keys and values above the table; all words there, a line each.
    notes : what was passed over.
    """

    dialect: Dialect
    blocks: list[list[Column]]
    preamble: dict[str, str]
    words: str
    notes: list[str]


def parse_table(path: Path) -> Table:
    """Find and read the table of a text file.

    Raises
    ------
    InputError
        No table, rows cut short, words among the wavelengths, or an axis of wavenumbers.
    """
    lines = checked_lines(read_lines(path), path)
    remarks = [words for line in lines[:_SHOWN_LINES] if (words := comment(line))]
    plain = [(index, line) for index, line in enumerate(lines, 1) if line.strip() and comment(line) is None]
    dialect = dialect_of([line for _, line in plain])
    shown: list[Row] = []
    held = 0
    for index, line in plain[:_SHOWN_LINES]:
        shown.append((index, trimmed(dialect.cells(line))))
        held += len(line)
        if held > _SHOWN_CHARACTERS:
            break
    layout = layout_of(shown, dialect)
    if layout is None:
        raise InputError(
            "no table of wavelengths and values",
            file=path,
            found=shortened(" | ".join(line for _, line in plain[:2]) or "comments alone"),
            expected="wavelengths down the first column or across a header, numbers beside them",
        )
    heads = shown[layout.header][1] if layout.header is not None else _commented_header(remarks, shown, layout, dialect)
    if not dialect.delimiter and heads:
        heads = _spaced_header(heads, len(shown[layout.first][1]))
    above = shown[: layout.first if layout.header is None else layout.header]
    preamble, words = _preamble(above, remarks)
    rows = ((index, dialect.cells(line)) for index, line in plain[layout.first :])
    notes: list[str] = []
    if layout.way == "across":
        blocks = [_across(rows, layout, heads, dialect, path, notes)]
    else:
        between = shown[(layout.header or 0) + 1 : layout.first] if layout.header is not None else []
        units = next((cells for _, cells in between if is_units_row(cells)), [])
        colours = [cells for _, cells in shown[: layout.first] if colour_axis(cells[0]) and len(cells) > 1]
        blocks = DownReader(layout, heads, units, above, colours, words, dialect, path).read(rows, notes)
    return Table(dialect, blocks, preamble, words, notes)


def _preamble(above: Sequence[Row], remarks: Sequence[str]) -> tuple[dict[str, str], str]:
    """Keys and values above the table, and all words there, one line each."""
    found: dict[str, str] = {}
    lines = []
    for _, cells in above:
        filled = [cell for cell in cells if cell]
        if len(filled) == 1 and ":" in filled[0]:
            filled = [part.strip() for part in filled[0].split(":", 1)]
        lines.append(": ".join(filled[:40]))
        if len(filled) > 1 and filled[1]:
            found.setdefault(shortened(filled[0].rstrip(":= "), 60), shortened(" ".join(filled[1:40])))
        elif filled:
            found.setdefault("title", shortened(filled[0]))
    if remarks:
        found["comments"] = shortened("; ".join(remarks[:20]), 400)
    return found, "\n".join([*lines, *remarks[:200]])


def _commented_header(remarks: Sequence[str], shown: Sequence[Row], layout: Layout, dialect: Dialect) -> list[str]:
    """The last comment, where it has as many cells as the first row of numbers: then it is the header."""
    if layout.first == 0 and remarks:
        cells = trimmed(dialect.cells(remarks[-1]))
        if len(cells) == len(shown[0][1]):
            return cells
    return []


def _spaced_header(heads: list[str], width: int) -> list[str]:
    """Headers of as many columns as there are, where white space parts them and stands in them.

    Two columns: all words after the first and its unit in brackets name the second. Of more, none can be told.
    """
    if len(heads) <= width:
        return heads
    if width != 2:
        return []
    unit = 2 if heads[1].startswith(("(", "[")) else 1
    return [" ".join(heads[:unit]), " ".join(heads[unit:])]


def _across(
    rows: Iterator[Row], layout: Layout, heads: list[str], dialect: Dialect, path: Path, notes: list[str]
) -> list[Column]:
    axes, taken = layout.axes, set(layout.axes)
    wavelengths = array("d", ((dialect.wavelength(heads[column]) or (math.nan,))[0] for column in axes))
    nm = nm_per_unit(" ".join(heads[: axes[0]]))
    others = [column for column in range(len(heads)) if column not in taken]
    prefix = re.match(r"\s*([RT])[ _.:-]?\s*\d", heads[axes[0]])
    words = " ".join(heads[column] for column in others if colour_axis(heads[column]) is None)
    words += {"R": " reflectance", "T": " transmittance"}[prefix[1]] if prefix else ""
    kinds = [column for column in others if re.search("type|mode|quantity|measure", heads[column], re.I)]
    names = [column for column in others if is_name_header(heads[column]) and colour_axis(heads[column]) is None]
    # A name is better than a number; without either, whatever stands first.
    names.sort(key=lambda column: bool(re.search(r"\bid\b|_id$|^no\b|^#", heads[column], re.I)))
    names += [column for column in others if colour_axis(heads[column]) is None]
    columns: list[Column] = []
    without = samples = 0
    for line, cells in rows:
        values = array("d", (dialect.number(cells[at]) if at < len(cells) else math.nan for at in axes))
        if all(value != value for value in values):
            without += 1
            continue
        if len(cells) <= axes[-1] or (len(trimmed(cells)) > len(heads)):
            raise ragged(path, line, len(cells), len(heads))
        samples += len(values)
        if samples > MOST_SAMPLES:
            raise InputError("too many samples in one file", file=path, expected=f"at most {MOST_SAMPLES}")
        wrong = (at for at, value in zip(axes, values, strict=True) if value != value and at < len(cells))
        bad = next(((line, cells[at]) for at in wrong if not is_missing(cells[at])), None)
        called = next((at for at in names if at < len(cells) and cells[at]), -1)
        name = cells[called] if called >= 0 else ""
        beside = {heads[at]: cells[at] for at in others if at < len(cells) and at != called and heads[at] and cells[at]}
        kind = " ".join([words, *(cells[at] for at in kinds if at < len(cells))])
        unit = "%" if in_percent(cells[axes[0]]) else ""
        columns.append(Column(name or f"row {len(columns) + 1}", kind, unit, wavelengths, values, nm, bad, beside))
    if without:
        notes.append(f"{without} lines below the header have no values at wavelengths and are left out")
    return columns
