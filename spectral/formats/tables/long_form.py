"""Tables in long form: a sample, a wavelength and its values in each row, in any order of rows and columns."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from itertools import pairwise
from typing import NamedTuple

from ....runtime.errors import InputError
from ...measurement import is_condition
from ..shared.languages import spelt
from ..shared.text import is_missing, shortened
from ..shared.words import SCATTER, is_of_rows, names_identifier, quantity_in
from .axis import is_reciprocal_header
from .dialect import Dialect
from .layout import Row, is_wavelength_header
from .one_reading import check_whole
from .rows import OF_KINDS, OF_READINGS_APART, check_columns, empty_columns, is_generic
from .section import Column, Section, cell, ragged, trimmed

# Headings, as a whole, of the names of samples in a table in long form.
_OF_SAMPLES = re.compile(
    r"(?:(?:colou?r|farb|file|spectrum|curve)[ _-]?)?(?:samples?|specimens?|swatch|patch|material|mat[ée]riau|object|"
    r"target|panel|part|product|paint|pigment|ink|item|label|names?|tit(?:le|el)|id|uid|identifier|spectrum|curve|"
    rf"series|#|{spelt('sample', 'name', alone=False)})[ _.-]{{0,2}}(?:names?|ids?|no\.?|num(?:ber)?|#|code|label|"
    rf"{spelt('number', 'name')}\.?)?\W*",
    re.I,
)
_OF_UNITS = re.compile(r"units?|einheit|unit[ée]s?|unidad|unit[àa]", re.I)


class LongForm(NamedTuple):
    """Columns of a table with a sample, a wavelength and its values in each row.

    Parameters
    ----------
    names : the columns that an entry is called after.
    keys : those that tell spectra apart, `names` among them.
    words : all that hold no values.
    """

    names: tuple[int, ...]
    keys: tuple[int, ...]
    words: tuple[int, ...]


def long_form(table: Section, words: tuple[int, ...], numbered: Sequence[Row]) -> LongForm | None:
    """Return the columns of a table in long form, None of any other.

    A table is in long form where a column names samples and is headed so, or where the words of a column tell rows at
    equal wavelengths apart.

    Parameters
    ----------
    words : `names_beside` of the table. numbered : its rows from the first numbers on.
    """
    (axis,), dialect = table.layout.axes, table.text.dialect
    rows = [(found[0], cells) for _, cells in numbered if (found := dialect.wavelength(cell(cells, axis)))]
    nm = [at for at, _ in rows]
    again = not _in_order(nm)
    cells_of = {at: _filled_down([cell(cells, at) for _, cells in rows]) for at in words}
    # A counter of the rows names nothing.
    known = {at: len(set(cells)) for at, cells in cells_of.items() if 2 * len(set(cells)) <= len(rows)}
    heads = {at: cell(table.heads, at) for at in known}
    numeric = {at: all(map(dialect.is_number, cells_of[at])) for at in known}
    headed = [at for at in known if _OF_SAMPLES.fullmatch(heads[at]) and (again or not numeric[at])]
    headed.sort(key=numeric.__getitem__)
    others = [at for at in known if at not in headed and not _OF_UNITS.fullmatch(heads[at])]
    others.sort(key=lambda at: is_of_rows(heads[at]))
    named = headed or [at for at in others if again and not (numeric[at] or is_of_rows(heads[at]))]
    first = named[:1] or [at for at in others if again and OF_READINGS_APART.search(heads[at])][:1]
    if not first:
        return None
    keys, names = first, tuple(named[:1])
    count = len({*zip(cells_of[first[0]], nm, strict=True)})
    for at in [*headed, *others]:
        more = len({*zip(*(cells_of[key] for key in (*keys, at)), nm, strict=True)})
        if more > count:
            keys, count = [*keys, at], more
            if not (OF_READINGS_APART.search(heads[at]) or is_of_rows(heads[at])):
                names += (at,)
    return LongForm(names, tuple(keys), words) if headed or count == len(rows) else None


def names_beside(table: Section) -> tuple[int, ...]:
    """Columns beside the wavelengths of a table down, by its first rows, that hold words, or numbers below a heading of
    names, readings or conditions; () where no values are left.
    """
    dialect, (axis, *further) = table.text.dialect, table.layout.axes
    rows = [cells for _, cells in table.shown[table.layout.first :][:200] if dialect.wavelength(cell(cells, axis))]
    if further or not rows:
        return ()
    found, values = [], 0
    for at in range(max(map(len, rows))):
        head = cell(table.heads, at)
        none = is_condition(head)  # "none" is a filter's, and no missing value
        some = [text for cells in rows if (text := cell(cells, at)) and (none or not is_missing(text))]
        numbers = [value for text in some if (value := dialect.number(text)) == value]
        sample = _OF_SAMPLES.fullmatch(head) or names_identifier(head)
        called = sample or is_of_rows(head) or OF_READINGS_APART.search(head)
        if at == axis or not some or is_wavelength_header(head) or is_reciprocal_header(head):
            continue
        if not numbers:
            beside = len(some) == len(rows) or (called and cell(rows[0], at))
        else:
            beside = called and not quantity_in(head) and not SCATTER.fullmatch(head)
            beside = beside and (not sample or all(value % 1.0 == 0.0 for value in numbers))
        if beside:
            found.append(at)
        else:
            values += bool(numbers) and (at > axis or bool(quantity_in(head)) or is_generic(head))
    return tuple(found) if values else ()


def _filled_down(cells: Sequence[str]) -> list[str]:
    """Cells with those that are left empty below a name filled with it."""
    filled, last = [], ""
    for text in cells:
        last = text or last
        filled.append(last)
    return filled


def read_long(table: Section, form: LongForm, rows: Iterable[Row], notes: list[str]) -> None:
    """Read a table in long form: a spectrum for each sample, under its name, on its own wavelengths.

    Raises
    ------
    InputError
        Several values at one wavelength of one sample, or rows without a wavelength between others.
    """
    dialect, heads, (axis,) = table.text.dialect, table.heads, table.layout.axes
    spectra: dict[tuple[str, ...], dict[float, tuple[int, list[str]]]] = {}
    said: dict[tuple[str, ...], dict[int, str]] = {}
    templates: list[Column] = []
    filled: dict[int, str] = {}
    width = stopped = below = repeated = 0
    for line, cells in rows:
        found = dialect.wavelength(cell(cells, axis))
        if found is None:
            check_whole([cell(cells, axis)], dialect, line)
            if trimmed(cells) != heads:
                stopped, below = stopped or line, below + 1
            continue
        if stopped:
            raise InputError(
                "no wavelength",
                field=f"line {stopped}",
                found="words, and a further row of numbers below",
                expected="a wavelength in each row, as on the lines before and after it",
            )
        if not templates:
            width = len(trimmed(cells))
            templates = empty_columns(table, cells, width, notes, form.words)
        most = len(heads) or width
        if len(cells) < width or len(trimmed(cells)) > most:
            raise ragged(line, len(trimmed(cells)), width if len(cells) < width else most, cells)
        filled |= {at: text for at in form.words if (text := cell(cells, at)) or at not in form.keys}
        key = tuple(filled.get(at, "") for at in form.keys)
        values = [cell(cells, column.place[0]) for column in templates]
        before = spectra.setdefault(key, {}).setdefault(found[0], (line, values))
        if before[1] != values:
            raise InputError(
                "several values at one wavelength of one sample",
                field=f"lines {before[0]} and {line}",
                found=f"{shortened(' '.join(key), 40)} at {found[0]:g}: {', '.join(before[1])} and {', '.join(values)}",
                expected="one value a sample and wavelength, or a column that tells readings apart",
                hint='number repeated readings in a column "reading", or give two samples two names',
            )
        repeated += before[0] != line
        # Facts of a spectrum stand in all of its rows.
        said[key] = dict(said.get(key, filled).items() & filled.items())
        table.count(len(templates))
        table.last_line = line
    if below:
        notes.append(f"{below} lines below the table are not read")
    if repeated:
        notes.append(f"{repeated} rows that repeat another one are left out")
    columns = [
        _of_sample(one, place, points, form, said[key], heads, len(templates) > 1, dialect)
        for key, points in spectra.items()
        for place, one in enumerate(templates)
    ]
    table.blocks = [[column for column in columns if not column.is_empty or column.bad]]
    if any(not _in_order(column.wavelengths) for column in columns):
        notes.append("rows stand in another order than their wavelengths and were sorted")
    for column in columns:
        if not _in_order(column.wavelengths):
            ordered = sorted(zip(column.wavelengths, column.values, strict=True))
            column.wavelengths, column.values = (array("d", some) for some in zip(*ordered, strict=True))
    check_columns(columns, dialect)


def _of_sample(
    template: Column,
    place: int,
    points: Mapping[float, tuple[int, list[str]]],
    form: LongForm,
    said: Mapping[int, str],
    heads: Sequence[str],
    several: bool,
    dialect: Dialect,
) -> Column:
    """Return the column of one spectrum, called after its sample, with the other words of its rows beside it."""
    column = copy(template)
    column.wavelengths, column.values = array("d", points), array("d")
    for line, values in points.values():
        column.take(line, values[place], dialect)
    name = " ".join(dict.fromkeys(text for at in form.names if (text := said.get(at, ""))))
    column.name = f"{name} {template.name or template.words}".strip() if several else name
    beside = {
        head: said[at] for at in sorted(said) if at not in form.names[:1] and (head := cell(heads, at)) and said[at]
    }
    column.beside = beside
    # "R" says what was measured at the end.
    kinds = [text for head, text in beside.items() if OF_KINDS.search(head)]
    column.words = " ".join([*kinds, column.words]).strip()
    column.unit = column.unit or next((text for head, text in beside.items() if _OF_UNITS.fullmatch(head)), "")
    return column


def _in_order(wavelengths: Sequence[float]) -> bool:
    """Return whether wavelengths climb or fall throughout."""
    return all(a < b for a, b in pairwise(wavelengths)) or all(a > b for a, b in pairwise(wavelengths))
