"""Text tables of spectra: wavelengths down the columns or across the header, with titles above and anything beside."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from .conditions import colour_axis, quantity_in, unit_in
from .dialect import Dialect, checked_lines, comment, dialect_of
from .gathering import MOST_SAMPLES
from .layout import (
    Layout,
    Row,
    is_name_header,
    is_units_row,
    is_wavelength_header,
    is_wavenumber_header,
    layout_of,
    nm_per_unit,
)
from .text import is_missing, read_lines, shortened

# Lines, and characters of them, that the layout is looked for in.
_SHOWN_LINES, _SHOWN_CHARACTERS = 2000, 5_000_000
_ASIDE = re.compile(
    r"\bstd|stdev|\bs\.?d\.?$|sigma|uncert|\berr(?:or)?\b|variance|\bdark\b|baseline|\breference\b|^ref$|^#$|^index$|^pixel",
    re.I,
)
_UNIT_BRACKET = re.compile(r"\s*[\[(]([^\[\]()]{0,40})[\])]\s*$")
_GENERIC = re.compile(
    r"(?:spectral|total|relative|rel\.?|hemispherical|diffuse|sample|measured)?[ _]*(?:reflectance|reflection|"
    r"remission|transmittance|transmission|(?:ir)?radiance|power|intensity|values?|data|emission|spd|spectrum|counts?|"
    r"measurement|[%]?[rtys][%]?|scope)(?:[ _]*(?:factor|distribution))?(?: ?%)?",
    re.I,
)


@dataclass
class Column:
    """One spectrum in the making.

    Parameters
    ----------
    name : "" where the table calls it nothing but what was measured.
    words, unit : its header, and the unit in it.
    wavelengths, values : as in the file; NaN where a cell is empty.
    nm : nanometres per unit of `wavelengths`.
    bad : line and text of the first cell that is neither a number nor empty.
    beside : other cells that belong to it, by header.
    place : its column and that of its wavelengths, where both run down.
    """

    name: str
    words: str
    unit: str
    wavelengths: array[float]
    values: array[float]
    nm: float = 1.0
    bad: tuple[int, str] | None = None
    beside: dict[str, str] = field(default_factory=dict)
    place: tuple[int, int] = (0, 0)


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
        shown.append((index, _trimmed(dialect.cells(line))))
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
        blocks = _Down(layout, heads, units, above, colours, words, dialect, path).read(rows, notes)
    return Table(dialect, blocks, preamble, words, notes)


def _trimmed(cells: list[str]) -> list[str]:
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


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
        cells = _trimmed(dialect.cells(remarks[-1]))
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
        if len(cells) <= axes[-1] or (len(_trimmed(cells)) > len(heads)):
            raise _ragged(path, line, len(cells), len(heads))
        samples += len(values)
        if samples > MOST_SAMPLES:
            raise InputError("too many samples in one file", file=path, expected=f"at most {MOST_SAMPLES}")
        wrong = (at for at, value in zip(axes, values, strict=True) if value != value and at < len(cells))
        bad = next(((line, cells[at]) for at in wrong if not is_missing(cells[at])), None)
        called = next((at for at in names if at < len(cells) and cells[at]), -1)
        name = cells[called] if called >= 0 else ""
        beside = {heads[at]: cells[at] for at in others if at < len(cells) and at != called and heads[at] and cells[at]}
        kind = " ".join([words, *(cells[at] for at in kinds if at < len(cells))])
        columns.append(Column(name or f"row {len(columns) + 1}", kind, "", wavelengths, values, nm, bad, beside))
    if without:
        notes.append(f"{without} lines below the header have no values at wavelengths and are left out")
    return columns


class _Down:
    """Reads a table with wavelengths down its columns; each axis column has the value columns to its right."""

    def __init__(
        self,
        layout: Layout,
        heads: list[str],
        units: list[str],
        above: Sequence[Row],
        colours: Sequence[list[str]],
        words: str,
        dialect: Dialect,
        path: Path,
    ) -> None:
        self.axes, self.heads, self.units, self.dialect, self.path = layout.axes, heads, units, dialect, path
        self.colours, self.shape = colours, ""
        self.above = above[-1][1] if above and len(above[-1][1]) > 1 else []
        self.said = "\n".join(line for line in words.splitlines() if re.search("wave|λ|lambda", line, re.I))

    def read(self, rows: Iterator[Row], notes: list[str]) -> list[list[Column]]:
        blocks: list[list[Column]] = []
        columns: list[Column] = []
        last = math.nan
        width = stopped = below = samples = 0
        stop_cell = ""
        for line, cells in rows:
            self.shape = self.shape or _shape(cells[self.axes[0]])
            found = self._wavelength(cells, self.axes[0])
            if found is None and all(self._wavelength(cells, axis) is None for axis in self.axes[1:]):
                if columns and colour_axis(cells[self.axes[0]]):
                    self._beside(columns, cells)
                    continue
                if not stopped:
                    stopped, stop_cell = line, cells[min(self.axes[0], len(cells) - 1)]
                below += 1
                continue
            at = math.nan if found is None else found
            starts_again = bool(columns) and at == columns[0].wavelengths[0]
            if starts_again or (columns and stopped and not _continues(columns[0], last, at)):
                blocks.append(columns)
                columns = []
            elif stopped and columns:
                raise InputError(
                    "not a number",
                    file=self.path,
                    field=f"line {stopped}",
                    found=repr(shortened(stop_cell, 40)),
                    expected="a wavelength, as on the lines before and after it",
                )
            below = stopped = 0
            if not columns:
                width = len(_trimmed(list(cells)))
                columns = self._columns(cells, width, notes if not blocks else [])
            if len(cells) < width:
                raise _ragged(self.path, line, len(cells), width)
            if len(cells) > max(width, len(self.heads)) and len(_trimmed(list(cells))) > max(width, len(self.heads)):
                raise _ragged(self.path, line, len(cells), max(width, len(self.heads)))
            samples += self._take(columns, line, cells)
            last = at
            if samples > MOST_SAMPLES:
                raise InputError("too many samples in one file", file=self.path, expected=f"at most {MOST_SAMPLES}")
        if columns:
            blocks.append(columns)
        if below:
            notes.append(f"{below} lines below the table are not read")
        words = {column.words for block in blocks for column in block if _empty(column) and column.bad}
        if words and any(not _empty(column) for block in blocks for column in block):
            notes.append(f"columns without numbers are left out: {', '.join(sorted(words)[:6])}")
            return [[column for column in block if not _empty(column)] for block in blocks]
        return [[column for column in block if column.bad or not _empty(column)] for block in blocks]

    def _wavelength(self, cells: Sequence[str], at: int) -> float | None:
        """The wavelength in a cell that is written as the first one was; a word with a number in it is none."""
        found = self.dialect.wavelength(cells[at]) if at < len(cells) else None
        return found[0] if found and (not found[1] or _shape(cells[at]) == self.shape) else None

    @staticmethod
    def _beside(columns: Sequence[Column], cells: Sequence[str]) -> None:
        """A row of one tristimulus value for each spectrum: L*, X, ..."""
        for column in columns:
            if column.place[0] < len(cells) and cells[column.place[0]]:
                column.beside.setdefault(cells[column.place[1]], cells[column.place[0]])

    def _take(self, columns: Sequence[Column], line: int, cells: Sequence[str]) -> int:
        for column in columns:
            at, axis = column.place
            found = self._wavelength(cells, axis)
            if found is None:
                continue
            value = self.dialect.number(cells[at]) if at < len(cells) else math.nan
            if value != value and at < len(cells) and column.bad is None and not is_missing(cells[at]):
                column.bad = (line, cells[at])
            column.wavelengths.append(found)
            column.values.append(value)
        return len(columns)

    def _columns(self, cells: Sequence[str], width: int, notes: list[str]) -> list[Column]:
        """Empty columns for the values of a block that starts with `cells`."""
        columns = []
        aside = []
        width = max(width, len(self.heads))
        for at in range(min(self.axes) + 1, width):
            if at in self.axes:
                continue
            axis = max(axis for axis in self.axes if axis < at)
            head, unit = self._head(at), self.units[at] if at < len(self.units) else ""
            if head and _ASIDE.search(head) and width - len(self.axes) > 1:
                aside.append(head)
                continue
            unit = unit.strip("[]() ")
            bracket = _UNIT_BRACKET.search(head)
            if bracket and (unit_in(bracket[1]) or quantity_in(bracket[1]) or not unit):
                unit = unit or bracket[1]
            if re.search("[A-Za-z%]", head) and is_units_row([head]):
                head, unit = "", head
            name = self._name(head, at, axis, width - len(self.axes))
            nm = nm_per_unit(f"{self._head(axis)} {self.units[axis] if axis < len(self.units) else ''}")
            if nm == 1.0 and not is_wavelength_header(self._head(axis)):
                nm = nm_per_unit(self.said)
            if is_wavenumber_header(f"{self._head(axis)} {self.units[axis] if axis < len(self.units) else ''}"):
                raise InputError(
                    "wavenumbers in place of wavelengths",
                    file=self.path,
                    field=self._head(axis),
                    expected="wavelengths in nm, µm or Å",
                    hint="export over wavelength; 10,000,000 / (wavenumber in 1/cm) is the wavelength in nm",
                )
            columns.append(Column(name, head, unit, array("d"), array("d"), nm, place=(at, axis)))
        if aside:
            notes.append(f"columns beside the measurement are left out: {', '.join(aside[:6])}")
        for row in self.colours:
            self._beside(columns, row)
        if not columns:
            raise InputError(
                "wavelengths without values",
                file=self.path,
                found=", ".join(aside) or shortened(" ".join(cells)),
                expected="a column of reflectance, transmittance or emission",
            )
        return columns

    def _head(self, at: int) -> str:
        return self.heads[at] if at < len(self.heads) else ""

    def _name(self, head: str, at: int, axis: int, count: int) -> str:
        """The header without its unit; the row above names columns that are only called what was measured."""
        plain = _UNIT_BRACKET.sub("", head).strip() if _UNIT_BRACKET.search(head) else head
        if plain and not _GENERIC.fullmatch(plain):
            return head if _UNIT_BRACKET.search(head) and not unit_in(head) and not quantity_in(head) else plain
        if len(self.axes) > 1 or len(self.above) >= len(self.heads) > 2:
            for place in (at, axis):
                if place < len(self.above) and self.above[place] and not is_units_row([self.above[place]]):
                    return self.above[place]
        return "" if count == 1 else plain or f"column {at + 1}"


def _continues(column: Column, last: float, at: float) -> bool:
    """Whether a wavelength goes on from the last one in the direction of the column."""
    return len(column.wavelengths) < 2 or (at - last) * (column.wavelengths[1] - column.wavelengths[0]) > 0.0


def _shape(cell: str) -> str:
    """A cell with its number taken out: "Spectral Data 380[nm]" and "Spectral Data 385[nm]" have one shape."""
    return re.sub(r"\d+(?:[.,]\d+)?", "0", cell[:60])


def _empty(column: Column) -> bool:
    return all(value != value for value in column.values)


def _ragged(path: Path, line: int, found: int, expected: int) -> InputError:
    return InputError(
        "a row is cut short" if found < expected else "a row is too long",
        file=path,
        field=f"line {line}",
        found=f"{found} cells",
        expected=f"{expected} cells, as in the header",
        hint="the file may be truncated; export it again",
    )
