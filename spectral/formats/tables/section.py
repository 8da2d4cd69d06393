"""One table of a text in the making: the lines of the file, the rows that are about it, and its spectra."""

from __future__ import annotations

import re
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import itemgetter

import numpy as np

from ....runtime.errors import InputError
from ..registry import StatedColour
from ..shared.colour_words import colour_axis
from ..shared.decisions import Decision, Divisor, Sign
from ..shared.entry_rules import MOST_SAMPLES
from ..shared.resemblance import Likeness
from ..shared.text import is_missing, shortened
from .axis import NANOMETRE, AxisUnit
from .dialect import Dialect
from .layout import Row, TableLayout, Way

# Lines, and characters of them, that the layout is looked for in.
SHOWN_LINES, _SHOWN_CHARACTERS = 2000, 5_000_000
_LINE = itemgetter(0)


@dataclass
class Column:
    """One spectrum in the making.

    Parameters
    ----------
    name : "" where the table calls it nothing but what was measured.
    words, unit : its header, and the unit in it.
    wavelengths, values : as in the file; NaN where a cell is empty.
    axis, axis_by_line : unit of `wavelengths`, and whether a line above the table gives it.
    axis_words : its heading and the unit below.
    bad : line and text of the first cell that is neither a number nor empty.
    in_percent, without_sign : whether a number has a percent sign, and the largest of those that have none.
    beside : other cells that belong to it, by header.
    unit_open : whether the table calls them wavelengths and gives no unit.
    unsaid : whether nothing says that they are wavelengths.
    over : the unit of frequencies or energies that it runs over, "" for wavelengths.
    place : its column and that of its wavelengths, where both run down.
    around, preamble : words, and keys and values, of the lines above its table.
    table, alike : number of its table in the file, and of the first one with the same headings.
    grid_nm, samples : (L,) wavelengths and values.
    colours : what the table states beside it.
    signs, decision : what was seen of what it measures, and what follows.
    scale, refusal : what its values are divided by, and why it cannot be taken.
    likeness : the published table whose numbers it has.
    """

    name: str
    words: str
    unit: str
    wavelengths: array[float]
    axis: AxisUnit = NANOMETRE
    axis_by_line: bool = False
    axis_words: str = ""
    values: array[float] = field(default_factory=lambda: array("d"))
    bad: tuple[int, str] | None = None
    in_percent: bool = False
    without_sign: float = 0.0
    beside: dict[str, str] = field(default_factory=dict)
    unit_open: bool = False
    unsaid: bool = False
    over: str = ""
    place: tuple[int, int] = (0, 0)
    around: str = ""
    preamble: dict[str, str] = field(default_factory=dict)
    table: int = 0
    alike: int = 0
    grid_nm: np.ndarray = field(default_factory=lambda: np.empty(0))
    samples: np.ndarray = field(default_factory=lambda: np.empty(0))
    colours: tuple[StatedColour, ...] = ()
    signs: Sequence[Sign] = ()
    decision: Decision | None = None
    scale: Divisor | None = None
    refusal: InputError | None = None
    likeness: Likeness | None = None

    def take(self, line: int, cell: str, dialect: Dialect) -> None:
        """Add the value in a cell."""
        value = dialect.number(cell)
        if value != value and self.bad is None and not is_missing(cell):
            self.bad = (line, cell)
        if cell[-1:] == "%":
            self.in_percent = True
        elif value > self.without_sign:
            self.without_sign = value
        self.values.append(value)

    @property
    def heading(self) -> str:
        """Its header and its unit."""
        return f"{self.words} {self.unit}"

    @property
    def is_empty(self) -> bool:
        """True if it has no value at all."""
        return all(value != value for value in self.values)


@dataclass(frozen=True)
class Text:
    """A file's lines by number: those of rows, and the words of comments."""

    dialect: Dialect
    rows: list[tuple[int, str]]
    comments: list[tuple[int, str]]

    def cells(self, first: int, last: int) -> list[Row]:
        """Rows of cells, by their place among the rows, fewer where their lines are very long."""
        shown: list[Row] = []
        held = 0
        for line, text in self.rows[first:last]:
            shown.append((line, trimmed(self.dialect.cells(text))))
            held += len(text)
            if held > _SHOWN_CHARACTERS:
                break
        return shown

    def place(self, line: int) -> int:
        """Place among the rows of the first that is on this line or below."""
        return bisect_left(self.rows, line, key=_LINE)

    def said(self, after: int, before: int) -> list[str]:
        """Comments on the lines between two others, of the first thousands."""
        end = bisect_left(self.comments, min(before, after + SHOWN_LINES + 1), key=_LINE)
        return [words for _, words in self.comments[bisect_right(self.comments, after, key=_LINE) : end] if words]

    def parted(self, after: int, before: int) -> bool:
        """Return whether a comment stands between two lines, or on the second."""
        return bisect_right(self.comments, before, key=_LINE) > bisect_right(self.comments, after, key=_LINE)


@dataclass
class Section:
    """One table of the file.

    Parameters
    ----------
    start : place of the first row about it; `shown` holds that and the following ones.
    layout : where its numbers are among those.
    heads, units : names of its columns, and the row of units below them.
    above : the rows over its names.
    preamble, words : what those and comments say: keys and values, and all words, a line each.
    blocks : its spectra; several lists where the wavelengths start again further down.
    last_line : the last line that was read; what follows is about the next table.
    further : where that begins: its first line of numbers ("down"), or its header of wavelengths ("across").
    samples : how many were read.
    """

    text: Text
    start: int
    shown: list[Row]
    layout: TableLayout
    heads: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    above: list[Row] = field(default_factory=list)
    preamble: dict[str, str] = field(default_factory=dict)
    words: str = ""
    blocks: list[list[Column]] = field(default_factory=list)
    last_line: int = 0
    further: tuple[int, Way] | None = None
    samples: int = 0

    def count(self, samples: int) -> None:
        """Add to the samples that were read; more than any file should hold are refused."""
        self.samples += samples
        if self.samples > MOST_SAMPLES:
            raise InputError("too many samples in one file", expected=f"at most {MOST_SAMPLES}")


def cell(cells: Sequence[str], at: int) -> str:
    """Return a cell of a row, "" beyond its end."""
    return cells[at] if at < len(cells) else ""


def trimmed(cells: Sequence[str]) -> list[str]:
    """Cells without the empty ones at the end."""
    count = len(cells)
    while count > 1 and not cells[count - 1]:
        count -= 1
    return list(cells[:count])


def ragged(line: int, found: int, expected: int, cells: Sequence[str] = ()) -> InputError:
    """Return the refusal of a row that is shorter or longer than its table; `cells` of it are shown."""
    return InputError(
        "a row is cut short" if found < expected else "a row is too long",
        field=f"line {line}",
        found=f"{found} cells" + (f": {shortened(' | '.join(cells[:6]), 60)}" if cells else ""),
        expected=f"{expected} cells, as in the header",
        hint="the file may be truncated; export it again"
        if found < expected
        else "where commas part the cells and are the decimal marks, too, export it with semicolons or tabs",
    )


def check_shifted(columns: Sequence[Column], last: str) -> None:
    """Refuse rows whose last wavelength is empty in all of them, and that have a number with decimals below one and the
    same heading before: a cell that is missing there moves all others by a wavelength; last : heading of the last.
    """
    if not columns or any(column.values[-1] == column.values[-1] for column in columns):
        return
    for head in columns[0].beside:
        cells = [column.beside.get(head, "") for column in columns]
        if colour_axis(head) is None and all(re.fullmatch(r"\d*[.,]\d+ ?%?", text) for text in cells):
            raise InputError(
                "cells that may stand one wavelength too far left",
                field=head,
                found=f"{', '.join(cells[:3])}; and no value at {columns[0].wavelengths[-1]:g}, the last wavelength",
                expected="a cell below each heading",
                hint=f"put the cell back that is missing before {shortened(last, 40)}, or leave that heading out",
            )
