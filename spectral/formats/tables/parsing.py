"""Text tables of spectra: wavelengths down the columns or across the header, with titles above and anything beside."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from ..shared.text import MOST_LINES, is_jcamp, read_lines, shortened
from ..shared.words import colour_axis, quantity_in
from .across import AcrossReader
from .column import Column, NextTable, trimmed
from .dialect import Dialect, checked_lines, comment, dialect_of
from .down import DownReader, is_generic
from .layout import (
    Layout,
    Row,
    header_above,
    is_name_header,
    is_units_row,
    is_wavelength_header,
    layout_of,
    plain_wavelengths,
    told_wavelengths,
)

# Lines, and characters of them, that the layout is looked for in.
_SHOWN_LINES, _SHOWN_CHARACTERS = 2000, 5_000_000
# Rows of a further table, from its first, that say where its wavelengths are.
_FIRST_ROWS = 6


@dataclass
class Table:
    """What a text table holds.

    Parameters
    ----------
    blocks : the spectra; several lists where the wavelengths start again further down.
    preamble, words : keys and values above the first table; all words there, a line each.
    notes : what was passed over.
    """

    dialect: Dialect
    blocks: list[list[Column]]
    preamble: dict[str, str]
    words: str
    notes: list[str]


@dataclass(frozen=True)
class _Text:
    """A file's lines apart: those of rows, with their numbers (in `lines` once more), and those of comments."""

    path: Path
    dialect: Dialect
    rows: list[tuple[int, str]]
    lines: list[int]
    comments: list[int]
    remarks: list[str]

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

    def said(self, after: int, before: int) -> list[str]:
        """Comments on the lines between two others, of the first thousands."""
        end = bisect_left(self.comments, min(before, after + _SHOWN_LINES + 1))
        return [words for words in self.remarks[bisect_right(self.comments, after) : end] if words]


@dataclass
class _Section:
    """One table of the file: rows from `start`, about it and of it."""

    start: int
    shown: list[Row]
    layout: Layout
    heads: list[str]
    preamble: dict[str, str]
    words: str
    blocks: list[list[Column]]
    next: NextTable | None


def parse_table(path: Path) -> Table:
    """Find and read the tables of a text file.

    Raises
    ------
    InputError
        No table, rows cut short, words among the wavelengths, an axis of wavenumbers, or a further table whose header
        cannot be told.
    """
    lines = checked_lines(read_lines(path), path)
    if is_jcamp("\n".join(lines[:9])):
        raise InputError(
            "JCAMP-DX is not a table",
            file=path,
            found=shortened(next(line for line in lines if line.strip()), 40),
            expected="a wavelength and its values on each line",
            hint="export the measurement as CSV: its packed values need the factors and units of its header",
        )
    said = [(index, words) for index, line in enumerate(lines, 1) if (words := comment(line)) is not None]
    plain = [(index, line) for index, line in enumerate(lines, 1) if line.strip() and comment(line) is None]
    dialect = dialect_of([line for _, line in plain])
    text = _Text(
        path, dialect, plain, [index for index, _ in plain], [index for index, _ in said], [words for _, words in said]
    )
    shown = text.cells(0, _SHOWN_LINES)
    layout = layout_of(shown, dialect)
    if layout is None:
        raise InputError(
            "no table of wavelengths and values",
            file=path,
            found=shortened(" | ".join(line for _, line in plain[:2]) or "comments alone"),
            expected="wavelengths down the first column or across a header, numbers beside them",
        )
    notes: list[str] = []
    first = section = _read(text, 0, shown, layout, None, notes)
    sections = [first]
    while section.next is not None:
        section = _read(text, *_further(text, section.next, section.layout), section, notes)
        sections.append(section)
    _told_apart(sections, notes)
    return Table(dialect, [block for each in sections for block in each.blocks], first.preamble, first.words, notes)


def _further(text: _Text, found: NextTable, before: Layout) -> tuple[int, list[Row], Layout]:
    """Place of the first row about another table, its first rows, and where its wavelengths are."""
    start, at = bisect_right(text.lines, found.after), bisect_left(text.lines, found.line)
    shown, first = text.cells(start, at + _FIRST_ROWS), at - start
    if found.way == "across":
        axes = told_wavelengths(shown[first][1], text.dialect) or plain_wavelengths(shown[first][1], text.dialect)
        units = first + 2 < len(shown) and is_units_row(shown[first + 1][1])
        return start, shown, Layout("across", first + (2 if units else 1), first, axes)
    layout = layout_of(shown, text.dialect)
    if layout is None or layout.way != "down" or layout.first != first:
        layout = Layout("down", first, header_above(shown, first, text.dialect), before.axes)
    return start, shown, layout


def _read(
    text: _Text, start: int, shown: list[Row], layout: Layout, before: _Section | None, notes: list[str]
) -> _Section:
    """Read one table, up to where another begins."""
    dialect, path = text.dialect, text.path
    after = text.rows[start - 1][0] if before is not None else 0
    first_line = shown[layout.first][0] if layout.first < len(shown) else shown[-1][0] + 1
    remarks = text.said(after, first_line)
    heads = shown[layout.header][1] if layout.header is not None else _commented_header(remarks, shown, layout, dialect)
    described = layout.way == "down" and not (heads and (dialect.delimiter or is_wavelength_header(heads[0])))
    described = _described_header(text, start, layout, shown) if described else []
    if described:
        heads = described
    elif not dialect.delimiter and heads and layout.first < len(shown):
        heads = _spaced_header(heads, len(shown[layout.first][1]))
    above = shown[: layout.first if layout.header is None else layout.header]
    preamble, words = _preamble(above, remarks)
    between = shown[layout.header + 1 : layout.first] if layout.header is not None else []
    if before is not None and not heads:
        heads = _as_before(before, words, shown, layout, path)
        if any(heads):
            notes.append("further down, numbers without a header are read under the one above them in the file")
    numbered = ((line, dialect.cells(row)) for line, row in _from(text.rows, start + layout.first))
    if layout.way == "across":
        reader = AcrossReader(layout, heads, dialect, path)
    else:
        units = next((cells for _, cells in between if is_units_row(cells)), [])
        colours = [cells for _, cells in shown[: layout.first] if colour_axis(cells[0]) and len(cells) > 1]
        reader = DownReader(
            layout,
            heads,
            units,
            above if layout.header is not None else [],
            colours,
            words,
            text.comments,
            dialect,
            path,
        )
    blocks = reader.read(numbered, notes)
    following = reader.next
    if isinstance(reader, DownReader) and reader.below:
        following = _across_below(text, reader.last_line)
        if following is None:
            notes.append(f"{reader.below} lines below the table are not read")
    preamble, words = _preamble(above, text.said(after, following.after + 1 if following else MOST_LINES + 1))
    return _Section(start, shown, layout, heads, preamble, words, blocks, following)


def _from(rows: list[tuple[int, str]], first: int) -> Iterator[tuple[int, str]]:
    return (rows[index] for index in range(first, len(rows)))


def _across_below(text: _Text, last_line: int) -> NextTable | None:
    """The header of wavelengths across, each with its unit, among the rows below a table; None where there is none."""
    first = bisect_right(text.lines, last_line)
    for line, cells in text.cells(first, first + _SHOWN_LINES):
        if len(cells) > 2 and told_wavelengths(cells, text.dialect):
            return NextTable(last_line, line, "across")
    return None


def _as_before(before: _Section, words: str, shown: Sequence[Row], layout: Layout, path: Path) -> list[str]:
    """Headings of a further table without its own: those of the table before, less what its own title says otherwise.

    Raises
    ------
    InputError
        It has other columns, or its title contradicts headings that are also names.
    """
    cells, heads = shown[layout.first][1], before.heads
    told = quantity_in(words)
    contradicted = told is not None and any(quantity_in(head) not in (None, told) for head in heads)
    above = shown[layout.first - 1][1] if layout.first else []
    unread = len(above) == len(cells) > 2  # as wide as a header, and not understood as one
    if len(cells) == len(before.shown[before.layout.first][1]) and layout.axes == before.layout.axes and not unread:
        if not contradicted:
            return heads
        if all(is_generic(head) for at, head in enumerate(heads) if at not in layout.axes):
            return [head if at in layout.axes else "" for at, head in enumerate(heads)]
    raise InputError(
        "another table without a header",
        file=path,
        field=f"line {shown[layout.first][0]}",
        found=shortened(" | ".join(cells[:6])),
        expected="a row above it that says what its columns are, or the same columns as in the table before",
        hint="write a header above its numbers, or save it as a file of its own",
    )


def _told_apart(sections: Sequence[_Section], notes: list[str]) -> None:
    """Put beside each column what is said of its table; what the first one's lines alone say holds on, and is noted."""
    first = sections[0]
    titles = [_title(section) for section in sections]
    alike: dict[tuple[str, ...], int] = {}
    for number, section in enumerate(sections):
        title = titles[number] if len(sections) > 1 and titles.count(titles[number]) == 1 else ""
        same = alike.setdefault(tuple(section.heads), number)
        around = section.words
        if number and quantity_in(around) is None and (above := quantity_in(first.words)) is not None:
            around = f"{around}\n{first.words}"
            if not all(quantity_in(f"{column.words} {column.unit}") for block in section.blocks for column in block):
                notes.append(f"the file begins with a line about {above}; so it is taken to be further down")
        for column in (column for block in section.blocks for column in block):
            column.around, column.preamble, column.table, column.alike = around, section.preamble, number, same
            if title and section.layout.way == "down" and (not column.name or is_generic(column.name)):
                column.name = f"{title} {column.name}".strip()
            elif len(sections) > 1 and "title" in section.preamble:
                column.beside.setdefault("title", section.preamble["title"])


def _title(section: _Section) -> str:
    """The sample that the lines above a table name, "" where they name none: by a key, or right above the header."""
    named = next((value for key, value in section.preamble.items() if key != "title" and is_name_header(key)), "")
    layout = section.layout
    above = section.shown[: layout.first if layout.header is None else layout.header]
    cells = [cell for cell in above[-1][1] if cell] if above else []
    alone = cells[0] if len(cells) == 1 else ""
    comment_alone = section.preamble.get("comments", "") if not above else ""
    title = named or alone or ("" if ";" in comment_alone else comment_alone)
    return "" if ":" in title or quantity_in(title) or is_generic(title) else shortened(title)


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
    """The last comment above the numbers, if it has as many cells as the first row of them: then it is the header."""
    if layout.first == 0 and remarks:
        cells = trimmed(dialect.cells(remarks[-1]))
        if len(cells) == len(shown[0][1]):
            return cells
    return []


def _described_header(text: _Text, start: int, layout: Layout, shown: Sequence[Row]) -> list[str]:
    """Names of the columns where no row of cells is a header; [] if there are none.

    White space: a line above whose phrases, two spaces or more apart, are as many as the columns, wavelengths first.
    Wavelengths with their unit: a row of titles among the keys and values above.
    """
    width = len(shown[layout.first][1])
    for index in range(start, start + layout.first):
        if text.dialect.delimiter:
            cells = shown[index - start][1]
            if width > 2 and len(cells) == width and re.fullmatch(r"title|memo|(?:sample )?name\W*", cells[0], re.I):
                return cells
        elif width > 2:
            phrases = re.split(r"\s{2,}", text.rows[index][1][:1000].strip())
            if len(phrases) == width and is_wavelength_header(phrases[0]):
                return phrases
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
