"""Text tables of spectra: wavelengths down the columns or across the header, with titles above and anything beside."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

from ....runtime.errors import InputError
from ...measurement import is_condition
from ..import_options import NO_ANSWER, ImportOptions
from ..shared.colour_words import colour_axis
from ..shared.decisions import colours_alone
from ..shared.text import MOST_LINES, is_jcamp, read_lines, shortened
from ..shared.words import quantity_in
from .axis import LIGHT_NM, axis_unit, is_reciprocal_header
from .dialect import Dialect, check_lengths, comment
from .layout import (
    Row,
    TableLayout,
    Way,
    header_above,
    is_name_header,
    is_sample_key,
    is_units_row,
    is_wavelength_header,
    labelled_wavelengths,
    layout_of,
    wavelengths_across,
)
from .long_form import long_form, names_beside, read_long
from .one_reading import one_reading
from .rows import is_generic, read_across, read_down
from .section import SHOWN_LINES, Column, Section, Text, trimmed

# Key of a reading's name in a line of its own.
_READING = re.compile(r"(?:measurement|messung|reading|scan|spectrum|spektrum|run|file)[ _-]*(?:name|id|no\.?)?", re.I)
# Rows that the end of the last line is compared with; and what is before the decimals of a number.
_COMPARED_ROWS = 12
_TO_MARK = re.compile(r"[^.,]*")
# Fewest numbers of light as headings of spectra that may be wavelengths.
_FEWEST_ACROSS = 5
# Characters of a line that may head columns parted by another sign.
_LONGEST_HEADER = 20_000
# Rows of a further table, from its first, that say where its wavelengths are.
_FIRST_ROWS = 6


@dataclass
class TextTable:
    """Content of a text table.

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


def parse_table(path: Path, answer: ImportOptions = NO_ANSWER) -> TextTable:
    """Find and read the tables of a text file.

    Parameters
    ----------
    answer : the decimal mark that a person says, where the file can be read in two ways.

    Raises
    ------
    InputError
        No table, two ways to read it, rows cut short or longer than the header, words among the wavelengths, an axis of
        wavenumbers, or a further table whose header cannot be told.
    """
    lines = read_lines(path)
    _check_end(lines)
    return parse_lines(lines, answer)


def _check_end(lines: Sequence[str]) -> None:
    """Refuse a last number without the end of its line that is shorter than every other of its column."""
    if not lines[-1].strip():
        return
    *before, last = [_decimals(line) for line in lines[-_COMPARED_ROWS - 1 :] if line.strip()]
    usual = before[-1] if before else ""
    if before == [usual] * _COMPARED_ROWS and last != usual and usual.startswith(last):
        raise InputError(
            "the last number is cut short",
            field=f"line {len(lines)}",
            found=f"{shortened(lines[-1][-40:])!r} and no end of the line",
            expected=f"{len(usual) - 1} characters behind the decimal mark, as above it",
            hint="the file may be truncated: export it again; where it is whole, end its last line",
        )


def _decimals(line: str) -> str:
    """Return what stands from the decimal mark of the last cell on, each digit as 0."""
    between = next((mark for mark in ";\t" if mark in line), None if " " in line.strip() else ",")
    return _TO_MARK.sub("", re.sub(r"\d", "0", (line.split(between) or [""])[-1].strip()), count=1)


def parse_lines(lines: list[str], answer: ImportOptions = NO_ANSWER) -> TextTable:
    """Find and read the tables in the lines of a text, as `parse_table` does."""
    check_lengths(lines)
    if is_jcamp("\n".join(lines[:9])):
        raise InputError(
            "JCAMP-DX is not a table",
            found=shortened(next(line for line in lines if line.strip()), 40),
            expected="a wavelength and its values on each line",
            hint="read it as what it is: its packed values need the factors and units of its header",
        )
    comments: list[tuple[int, str]] = []
    plain: list[tuple[int, str]] = []
    for number, line in enumerate(lines, 1):
        if (words := comment(line)) is not None:
            comments.append((number, words))
        elif line.strip():
            plain.append((number, line))
    way = one_reading(plain, comments, answer.decimal)
    if way is None:
        raise InputError(
            "no table of wavelengths and values",
            found=shortened(" | ".join(line for _, line in plain[:2]) or "comments alone"),
            expected="wavelengths down the first column or across a header, numbers beside them",
        )
    notes: list[str] = []
    sections = [Section(way.text, 0, way.shown, way.layout)]
    _read(sections[0], None, notes)
    while sections[-1].further is not None:
        sections.append(_further(sections[-1], *sections[-1].further))
        _read(sections[-1], sections[-2], notes)
    _kept_apart(sections, notes)
    first = sections[0]
    blocks = [block for each in sections for block in each.blocks]
    return TextTable(way.text.dialect, blocks, first.preamble, first.words, notes)


def _further(before: Section, line: int, way: Way) -> Section:
    """Return the table that begins below another: from its first row, with its first rows, and where its wavelengths
    are.
    """
    text, dialect = before.text, before.text.dialect
    start = text.place(before.last_line + 1)
    first = text.place(line) - start
    shown = text.cells(start, start + first + _FIRST_ROWS)
    if way == "across":
        cells = shown[first][1]
        axes = labelled_wavelengths(cells, dialect) or wavelengths_across(cells, dialect)
        units = first + 2 < len(shown) and is_units_row(shown[first + 1][1])
        return Section(text, start, shown, TableLayout("across", first + (2 if units else 1), first, axes))
    layout = layout_of(shown, dialect)
    if layout is None or layout.way != "down" or layout.first != first:
        layout = TableLayout("down", first, header_above(shown, first, dialect), before.layout.axes)
    return Section(text, start, shown, layout)


def _read(table: Section, before: Section | None, notes: list[str]) -> None:
    """Read one table, up to where another begins."""
    text, shown, layout = table.text, table.shown, table.layout
    after = text.rows[table.start - 1][0] if before is not None else 0
    remarks = text.said(after, shown[layout.first][0] if layout.first < len(shown) else shown[-1][0] + 1)
    between = shown[layout.header + 1 : layout.first] if layout.header is not None else []
    table.units = next((cells for _, cells in between if is_units_row(cells)), [])
    table.above = shown[: layout.first if layout.header is None else layout.header]
    table.preamble, table.words = _preamble(table.above, remarks, text)
    table.heads = _heads(table, remarks)
    if before is not None and not table.heads:
        table.heads = _as_before(before, table)
        if any(table.heads):
            notes.append("further down, numbers without a header are read under the one above them in the file")
    if layout.way == "down":
        _check_header(table)
    if layout.way == "down" and _is_of_colours(table):
        raise colours_alone(shortened(", ".join(table.heads[:8])))
    numbered = ((line, text.dialect.cells(row)) for line, row in islice(text.rows, table.start + layout.first, None))
    names = names_beside(table) if before is None and layout.way == "down" else ()
    rows = list(numbered) if names else numbered
    if layout.way == "across":
        read_across(table, rows, notes)
    elif isinstance(rows, list) and (form := long_form(table, names, rows)) is not None:
        read_long(table, form, rows, notes)
    elif below := read_down(table, rows, notes):
        table.further = _across_below(table)
        if table.further is None:
            notes.append(f"{below} lines below the table are not read")
    end = MOST_LINES if table.further is None else table.last_line
    table.preamble, table.words = _preamble(table.above, text.said(after, end + 1), text)


def _check_header(table: Section) -> None:
    """Refuse headings of spectra that are all wavelengths of light beside an axis that no heading calls so: it may be
    the numbers of samples.
    """
    axes, dialect, first = table.layout.axes, table.text.dialect, table.shown[table.layout.first][1]
    cells = table.heads or (table.above[-1][1] if table.above else [])
    heads = [head for at, head in enumerate(cells) if at not in axes]
    numbers = [dialect.number(head) for head in heads]
    if len(cells) != len(first) or len(numbers) < _FEWEST_ACROSS or not all(a < b for a, b in pairwise(numbers)):
        return
    said = any(is_wavelength_header(cells[axis]) or is_reciprocal_header(cells[axis]) for axis in axes)
    labelled = any(map(dialect.names_wavelength, first))
    if LIGHT_NM[0] <= numbers[0] and numbers[-1] <= LIGHT_NM[1] and not (said or labelled):
        raise InputError(
            "wavelengths down the first column, or across the header?",
            field="header",
            found=shortened(", ".join(heads), 60),
            expected="a first heading such as nm, where they run down, or Sample, where they run across",
            hint="write it into the first cell of the header",
        )


def _is_of_colours(table: Section) -> bool:
    """Return whether what would be the wavelengths is headed as one of the three numbers of a colour, all of which are
    there.
    """
    axes = [colour_axis(head) for head in table.heads]
    first = next((axes[at] for at in table.layout.axes if at < len(axes)), None)
    return first is not None and {axis[1] for axis in axes if axis is not None and axis[0] == first[0]} == {0, 1, 2}


def _across_below(table: Section) -> tuple[int, Way] | None:
    """Return the header of wavelengths across, each with its unit, among the rows below a table; None where there is
    none.
    """
    first = table.text.place(table.last_line + 1)
    for line, cells in table.text.cells(first, first + SHOWN_LINES):
        if len(cells) > 2 and labelled_wavelengths(cells, table.text.dialect):
            return line, "across"
    return None


def _as_before(before: Section, table: Section) -> list[str]:
    """Headings of a further table without its own: those of the table before, less what its own title says otherwise.

    Raises
    ------
    InputError
        It has other columns, or its title contradicts headings that are also names.
    """
    shown, layout = table.shown, table.layout
    cells, heads, named = shown[layout.first][1], before.heads, quantity_in(table.words)
    above = shown[layout.first - 1][1] if layout.first else []
    unread = len(above) == len(cells) > 2  # as wide as a header, and not understood as one
    if len(cells) == len(before.shown[before.layout.first][1]) and layout.axes == before.layout.axes and not unread:
        if named is None or all(quantity_in(head) in (None, named) for head in heads):
            return heads
        if all(is_generic(head) for at, head in enumerate(heads) if at not in layout.axes):
            return [head if at in layout.axes else "" for at, head in enumerate(heads)]
    raise InputError(
        "another table without a header",
        field=f"line {shown[layout.first][0]}",
        found=shortened(" | ".join(cells[:6])),
        expected="a row above it that says what its columns are, or the same columns as in the table before",
        hint="write a header above its numbers, or save it as a file of its own",
    )


def _kept_apart(sections: Sequence[Section], notes: list[str]) -> None:
    """Put beside each column what is said of its table; what the first one's lines alone say holds on, and is noted."""
    first = sections[0]
    titles = [_title(section) for section in sections]
    alike: dict[tuple[str, ...], int] = {}
    for number, section in enumerate(sections):
        title = titles[number] if len(sections) > 1 else ""
        if titles.count(title) > 1 and title != _named_by_key(section):
            title = ""  # of the file, or of its columns
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


def _title(section: Section) -> str:
    """Return the sample that the lines above a table name, "" where they name none: by a key, or right above the
    header.
    """
    named = _named_by_key(section)
    cells = [cell for cell in section.above[-1][1] if cell] if section.above else []
    alone = cells[0] if len(cells) == 1 else ""
    comment_alone = "" if section.above else section.preamble.get("comments", "")
    title = alone or ("" if ";" in comment_alone else comment_alone)
    return named or ("" if ":" in title or quantity_in(title) or is_generic(title) else shortened(title))


def _named_by_key(section: Section) -> str:
    """Return the sample that a key above a table names, "" where none does; a word for a sample goes before one for a
    reading.
    """
    keyed = [(key, value) for key, value in section.preamble.items() if key not in ("title", "comments")]
    found = [value for key, value in keyed if is_name_header(key)]
    found += [value for key, value in keyed if _READING.fullmatch(key)]
    return next((shortened(value) for value in found if not (quantity_in(value) or is_generic(value))), "")


def _preamble(above: Sequence[Row], remarks: Sequence[str], text: Text) -> tuple[dict[str, str], str]:
    """Keys and values above the table, and all words there, one line each."""
    found: dict[str, str] = {}
    lines, delimiter = [], text.dialect.delimiter
    for line, cells in above:
        filled = [cell for cell in cells if cell]
        if not delimiter:
            # White space parts words, and no keys from their values, unless it is a tab.
            parts = text.rows[text.place(line)][1][:4000].split("\t")
            filled = ["\t".join(" ".join(part.split()) for part in parts if part.strip())]
        parts = []
        if len(filled) == 1:
            parts = _labelled(filled[0]) or re.split(":" if delimiter else "[:=]", filled[0], maxsplit=1)
        lines.append(": ".join(filled[:40]))
        if len(parts) > 1:
            filled = [part.strip() for part in parts]
        if len(filled) > 1 and filled[1]:
            found.setdefault(shortened(filled[0].rstrip(":= "), 60), shortened(" ".join(filled[1:40])))
        elif filled:
            found.setdefault("title", shortened(filled[0]))
    for key, value in filter(None, map(_labelled, remarks[:200])):
        found.setdefault(shortened(key, 60), shortened(value))
    if remarks:
        found["comments"] = shortened("; ".join(remarks[:20]), 400)
    return found, "\n".join([*lines, *remarks[:200]])


def _labelled(line: str) -> list[str]:
    """Return a part of a measurement, or a word for a sample, and what a line such as "Filter = none" says of it; [] of
    any other.
    """
    parts = [part.strip(' \t",;:=') for part in re.split("[:=;,\t]", line, maxsplit=1)]
    known = len(parts) == 2 and (is_condition(parts[0], perhaps=True) or is_sample_key(parts[0]))
    return parts if known and parts[1] else []


def _heads(table: Section, remarks: Sequence[str]) -> list[str]:
    """Names of the columns, by a header of cells, a comment or words that say them in another way; [] without any."""
    dialect, shown, layout = table.text.dialect, table.shown, table.layout
    heads: list[str] = []
    if layout.header is not None:
        heads = shown[layout.header][1]
    elif layout.first == 0 and remarks:
        # The last comment above the numbers, if it has as many cells as the first row of them.
        cells = trimmed(dialect.cells(remarks[-1]))
        heads = cells if len(cells) == len(shown[0][1]) else []
    named = bool(heads) and (bool(dialect.delimiter) or len(heads) <= len(shown[layout.first][1]))
    named = named and bool(dialect.delimiter or is_wavelength_header(heads[0]))
    if layout.way == "down" and not named and (described := _described_header(table)):
        return described
    if layout.way == "across" or dialect.delimiter:
        return heads
    # White space parts the names and stands in them. Of two columns, all words after the first and its unit in brackets
    # name the second; of more, none can be told.
    width = len(shown[layout.first][1])
    if len(heads) <= width:
        return heads
    unit = 2 if heads[1].startswith(("(", "[")) or (len(heads) > 2 and axis_unit(heads[1])) else 1
    return [" ".join(heads[:unit]), " ".join(heads[unit:])] if width == 2 else []


def _described_header(table: Section) -> list[str]:
    """Names of the columns where no row of cells is a header; [] if there are none.

    A line above whose cells are as many as the columns, wavelengths first, parted by another sign than those of the
    numbers, or by two spaces or more. Wavelengths with their unit: a row of titles among the keys and values above.
    """
    width = len(table.shown[table.layout.first][1])
    for index in range(table.layout.first if width > 2 else 0):
        cells = table.shown[index][1]
        titled = table.text.dialect.delimiter and re.fullmatch(r"title|memo|(?:sample )?name\W*", cells[0], re.I)
        if titled and len(cells) == width:
            return cells
        line = table.text.rows[table.start + index][1][:_LONGEST_HEADER].strip()
        for phrases in (re.split(r"\s{2,}", line), *(Dialect(mark, ".").cells(line) for mark in "\t;,")):
            if len(phrases) == width and is_wavelength_header(phrases[0]):
                return phrases
    return []
