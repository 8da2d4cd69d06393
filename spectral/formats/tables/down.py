"""Tables with wavelengths down their columns."""

from __future__ import annotations

import math
import re
from array import array
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path

from ...errors import InputError
from ..shared.gathering import MOST_SAMPLES
from ..shared.text import is_missing, shortened
from ..shared.words import colour_axis, quantity_in, unit_in
from .column import Column, NextTable, ragged, trimmed
from .dialect import Dialect, in_percent
from .layout import Layout, Row, is_units_row, is_wavelength_header, is_wavenumber_header, nm_per_unit

# Columns that hold no spectrum: scatter of one beside it, and an instrument's own readings. Whole words at the end of a
# heading, since "dark-skin" and "std white" are names of samples.
_SCATTER = re.compile(
    r"(?:.*[\s_(,;])?(?:std(?:[. _]*dev\w*)?|standard deviation|stdev\w*|s\.?d\.?|sigma|uncert\w*|err(?:or)?s?|"
    r"variance)\W*(?:[\[(].*)?",
    re.I,
)
_COUNTER = re.compile(r"#|index|pixel\w*", re.I)
_READING = re.compile(
    r"(?:dark|baseline|reference|ref)\.?(?:[ _]*(?:currents?|readings?|spectr\w+|counts?|signals?|scans?|lamp))?\W*",
    re.I,
)
_RAW = re.compile(r"(?:sample|scope|raw|signal|counts?|reference|ref|dark|baseline)\b.*", re.I)
_UNIT_BRACKET = re.compile(r"\s{0,9}[\[(]((?:[^\[\]()]|[\[(][^\[\]()]{0,30}[\])]){0,40})[\])]\s{0,9}$")
_GENERIC = re.compile(
    r"(?:spectral|total|relative|rel\.?|hemispherical|diffuse|sample|measured)?[ _]*(?:reflectance|"
    r"reflection|reflexion|remission|transmittance|transmission|(?:ir)?radiance|power|intensity|values?|data|"
    r"emission|spd|spectrum|counts?|"
    r"measurement|[%]?[rtys][%]?|scope)(?:[ _]*(?:factor|distribution))?(?: ?%)?",
    re.I,
)


class DownReader:
    """Reads a table with wavelengths down its columns; each axis column has the value columns to its right.

    Wavelengths that start again below an empty line are one more block of the same table; below words or comments they
    are another table, where reading ends: `next` says where.
    """

    def __init__(
        self,
        layout: Layout,
        heads: list[str],
        units: list[str],
        above: Sequence[Row],
        colours: Sequence[list[str]],
        words: str,
        comments: Sequence[int],
        dialect: Dialect,
        path: Path,
    ) -> None:
        self.axes, self.heads, self.units, self.dialect, self.path = layout.axes, heads, units, dialect, path
        self.colours, self.comments, self.shape = colours, comments, ""
        self.last_line = self.below = 0
        self.next: NextTable | None = None
        self.above = above[-1][1] if above and len(above[-1][1]) > 1 else []
        self.said = "\n".join(line for line in words.splitlines() if re.search("wave|λ|lambda", line, re.I))

    def read(self, rows: Iterator[Row], notes: list[str]) -> list[list[Column]]:
        blocks: list[list[Column]] = []
        columns: list[Column] = []
        last = math.nan
        width = stopped = below = samples = 0
        stop_cell = ""
        for line, cells in rows:
            first = cells[self.axes[0]] if self.axes[0] < len(cells) else ""
            self.shape = self.shape or _shape(first)
            found = self._wavelength(cells, self.axes[0])
            if found is None and all(self._wavelength(cells, axis) is None for axis in self.axes[1:]):
                if columns and self._beside(columns, cells):
                    self.last_line = self.last_line if self.colours else line
                    continue
                if not stopped:
                    stopped, stop_cell = line, first or cells[0]
                below += 1
                continue
            at = math.nan if found is None else found
            begun = columns[0].wavelengths if columns else None
            if begun and (at == begun[0] or (stopped and not _continues(begun, last, at))):
                blocks.append(columns)
                columns = []
                if stopped or bisect_right(self.comments, line) > bisect_right(self.comments, self.last_line):
                    self.next = NextTable(self.last_line, line, "down")
                    below = 0
                    break
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
                width = len(trimmed(list(cells)))
                columns = self._columns(cells, width, notes if not blocks else [])
            if len(cells) < width:
                raise ragged(self.path, line, len(cells), width)
            if len(cells) > max(width, len(self.heads)) and len(trimmed(list(cells))) > max(width, len(self.heads)):
                raise ragged(self.path, line, len(cells), max(width, len(self.heads)))
            samples += self._take(columns, line, cells)
            last, self.last_line = at, line
            if samples > MOST_SAMPLES:
                raise InputError("too many samples in one file", file=self.path, expected=f"at most {MOST_SAMPLES}")
        if columns:
            blocks.append(columns)
        self.below = below
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
    def _beside(columns: Sequence[Column], cells: Sequence[str]) -> bool:
        """Whether a row has one tristimulus value for each spectrum (L*, X, ...), which is then put beside it."""
        label = next((cell for cell in cells if cell), "")
        if colour_axis(label) is None:
            return False
        for column in columns:
            if column.place[0] < len(cells) and cells[column.place[0]]:
                column.beside.setdefault(label, cells[column.place[0]])
        return True

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

    def _aside(self, head: str) -> bool:
        """True for a column beside the spectra; "dark" and "reference" only next to an instrument's other readings."""
        if _READING.fullmatch(head):
            return any(_RAW.fullmatch(other) for other in self.heads if other != head)
        return bool(_SCATTER.fullmatch(head) or _COUNTER.fullmatch(head))

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
            if head and width - len(self.axes) > 1 and self._aside(head):
                aside.append(head)
                continue
            unit = unit.strip("[]() ")
            bracket = _UNIT_BRACKET.search(head)
            if bracket and (unit_in(bracket[1]) or quantity_in(bracket[1]) or not unit):
                unit = unit or bracket[1]
            if not unit and at < len(cells) and in_percent(cells[at]):
                unit = "%"
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
            called = f"{self._head(axis)} {self.units[axis] if axis < len(self.units) else ''} {self.said}"
            is_open = nm == 1.0 and is_wavelength_header(called) and not re.search(r"nm\b|nanomet", called, re.I)
            columns.append(Column(name, head, unit, array("d"), array("d"), nm, unit_open=is_open, place=(at, axis)))
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


def is_generic(name: str) -> bool:
    """Whether a heading says what was measured and not of which sample."""
    return bool(_GENERIC.fullmatch(name))


def _continues(begun: array[float], last: float, at: float) -> bool:
    """Whether a wavelength goes on from the last one in the direction of those before."""
    return len(begun) < 2 or (at - last) * (begun[1] - begun[0]) > 0.0


def _shape(cell: str) -> str:
    """A cell with its number taken out: "Spectral Data 380[nm]" and "Spectral Data 385[nm]" have one shape."""
    return re.sub(r"\d+(?:[.,]\d+)?", "0", cell[:60])


def _empty(column: Column) -> bool:
    return all(value != value for value in column.values)
