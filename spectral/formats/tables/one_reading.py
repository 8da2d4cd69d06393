"""The one way to read a table: what parts its cells, and which mark is the decimal one.

A way explains a row that has a wavelength and a number or more, no more cells than the table has headings, and no cell
of torn numbers ("0 7", "7,09" beside decimal points). A table is read where one way alone explains all of its rows, or
several that find the same numbers. Where two find different ones, the person is asked; where none explains them, the
rows are refused as they are read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise, zip_longest
from typing import NamedTuple, NoReturn

from ....runtime.errors import InputError
from ..import_options import Decimal
from ..shared.text import shortened
from .dialect import Dialect, dialects_of, is_torn
from .layout import Row, TableLayout, layout_of
from .section import SHOWN_LINES, Text

# Rows that two ways are compared on; all others are held to the one that is chosen while they are read.
_COMPARED_ROWS = 200
_MARKS: dict[Decimal, str] = {"point": ".", "comma": ","}
# Digits behind a decimal comma: no program writes a whole number with a zero before it.
_CUT_OFF = re.compile(r"0\d+")
_WHOLE, _TWO_WHOLE = re.compile(r"\d+"), re.compile(r"\d+\s*[^A-Za-z0-9\s.,]+\s*\d+")
# Headings of columns that hold words about a row, which most rows have none of.
_ASIDE = re.compile(
    r"\W*(?:(?:re)?mark(?:s|ed)?|comments?|notes?|annotations?|flags?|status|state|quality|valid|error|warnings?|operator|user|"
    r"date|time|bemerkung(?:en)?|anmerkung(?:en)?|kommentare?|hinweise?|notizen?|remarques?|commentaires?|"
    r"observa(?:tions?|ciones)|comentarios?|notas?|osservazion[ei]|opmerkingen?|n\.?b\.?|)\W*",
    re.I,
)
_IN_THOUSANDS = {mark: re.compile(rf"[-+]?[1-9]\d{{0,2}}(?:\{mark}\d{{3}})+") for mark in ".,"}
_BELOW_A_THOUSAND = re.compile(r"[-+]?[1-9]\d{0,2}")
#: Hint for a table whose decimal commas part its cells, too.
APART = "export it with semicolons or tabs between the cells, or with decimal points"


class Way(NamedTuple):
    """One way to read a table: its text, the first rows and where its numbers are among them."""

    text: Text
    shown: list[Row]
    layout: TableLayout

    def rows(self) -> Iterator[Row]:
        """Rows of numbers, of the first thousands, up to one without a wavelength."""
        for line, cells in self.shown[self.layout.first :]:
            if not self.has_wavelength(cells):
                return
            yield line, cells

    def has_wavelength(self, cells: Sequence[str]) -> bool:
        """Return whether a row is one of numbers, as far as its wavelength tells."""
        return self.layout.way == "across" or any(
            at < len(cells) and self.text.dialect.wavelength(cells[at]) for at in self.layout.axes
        )

    def headings(self) -> int:
        """Number of headings of its columns; 0 where no row names them."""
        return 0 if self.layout.header is None else len(self.shown[self.layout.header][1])

    def values(self, cells: Sequence[str]) -> Sequence[str]:
        """Return the cells of a row that hold wavelengths or values."""
        return cells if self.layout.way == "down" else [cells[at] for at in self.layout.axes if at < len(cells)]

    def explains(self) -> bool:
        """Return whether it explains the first rows."""
        rows = [cells for _, cells in self._compared()]
        most = self.headings() or max(map(len, rows), default=0)
        return bool(rows) and all(
            len(cells) <= most and torn(self.values(cells), self.text.dialect) is None for cells in rows
        )

    def numbers(self) -> dict[int, list[float]]:
        """Return the numbers of the first rows, by line."""
        read = self.text.dialect.number
        found = {line: [read(cell) for cell in self.values(cells)] for line, cells in self._compared()}
        return {line: [number for number in row if not math.isnan(number)] for line, row in found.items()}

    def _compared(self) -> Iterator[Row]:
        return (row for _, row in zip(range(_COMPARED_ROWS), self.rows(), strict=False))


def one_reading(
    plain: list[tuple[int, str]], comments: list[tuple[int, str]], decimal: Decimal | None = None
) -> Way | None:
    """Return the way to read the rows of a text (number of the line, line), None where there is no table.

    Parameters
    ----------
    decimal : the decimal mark that a person says, where two ways explain the rows.

    Raises
    ------
    InputError
        Two ways explain them, and nobody says which it is.
    """
    ways: list[Way] = []
    dialects = dialects_of([line for _, line in plain])
    if dialects[0].delimiter in ("\t", ";", "|"):
        # White space is inside cells, too; a tab, a semicolon or a bar is between them alone.
        dialects = [dialect for dialect in dialects if dialect.delimiter]
    for dialect in dialects:
        text = Text(dialect, plain, comments)
        shown = text.cells(0, SHOWN_LINES)
        layout = layout_of(shown, dialect)
        if layout is not None:
            ways.append(Way(text, shown, layout))
    explained = [way for way in ways if way.explains()] if len(ways) > 1 else ways
    chosen = next(iter(explained or ways), None)
    if chosen is None:
        return None
    _check_cut_off(chosen)
    if (other := _another(chosen, explained)) is not None:
        known = [chosen, *explained]
        if _torn_at_commas(chosen) and (paired := _paired(chosen)) is not None:
            known.append(paired)
        by_mark = {
            mark: way for mark, sign in _MARKS.items() for way in known[::-1] if way.text.dialect.decimal == sign
        }
        if decimal is None:
            # Advise no option that is refused next.
            options = " or ".join(f"--decimal {mark}" for mark in sorted(by_mark))
            _ask(chosen, *other, f"say which mark is the decimal one: {options}; or {APART}")
        if decimal not in by_mark:
            _ask(chosen, *other, f"--decimal {decimal} does not tell its cells apart: {APART}")
        return by_mark[decimal]
    return chosen


def _another(chosen: Way, explained: Sequence[Way]) -> tuple[int, str] | None:
    """Return a row that another way reads as other numbers: its line, and its cells in that way. None where there is
    none.
    """
    numbers = chosen.numbers() if len(explained) > 1 else {}
    for way in explained:
        if way is not chosen:
            for (line, found), (_, cells) in zip(way.numbers().items(), way.rows(), strict=False):
                if numbers.get(line, found) != found:
                    return line, _shown(cells)
    return _torn_at_commas(chosen) or _thousands(chosen)


def _torn_at_commas(way: Way) -> tuple[int, str] | None:
    """Return a row of whole numbers that commas part: each pair of them may be one number, below no headings, or where
    only headings such as "Remark" would be left without a cell.
    """
    if way.text.dialect.delimiter != "," or way.layout.way != "down":
        return None
    headings, row = _headings(way), None
    for line, cells in way.rows():
        if len(cells) < 2 or not all(map(_WHOLE.fullmatch, cells)) or '"' in _line(way, line):
            return None
        paired = _in_pairs(cells)
        without = headings[len(paired) :]
        if headings and not (without and all(map(_ASIDE.fullmatch, without))):
            return None
        if row is None and len(cells) > 2:
            row = line, _shown(paired)
    return row


def _paired(way: Way) -> Way | None:
    """Return a table of whole numbers between commas read by decimal commas: each value of two cells, and the
    wavelength of one, or of two where the second is nothing but zeros. None where its rows are not all of as many
    cells.
    """
    cells_of, rows = way.text.dialect.cells, list(way.rows())
    counts = {len(cells) for _, cells in rows}
    odd = min(counts) % 2
    if len(counts) > 1 or (not odd and any(cells[1].strip("0") for _, cells in rows)):
        return None
    (count,) = counts
    first, columns = rows[0][0], (count + 1) // 2
    header = way.shown[way.layout.header][0] if way.layout.header is not None else None

    def rewritten(line: int, text: str) -> str:
        cells = cells_of(text)
        if line >= first and len(cells) == count and all(map(_WHOLE.fullmatch, cells)):
            return ";".join(_in_pairs(cells))
        return ";".join(cells[:columns]) if line == header else text

    plain = [(line, rewritten(line, text)) for line, text in way.text.rows]
    comments = [
        (line, ";".join(cells[:columns]) if line < first and len(cells := cells_of(text)) == count else text)
        for line, text in way.text.comments
    ]
    text = Text(Dialect(";", ","), plain, comments)
    shown = text.cells(0, SHOWN_LINES)
    layout = layout_of(shown, text.dialect)
    return None if layout is None else Way(text, shown, layout)


def _in_pairs(cells: Sequence[str]) -> list[str]:
    odd = len(cells) % 2
    return [*cells[:odd], *map(",".join, zip(cells[odd::2], cells[odd + 1 :: 2], strict=True))]


def _check_cut_off(way: Way) -> None:
    """Refuse rows with digits that nothing but a decimal comma stands before, which parts cells there, too."""
    if way.layout.way == "down" and way.text.dialect.delimiter == ",":
        for line, cells in way.shown[way.layout.first :]:
            if _cut_off(cells, way.text.dialect):
                check_whole(cells, way.text.dialect, line)
        rows = list(way.rows())
        if rows and all(_is_torn_between(cells) for _, cells in rows):
            # Cells as in "400,0/7,09" and "400,0,,7,09".
            line, cells = rows[0]
            _refuse(next(filter(_TWO_WHOLE.fullmatch, cells), ",".join(cells)), way.text.dialect, line)


def _headings(way: Way) -> list[str]:
    """Return the headings of the columns, of a row or of the comment above the numbers; empty where there is none for
    each.
    """
    if way.layout.header is not None:
        return list(way.shown[way.layout.header][1])
    line, cells = way.shown[way.layout.first]
    above = way.text.said(0, line) if way.layout.first == 0 else []
    said = way.text.dialect.cells(above[-1]) if above else []
    return said if len(said) == len(cells) else []


def _thousands(way: Way) -> tuple[int, str] | None:
    """Return a row whose decimal mark may part thousands: each number that has it has three digits behind it and no
    zero before it, and others of its column are whole and below a thousand.
    """
    dialect = way.text.dialect
    if dialect.delimiter == ",":
        return None
    mark, grouped = dialect.decimal, _IN_THOUSANDS[dialect.decimal]
    # Keys and values stand between tables.
    below = ((line, cells) for line, cells in way.shown[way.layout.first :] if way.has_wavelength(cells))
    rows = [(line, way.values(cells)) for line, cells in below]
    if not all(grouped.fullmatch(cell) for cell in rows[0][1] if mark in cell):
        return None
    columns = zip_longest(*(cells for _, cells in rows), fillvalue="")
    groups = columns if way.layout.way == "down" else ([cell for column in columns for cell in column],)
    if not any(_is_mixed(group, mark) for group in groups):
        return None
    marked = [(line, cell, cells) for line, cells in rows for cell in cells if mark in cell]
    if not all(grouped.fullmatch(cell) for _, cell, _ in marked):
        return None
    line, _, cells = marked[0]
    return line, _shown([cell.replace(mark, "") for cell in cells])


def _is_mixed(cells: Sequence[str], mark: str) -> bool:
    """Return whether some of the cells have the mark and others are whole numbers below a thousand."""
    without = [cell for cell in cells if mark not in cell]
    return len(without) < len(cells) and any(map(_BELOW_A_THOUSAND.fullmatch, without))


def _line(way: Way, line: int) -> str:
    return way.text.rows[way.text.place(line)][1]


def _shown(cells: Sequence[str]) -> str:
    return shortened(" | ".join(cells[:6]), 60)


def _ask(chosen: Way, line: int, other: str, hint: str) -> NoReturn:
    cells = next(cells for at, cells in chosen.rows() if at == line)
    raise InputError(
        "two ways to read the table",
        field=f"line {line}",
        found=f"{_shown(cells)}, or {other}",
        expected="one decimal mark, and another between the cells",
        hint=hint,
    )


def torn(cells: Sequence[str], dialect: Dialect) -> str | None:
    """Return the first of these cells that holds a piece of a number, or pieces of several; None where none does."""
    return next((cell for cell in cells if is_torn(cell, dialect.decimal)), None) or _cut_off(cells, dialect)


def _cut_off(cells: Sequence[str], dialect: Dialect) -> str | None:
    """Digits that a comma parts from the whole number before them, and that no number of their own begins with."""
    if dialect.delimiter != "," or len(cells) < 3:
        return None
    behind = ((cell, before) for before, cell in pairwise(cells) if cell[:1] == "0")
    return next((cell for cell, before in behind if _CUT_OFF.fullmatch(cell) and _WHOLE.fullmatch(before)), None)


def check_whole(cells: Sequence[str], dialect: Dialect, line: int) -> None:
    """Refuse a row with a cell that holds pieces of numbers: it is not written as the other rows of its table."""
    found = torn(cells, dialect)
    if found is not None:
        _refuse(found, dialect, line)


def _is_torn_between(cells: Sequence[str]) -> bool:
    """Return whether cells are whole numbers, and pairs of them around a sign that parts no cells, or nothing."""
    pairs = [cell for cell in cells if _TWO_WHOLE.fullmatch(cell)]
    gaps = len(cells) > 3 and "" in cells[1:-1]
    return bool(pairs or gaps) and all(_WHOLE.fullmatch(cell) or cell in pairs for cell in cells if cell)


def _refuse(found: str, dialect: Dialect, line: int) -> NoReturn:
    mark = "point" if dialect.decimal == "." else "comma"
    parts = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas"}.get(dialect.delimiter, "white space")
    raise InputError(
        "no way to read the table explains this row",
        field=f"line {line}",
        found=f"{shortened(found, 40)!r}, where {parts} part the cells and the decimal mark is a {mark}",
        expected="a number in each cell, with one decimal mark and no mark between thousands",
        hint=APART,
    )
