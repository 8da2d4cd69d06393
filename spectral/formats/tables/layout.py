"""Layout of wavelengths in a text table: down columns, or across a header."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, chain, pairwise
from typing import Literal

from ..shared.colour_words import colour_axis
from ..shared.languages import number_of_sample, spelt
from .axis import is_no_axis, is_reciprocal_header
from .dialect import Dialect, words_beside

#: A row of a table: line number in the file, and stripped cells.
Row = tuple[int, list[str]]
#: Direction of a table's wavelengths.
Way = Literal["down", "across"]

_WAVELENGTH_WORD = re.compile(
    rf"wave.?len|^wave$|^wl\b|lambda|λ|^\W*(?:nm|µm|μm|um|microns?|[åÅ]|angstroms?)\W*$|{spelt('wavelength')}",
    re.I,
)
_NAME_WORD = re.compile(
    rf"name|sample|\bid\b|^no\.?$|^#$|colou?r|patch|label|title|specimen|swatch|{spelt('name')}|"
    rf"^{number_of_sample()}$",
    re.I,
)
_UNIT_CELL = re.compile(
    r"\W*(?:%|nm|µm|μm|um|[åÅ]|angstroms?|[kMGTP]?Hz|m?eV|1?/?cm\W{0,3}1?|rad\s?/\s?[fp]?s|[a-z.µμ]{0,4}(?-i:W)\b.{0,30}|counts?|a\.?u\.?|rel\.?.{0,10}|[01]\W{1,4}1)?\W*",
    re.I,
)


# Key of a sample's name in a line of its own, whatever mark stands behind it.
_SAMPLE_KEY = (
    rf"(?:sample|specimen|patch|swatch|{spelt('name', 'sample', alone=False)})[ _-]*(?:names?|id|no\.?|title|"
    rf"{spelt('name', 'number')}\.?)?|name|title|label"
)
# A key with its value, and a marker of a program, such as ">>>>>Begin Spectral Data<<<<<".
_KEYED = re.compile(r"[^:=;,()\[\]]{1,40}[:=;,]\s?\S|\W*>>|.*<<")

# The wavenumber, in 1/cm, of the shortest light; no wavelength in nm is larger.
_LARGEST = 50_000.0
# The shortest wavelength, in nm, that is looked for across a header.
_SHORTEST = 100.0


@dataclass(frozen=True)
class TableLayout:
    """Place of wavelengths and values in a table.

    Parameters
    ----------
    way : wavelengths "down" columns or "across" a header.
    first : index of the first row of numbers among the rows.
    header : index of the row with the names ("down") or with the wavelengths ("across"), None if there is none.
    axes : "down": columns that hold wavelengths; "across": columns whose header is a wavelength.
    """

    way: Way
    first: int
    header: int | None
    axes: tuple[int, ...]


def is_wavelength_header(cell: str) -> bool:
    """Return whether a header says that its column holds wavelengths."""
    return bool(_WAVELENGTH_WORD.search(cell)) and not (is_reciprocal_header(cell) or is_no_axis(cell))


def is_name_header(cell: str) -> bool:
    """Return whether a header says that its column names the samples."""
    return bool(_NAME_WORD.search(cell))


def is_sample_key(words: str) -> bool:
    """Return whether a line's first words say that the name of a sample follows."""
    return bool(re.fullmatch(_SAMPLE_KEY, words, re.I))


def is_units_row(cells: Sequence[str]) -> bool:
    """Return whether a row below the names holds units alone."""
    return any(cells) and all(_UNIT_CELL.fullmatch(cell[:60]) for cell in cells)


def layout_of(rows: Sequence[Row], dialect: Dialect) -> TableLayout | None:
    """Find the table among rows of cells, the first thousands of a file; None if there is none."""
    down, across = _down(rows, dialect), _across(rows, dialect)
    if down is not None and across is None and down.first:
        # Energies and micrometres across a header would pass for the samples of a first column.
        found = _across(rows[down.first - 1 : down.first + 50], dialect, least=0.0)
        if found is not None and found.header == 0:
            across = replace(found, first=found.first + down.first - 1, header=down.first - 1)
    if down is None or across is None:
        return down or across
    head = rows[across.header or 0][1]
    below = [dialect.wavelength(cells[0]) for _, cells in rows[across.first : across.first + 50] if cells]
    labelled = sum(dialect.names_wavelength(head[column]) for column in across.axes)
    listed = _plausible([found[0] for found in below if found])
    if down.first <= (across.header or 0) or (listed and is_wavelength_header(head[0])):
        return down
    if 2 * labelled > len(across.axes) or (is_name_header(head[0]) and not is_wavelength_header(head[0])):
        return across
    return down if listed else across


def _plausible(values: Sequence[float]) -> bool:
    return len(values) > 0 and all(100.0 <= value <= 20_000.0 for value in values) and _monotone(values)


def _monotone(values: Sequence[float]) -> bool:
    return all(a < b for a, b in pairwise(values)) or all(a > b for a, b in pairwise(values))


def _down(rows: Sequence[Row], dialect: Dialect) -> TableLayout | None:
    """First rows with a wavelength in some column and a number in another, and rows like them below.

    Numbers that no header calls wavelengths may be an instrument's keys and values; rows further down whose wavelengths
    carry their unit go before them.
    """
    found = _down_from(rows, 0, dialect)
    if found is None or _labelled(rows, found, dialect):
        return found
    heads = rows[found.header][1] if found.header is not None else []
    if any(is_wavelength_header(heads[axis]) for axis in found.axes if axis < len(heads)):
        return found
    for first in range(found.first + 1, len(rows) - 2):
        cells = rows[first][1]
        if len(cells) > 1 and dialect.names_wavelength(cells[0]):
            later = _down_from(rows[: first + 6], first, dialect)
            if later is not None and later.first == first and _labelled(rows, later, dialect):
                return later
    return found


def _labelled(rows: Sequence[Row], layout: TableLayout, dialect: Dialect) -> bool:
    """Return whether the first wavelengths of a layout carry a unit or a word."""
    axis = layout.axes[0]
    cells = [cells[axis] for _, cells in rows[layout.first : layout.first + 3] if axis < len(cells)]
    return len(cells) > 1 and all(map(dialect.names_wavelength, cells))


def _down_from(rows: Sequence[Row], start: int, dialect: Dialect) -> TableLayout | None:
    for first in range(start, len(rows)):
        run = [cells for _, cells in rows[first : first + 6]]
        width = len(run[0])
        # A row of values holds two numbers or more: a wavelength, and what was measured there.
        if width < 2 or sum(dialect.wavelength(cell) is not None for cell in run[0]) < 2:
            continue
        if colour_axis(run[0][0]):
            continue  # L* of each spectrum, above its wavelengths
        header = header_above(rows, first, dialect)
        heads = rows[header][1] if header is not None else []
        # Frequencies and energies are an axis where no wavelengths stand beside them.
        said = {column for column, cell in enumerate(heads[:width]) if is_wavelength_header(cell)}
        said = said or {column for column, cell in enumerate(heads[:width]) if is_reciprocal_header(cell)}
        axes = []
        for column in sorted({*range(min(width, 12)), *said}):
            found = [dialect.wavelength(cells[column]) if column < len(cells) else None for cells in run]
            values = [pair[0] for pair in found if pair is not None]
            # Next to an axis stand values: "Wavelength (nm)" may be two cells where white space parts them.
            if found[0] is None or (len(values) < 2 and column not in said) or {column - 1, column} <= said:
                continue
            # R1 to R15 are colour rendering indices; micrometres come as plain numbers.
            likely = all(100.0 <= value <= _LARGEST for value in values[:3]) or (
                all(0.1 <= value <= 50.0 for value in values[:3]) and not found[0][1]
            )
            if column in said or (likely and len(values) > 1 and _monotone(values[:3]) and all(found[:3])):
                axes.append(column)
        named = [column for column in axes if column in said]
        large = [column for column in axes if (dialect.wavelength(run[0][column]) or (0.0,))[0] >= 100.0]
        begun = named or large[:1] or axes[:1]
        if begun and any(_begins_below(run, column, dialect) for column in range(begun[0])):
            continue  # a word and a fact of each column, above their wavelengths
        # Wavelengths that stand again further right are those of the values behind them.
        again = [at for at in axes if begun[-1] + 1 < at and _equal(run, begun[0], at, dialect)]
        chosen = (*begun, *again)
        others = [cell for column, cell in enumerate(run[0]) if column not in chosen]
        if chosen and any(dialect.number(cell) == dialect.number(cell) for cell in others):
            top = _with_rows_above(rows, first, chosen[0], dialect) if len(chosen) == 1 else first
            header = header if top == first else header_above(rows, top, dialect)
            return TableLayout("down", top, header, chosen)
    return None


def _begins_below(run: Sequence[Sequence[str]], column: int, dialect: Dialect) -> bool:
    """Return whether a word stands in the first cell of a column, and wavelengths of light below it."""
    word, *below = [cells[column] if column < len(cells) else "" for cells in run[:4]]
    found = [dialect.wavelength(cell) for cell in below]
    values = [pair[0] for pair in found if pair is not None]
    return bool(word) and not dialect.wavelength(word) and len(values) == len(found) > 1 and _plausible(values)


def _equal(rows: Sequence[Sequence[str]], a: int, b: int, dialect: Dialect) -> bool:
    """Return whether two columns hold the same wavelengths in all rows that have both."""
    return all(dialect.wavelength(cells[a]) == dialect.wavelength(cells[b]) for cells in rows if max(a, b) < len(cells))


def _with_rows_above(rows: Sequence[Row], first: int, axis: int, dialect: Dialect) -> int:
    """Index of the first row of numbers where rows above it have no value: their wavelengths are a step apart, as those
    below are.
    """

    def at(row: int) -> float:
        cells = rows[row][1]
        found = dialect.wavelength(cells[axis]) if axis < len(cells) else None
        return found[0] if found else math.nan

    while first and first + 1 < len(rows):
        before, here, after = at(first - 1), at(first), at(first + 1)
        if not (after - here) * (here - before) > 0.0 or not 0.4 < (here - before) / (after - here) < 2.5:
            break
        first -= 1
    return first


def header_above(rows: Sequence[Row], first: int, dialect: Dialect) -> int | None:
    """Index of the row of names above the numbers, past rows of units and of tristimulus values.

    It has two cells or more; one that has fewer than the numbers is no header, unless it speaks of wavelengths. Names
    may be numbers where the first cell is empty or speaks of wavelengths; elsewhere a number after a word is one more
    line of keys and values.
    """
    index = first - 1
    while index > 0 and len(rows[index][1]) > 1 and colour_axis(rows[index][1][0]):
        index -= 1  # L*, a*, b* or X, Y, Z of each spectrum
    if index > 0 and len(rows[index][1]) > 1 and is_units_row(rows[index][1]) and len(rows[index - 1][1]) > 1:
        index -= 1
    if index < 0 or len(rows[index][1]) < 2:
        return None
    if dialect.wavelength(rows[first][1][0]):
        index = _above_facts(rows, index, len(rows[first][1]), dialect)
    cells = rows[index][1]
    if not cells[0] or is_wavelength_header(cells[0]) or (len(cells) > 2 and is_reciprocal_header(cells[0])):
        return index
    if not dialect.delimiter and (is_sample_key(cells[0]) or _KEYED.match(" ".join(cells))):
        return None  # white space parts words, and no key from its value
    if len(cells) < len(rows[first][1]) and not any(map(is_wavelength_header, cells)):
        return None
    keyed = dialect.names_wavelength(
        rows[first][1][0]
    )  # "380nm" needs no header, and what is above are keys and values
    if keyed or any(dialect.number(cell) == dialect.number(cell) for cell in cells[1:]):
        return None
    return index


def _above_facts(rows: Sequence[Row], index: int, width: int, dialect: Dialect) -> int:
    """Index of the row of names above rows with a fact of each column, such as "Gloss, 85, 20"; else `index` itself."""
    above = index
    while above > 0 and len(cells := rows[above][1]) == width > 2 and all(map(dialect.is_number, cells[1:])):
        if dialect.wavelength(cells[0]) or not cells[0] or is_wavelength_header(cells[0]):
            return index
        above -= 1
    cells = rows[above][1]
    named = above < index and len(cells) == width and not any(map(dialect.is_number, cells))
    return above if named and (is_wavelength_header(cells[0]) or is_name_header(cells[0])) else index


def _across(rows: Sequence[Row], dialect: Dialect, least: float = _SHORTEST) -> TableLayout | None:
    """First row with a run of wavelengths and numbers below each of them.

    least : of wavelengths below no heading; where it is below `_SHORTEST`, words have to stand before them and before
    the numbers below.
    """
    for header, (_, cells) in enumerate(rows[:-1]):
        if len(cells) < 3 and not (len(cells) == 2 and header == 0):
            continue
        headed = any(is_wavelength_header(cell) or is_reciprocal_header(cell) for cell in cells)
        run = wavelengths_across(cells, dialect, least=0.0 if headed else least)
        if len(run) < 2:
            continue
        if any(dialect.is_number(cells[at]) and dialect.number(cells[at]) < _SHORTEST for at in run):
            # Whole numbers are those of samples; energies and micrometres have decimals.
            decimals = sum("." in cells[at] or "," in cells[at] for at in run)
            words = not (dialect.is_number(cells[0]) or dialect.is_number(rows[header + 1][1][0]))
            if len(run) < 5 or 2 * decimals < len(run) or not words:
                continue
        labelled = all(dialect.names_wavelength(cells[column]) for column in run)
        worded = any(cell and dialect.wavelength(cell) is None for cell in cells)
        if len(run) < (2 if labelled or len(cells) - len(run) <= 1 else 3 if worded else 5):
            continue
        first = header + 1
        if first + 1 < len(rows) and is_units_row(rows[first][1]):
            first += 1
        below = rows[first][1]
        values = [dialect.number(below[column]) for column in run if column < len(below)]
        if 2 * sum(value == value for value in values) > len(run):
            return TableLayout("across", first, header, run)
    return None


def labelled_wavelengths(cells: Sequence[str], dialect: Dialect) -> tuple[int, ...]:
    """Columns of the wavelengths in a row that is a header of them, each with its unit or a word; () of any other."""
    runs = wavelength_runs(cells, dialect, labelled=True)
    count = sum(map(len, runs))
    return max(runs, key=len) if 2 * count >= max(4, sum(bool(cell) for cell in cells)) else ()


def wavelengths_across(
    cells: Sequence[str], dialect: Dialect, labelled: bool = False, least: float = _SHORTEST
) -> tuple[int, ...]:
    """Columns of the longest of `wavelength_runs`, the first of equal ones."""
    return max(wavelength_runs(cells, dialect, labelled, least), key=len, default=())


def wavelength_runs(
    cells: Sequence[str], dialect: Dialect, labelled: bool = False, least: float = _SHORTEST
) -> list[tuple[int, ...]]:
    """Columns of each stretch of neighbours that are wavelengths, strictly ascending or strictly descending.

    Several spectra may stand in a row, one behind the other or in turns, as R400 T400 R410 T410: what stands beside
    their wavelengths tells them apart. A stretch of less than half as many wavelengths as the longest is none.

    labelled : whether each must carry its unit or a word. least : the smallest number that may be one.
    """
    found = [dialect.wavelength(cell) for cell in cells]
    values = [
        pair[0] if pair and least <= pair[0] <= _LARGEST and (pair[1] or not labelled) else None for pair in found
    ]
    # Number of cells before each that are no wavelengths: a stretch ends at one.
    parted = list(accumulate((value is None for value in values), initial=0))
    apart: dict[str, list[tuple[int, int, float]]] = {}
    for at, (pair, value) in enumerate(zip(found, values, strict=True)):
        if pair and value is not None:
            # A plain number has none, and tables have many thousands of them.
            # A sign stays: 45as-15 is not 45as15.
            words = re.sub(r"[^\w%+\u2212-]", "", words_beside(cells[at])).casefold() if pair[1] else ""
            apart.setdefault(words, []).append((at, parted[at], value))
    together = _stretches(sorted(chain.from_iterable(apart.values())))
    each = [run for of_words in apart.values() for run in _stretches(of_words)] if len(apart) > 1 else together
    longest = max(map(len, each), default=0)
    if max(map(len, together), default=0) > longest:
        longest, each = max(map(len, together)), together
    return sorted(run for run in each if 2 * len(run) >= longest)


def _stretches(found: Sequence[tuple[int, int, float]]) -> list[tuple[int, ...]]:
    """Places of the longest stretches in one direction, neither of which holds a place of another.

    found : place, number of its neighbourhood, and wavelength of each.
    """
    stretches: list[tuple[int, ...]] = []
    for sign in (1.0, -1.0):
        run: list[int] = []
        before = (-1, 0.0)
        for at, parted, value in found:
            if run and (parted != before[0] or sign * value <= sign * before[1]):
                stretches.append(tuple(run))
                run = []
            run.append(at)
            before = parted, value
        stretches.append(tuple(run))
    taken: set[int] = set()
    chosen = []
    for places in sorted(stretches, key=len, reverse=True):
        if places and taken.isdisjoint(places):
            taken.update(places)
            chosen.append(places)
    return chosen
