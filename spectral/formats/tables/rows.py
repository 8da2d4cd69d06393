"""Tables with wavelengths down their columns, or across their header: from rows of cells to columns of numbers."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

from ....runtime.errors import InputError
from ...angles import are_angles
from ...measurement import conditions_in
from ..shared.colour_words import colour_axis, names_condition
from ..shared.decisions import NO_COUNTS
from ..shared.languages import OF, spelt
from ..shared.text import shortened
from ..shared.words import (
    is_of_rows,
    measured,
    names_ratio,
    names_raw,
    names_statistic,
    quantity_in,
    quantity_in_lines,
    unit_in,
)
from .axis import LIGHT_NM, NANOMETRE, axis_unit, check_axis, is_reciprocal_header, stated_unit
from .dialect import Dialect, in_percent, words_beside
from .layout import (
    Row,
    is_name_header,
    is_units_row,
    is_wavelength_header,
    labelled_wavelengths,
    wavelength_runs,
)
from .one_reading import check_whole
from .section import Column, Section, cell, check_shifted, ragged, trimmed

# Names of an instrument's counts, from which it computes reflectance or transmittance. Each may be a sample's name,
# too.
_OF_READING = rf"(?:currents?|readings?|spe[ck]tr\w+|signals?|{spelt('reading', alone=False)})"
_BEFORE = rf"(?:{_OF_READING}[ _.-]*{OF})?"
_OF_READINGS = (
    rf"(?:[ _.-]*(?:{_OF_READING}|counts?|scans?|lamp|intensit\w+|data|mode|values?|standards?|tile|panel|"
    rf"ref(?:[eé]ren\w+)?\.?|{spelt('reference', 'sample', alone=False)})){{0,2}}"
    r"[ _]*#?\d{0,3}\W*(?:[\[(][^\[\]()]{0,30}[\])])?\W*"
)
_REFERENCES = rf"reference|ref|baseline|{spelt('reference', alone=False)}"
_DARKS = rf"dark|{spelt('dark', alone=False)}"
# Readings of a sample, as an instrument calls them whatever the sample is.
_RAWS = rf"scope|raw|{spelt('raw', alone=False)}"
_READING = rf"{_BEFORE}(?:{_DARKS}|{_REFERENCES})\.?{_OF_READINGS}"
_BACKGROUNDS = rf"background|bkgr?d?|{spelt('background', alone=False)}"
_DARK = rf"{_BEFORE}(?:{_DARKS}|{_BACKGROUNDS})\.?{_OF_READINGS}"
_SAMPLES = rf"sample|smp|{spelt('sample', alone=False)}"
_LIT = (
    rf"(?:{_BEFORE}(?:{_SAMPLES}|{_RAWS}|{_REFERENCES}|target|blank)|(?:mess)?signal|se[nñ]al|segnale|sinal|"
    rf"intensit\w+)\.?{_OF_READINGS}"
)
_WHITE = rf"{_BEFORE}(?:(?:{_REFERENCES})[ _]*)?(?:white|spectralon|{spelt('white', alone=False)})\.?{_OF_READINGS}"
# Scans without a sample, which a spectrophotometer divides by: "Baseline 100%T".
_BASELINE = re.compile(r"baseline\W*(?:\d+\W*[rt]?\W*)?", re.I)
_NEVER_MADE = rf"(?:(?:{_SAMPLES})[ _]*)?(?:{_RAWS}){_OF_READINGS}"
_RAW = rf"{_BEFORE}(?:{_SAMPLES}|{_RAWS}|signal|counts?|{_REFERENCES}|{_DARKS})\b.*"
_OF_WAVELENGTHS = rf"wave|λ|lambda|{spelt('wavelength')}"
# Fewest numbers of light in a header that are wavelengths, and no years or numbers of samples.
_FEWEST_APART = 3
#: Headings of a column that says what each row measures.
OF_KINDS = re.compile("type|mode|quantity|measure|geometr|gr(?:ö|oe)(?:ß|ss)e|grandeur", re.I)
# Headings that number the readings of a sample.
_OF_REPEATS = (
    r"(?:readings?|scans?|runs?|repeats?|repetitions?|replicates?|measurements?|messung|wiederholung|m[e]sure|shots?|n)"
    r"[ _.-]{0,2}(?:ids?|no\.?|nr\.?|num(?:ber)?|nummer|#|index)?\W*"
)
#: Headings of what tells readings of one sample apart, and their conditions; others tell samples apart.
OF_READINGS_APART = re.compile(
    rf"^{_OF_REPEATS}$|"
    r"angle|winkel|aspecular|geometr|condition|specular|mode|modus|type|typ\b|quantity|kind|filter|instrument|device|"
    r"backing",
    re.I,
)
_UNIT_BRACKET = re.compile(r"\s{0,9}[\[(]((?:[^\[\]()]|[\[(][^\[\]()]{0,30}[\])]){0,40})[\])]\s{0,9}$")
_GENERIC = re.compile(
    r"(?:spectral|total|relative|rel\.?|hemispherical|diffuse|sample|measured)?[ _]*(?:reflectance|refl\.?|"
    r"reflection|reflexion|remission|transmittance|trans\.?|transmission|(?:ir)?radiance|power|intensity|values?|data|"
    r"emission|spd|spectrum|counts?|"
    r"measurement|%? ?[rtys] ?%?|scope)(?:[ _]*(?:factor|distribution))?(?: ?%)?",
    re.I,
)


def read_down(table: Section, rows: Iterable[Row], notes: list[str]) -> int:
    """Read wavelengths down columns, each with the columns of values to its right; how many lines below are not read.

    Wavelengths that start again below an empty line are one more block of the same table; below words or comments they
    are another table, where reading ends.
    """
    axes, dialect = table.layout.axes, table.text.dialect
    # L*, a*, b* or X, Y, Z of each spectrum, a row each.
    colours = [row for _, row in table.shown[: table.layout.first] if colour_axis(row[0]) and len(row) > 1]
    columns: list[Column] = []
    blocks, last, stop_cell, shape = table.blocks, math.nan, "", ""
    width = stopped = below = widest = 0
    for line, cells in rows:
        first = cell(cells, axes[0])
        shape = shape or _shape(first)
        found = [_wavelength(cell(cells, axis), shape, dialect) for axis in axes]
        if not any(at is not None for at in found):
            if columns and _beside(columns, cells):
                table.last_line = table.last_line if colours else line
                continue
            check_whole([cell(cells, axis) for axis in axes], dialect, line)
            if not stopped:
                stopped, stop_cell = line, first or cells[0]
            below += 1
            continue
        at = math.nan if found[0] is None else found[0]
        begun = columns[0].wavelengths if columns else None
        if begun and (at == begun[0] or (stopped and not _continues(begun, last, at))):
            blocks.append(columns)
            columns = []
            if stopped or table.text.parted(table.last_line, line):
                table.further = (line, "down")
                below = 0
                break
        elif stopped and columns:
            raise InputError(
                "not a number",
                field=f"line {stopped}",
                found=repr(shortened(stop_cell, 40)),
                expected="a wavelength, as on the lines before and after it",
            )
        below = stopped = 0
        if not columns:
            width = len(trimmed(cells))
            columns = empty_columns(table, cells, width, [] if blocks else notes)
            for row in colours:
                _beside(columns, row)
        most = len(table.heads) or width
        if len(cells) < width:
            raise ragged(line, len(cells), width)
        if len(cells) > most and len(trimmed(cells)) > most:
            raise ragged(line, len(trimmed(cells)), most, cells)
        by_axis = dict(zip(axes, found, strict=True))
        for column in columns:
            if (nm := by_axis[column.place[1]]) is not None:
                column.wavelengths.append(nm)
                column.take(line, cell(cells, column.place[0]), dialect)
        table.count(len(columns))
        last, table.last_line, widest = at, line, max(widest, len(cells))
    if columns:
        blocks.append(columns)
    _check_heads(table, widest)
    every = [column for block in blocks for column in block]
    check_columns(every, dialect)
    words = {column.words for column in every if column.is_empty and column.bad}
    beside_numbers = bool(words) and not all(column.is_empty for column in every)
    if beside_numbers:
        notes.append(f"columns without numbers are left out: {', '.join(sorted(words)[:6])}")
    table.blocks = [
        [column for column in block if not column.is_empty or (column.bad and not beside_numbers)] for block in blocks
    ]
    return below


def _check_heads(table: Section, widest: int) -> None:
    """Refuse more headings than the widest row has cells, where they name several columns, or say of several what was
    measured: a name may hold a separator, and those behind it would be of other columns. Remarks may have no cells.
    """
    heads = trimmed(table.heads)
    named = max(
        sum(map(bool, heads[:widest])) - len(table.layout.axes),
        sum(quantity_in(head) is not None for at, head in enumerate(heads) if at not in table.layout.axes),
    )
    if table.text.dialect.delimiter and named > 1 and not all(map(is_of_rows, heads[widest:])):
        raise InputError(
            "more headings than columns",
            field="header",
            found=f"{len(heads)} headings above rows of {widest} cells: {shortened(' | '.join(heads))}",
            expected="one heading a column",
            hint='put a heading that holds the separator in quotes, such as "Blue, matt", or add the missing cells',
        )


def check_columns(columns: Sequence[Column], dialect: Dialect) -> None:
    """Refuse tables with cells of torn numbers among those of values; what else is wrong is told of its spectrum."""
    for line, text in (column.bad for column in columns if column.bad is not None):
        check_whole([text], dialect, line)


def _wavelength(text: str, shape: str, dialect: Dialect) -> float | None:
    """Return the wavelength in a cell that is written as the first one was; a word with a number in it is none."""
    found = dialect.wavelength(text)
    return found[0] if found and (not found[1] or _shape(text) == shape) else None


def _beside(columns: Sequence[Column], cells: Sequence[str]) -> bool:
    """Return whether a row has one tristimulus value for each spectrum (L*, X, ...), which is then put beside it."""
    label = next((text for text in cells if text), "")
    if colour_axis(label) is None:
        return False
    for column in columns:
        if value := cell(cells, column.place[0]):
            column.beside.setdefault(label, value)
    return True


def _aside(head: str, heads: Sequence[str]) -> bool:
    """True for a column beside the spectra; "dark" and "reference" only next to an instrument's other readings."""
    if re.fullmatch(_READING, head, re.I):
        return any(re.fullmatch(_RAW, other, re.I) for other in heads if other != head)
    starred = (colour_axis(head) or ("",))[0] == "Lab" and ("*" in head or "lab" in head.casefold())
    return starred or head == "#" or is_of_rows(head) or is_reciprocal_header(head)


def _raw_readings(heads: Sequence[str], table: Section) -> set[str]:
    """Headings of columns that hold an instrument's readings in counts, as others beside them tell.

    Dark and lit readings together are; so are readings beside what was made of them, and the raw or scope reading of a
    table that says of nothing else what it measures. A unit of their own, such as percent, speaks against it.
    """
    silent = [head for head in heads if head and quantity_in(head) is None and unit_in(head) is None]
    dark = [head for head in silent if re.fullmatch(_DARK, head, re.I)]
    lit = [head for head in silent if re.fullmatch(rf"{_LIT}|{_NEVER_MADE}", head, re.I)]
    white = [head for head in silent if re.fullmatch(_WHITE, head, re.I)]
    made = any((measured(quantity_in(head)) and not is_of_rows(head)) or names_ratio(head) for head in heads)
    if lit and (dark or made):
        return {*dark, *lit, *white}
    if made and dark:
        return {*dark, *white}
    if quantity_in_lines(table.words)[0] is None and unit_in(table.words) is None:
        return {head for head in lit if re.fullmatch(_NEVER_MADE, head, re.I)}
    return set()


def empty_columns(
    table: Section, cells: Sequence[str], width: int, notes: list[str], words: Sequence[int] | None = None
) -> list[Column]:
    """Empty columns for the values of a block that starts with `cells`.

    words : of a table in long form, the columns that hold no values. What stands before the wavelengths is a column of
    values where its heading says so.
    """
    axes, heads, units = table.layout.axes, table.heads, table.units
    said = "\n".join(line for line in table.words.splitlines() if re.search(_OF_WAVELENGTHS, line, re.I))
    columns: list[Column] = []
    aside = []
    width = max(width, len(heads))
    raw = _raw_readings([head for at, head in enumerate(heads) if at not in axes], table)
    for at in range(width):
        head, unit = cell(heads, at), cell(units, at)
        before = at < min(axes) and not (measured(quantity_in(head)) or (words is not None and is_generic(head)))
        if at in axes or at in (words or ()) or before:
            continue
        axis = max((axis for axis in axes if axis < at), default=min(axes))
        if head in raw or (head and width - len(axes) > 1 and _aside(head, heads)):
            aside.append(head)
            continue
        unit = unit.strip("[]() ")
        bracket = _UNIT_BRACKET.search(head)
        if bracket and (unit_in(bracket[1]) or quantity_in(bracket[1]) or not unit):
            unit = unit or bracket[1]
        if not unit and in_percent(cell(cells, at)):
            unit = "%"
        if re.search("[A-Za-z%]", head) and is_units_row([head]):
            head, unit = "", head
        axis_words = f"{cell(heads, axis)} {cell(units, axis)}"
        check_axis(cell(heads, axis))
        labelled = table.text.dialect.names_wavelength(cell(cells, axis))
        stated, by_line = stated_unit(axis_words, [] if labelled else table.words.splitlines()[:400])
        is_open = stated is None and is_wavelength_header(f"{axis_words} {said}")
        unsaid = stated is None and not (is_open or labelled)
        name = _name(table, head, at, axis, width - len(axes) - len(words or ()))
        if _BASELINE.fullmatch(name) and width - len(axes) > 1:
            aside.append(name)
            continue
        columns.append(
            Column(
                name,
                head,
                unit,
                array("d"),
                stated or NANOMETRE,
                by_line,
                axis_words,
                unit_open=is_open,
                unsaid=unsaid,
                place=(at, axis),
            )
        )
    if aside:
        notes.append(f"columns beside the measurement are left out: {', '.join(aside[:6])}")
    _hear_rows_above(table, columns)
    if not columns:
        if raw:
            raise InputError(
                "readings of an instrument, and nothing that was made of them",
                field="header",
                found=", ".join(aside),
                expected="a column of reflectance, transmittance or irradiance",
                hint=NO_COUNTS,
            )
        raise InputError(
            "wavelengths without values",
            found=", ".join(aside) or shortened(" ".join(cells)),
            expected="a column of reflectance, transmittance or emission",
        )
    return columns


def _hear_rows_above(table: Section, columns: Sequence[Column]) -> None:
    """Put beside each column what rows above the header say of it; where columns share a name, it is a part of theirs.

    A cell above several columns is of all of them, where each has as many, or where each says what was measured.
    """
    if not table.text.dialect.delimiter or table.layout.header is None or len(columns) < 2:
        return
    axis, parts = min(column.place[1] for column in columns), [list[str]() for _ in columns]
    for _, cells in table.above:
        label = cell(cells, axis) or cell(cells, 0)
        starts = [at for at in range(axis + 1, len(table.heads)) if cell(cells, at)]
        each, left = divmod(len(table.heads) - axis - 1, max(len(starts), 1))
        whole = len(starts) > 1 and not left and starts == [axis + 1 + each * at for at in range(len(starts))]
        measured_each = starts[:1] == [axis + 1] and all(_says_quantity(cell(cells, at)) for at in starts)
        if not (whole or measured_each) or len(trimmed(cells)) > len(table.heads) or colour_axis(label):
            continue
        names = not label or is_name_header(label) or is_wavelength_header(label)
        # A row with more cells than headings is refused where it is read.
        headed = [(c, part) for c, part in zip(columns, parts, strict=True) if c.place[0] < len(table.heads)]
        for column, part in headed:
            said = cell(cells, max(at for at in starts if at <= column.place[0]))
            if label:
                column.beside.setdefault(label, said)
            if names and (_says_quantity(said) or unit_in(said) or conditions_in(said)):
                column.words = f"{column.words} {said}"
            elif names and names_statistic(said):
                column.beside.setdefault("statistic", said)
            part += [said] if names and said not in part else []
    names = [column.name for column in columns]
    if len(set(names)) < len(names):
        for column, part in zip(columns, parts, strict=True):
            column.name = " ".join(dict.fromkeys([*part, column.name])).strip()


def _says_quantity(words: str) -> bool:
    return bool(quantity_in(words) or names_raw(words))


def _name(table: Section, head: str, at: int, axis: int, count: int) -> str:
    """Return the header without its unit; the row above names columns that are only called what was measured."""
    bracket = _UNIT_BRACKET.search(head)
    plain = _UNIT_BRACKET.sub("", head).strip() if bracket else head
    no_unit = bracket is not None and not unit_in(head)
    if plain and not is_generic(plain):
        return head if no_unit and not quantity_in(head) else plain
    if bracket and no_unit and count > 1 and re.match(r"[-+\u2212]?\d", bracket[1]):
        # Headings as R (15), R (45).
        return head
    above = _names_above(table)
    if len(above) == len(table.layout.axes) > 1 and all(above):
        above = [
            above[table.layout.axes.index(at)] if at in table.layout.axes else "" for at in range(len(table.heads))
        ]
    of_two = len(above) == len(table.heads) == 2 and is_wavelength_header(above[0])
    if len(above) > 1 and (of_two or len(table.layout.axes) > 1 or len(above) >= len(table.heads) > 2):
        for place in (at,) if of_two else (at, axis):
            if (name := cell(above, place)) and not is_units_row([name]) and not (of_two and is_generic(name)):
                return name
    return "" if count == 1 else plain or f"column {at + 1}"


def _names_above(table: Section) -> list[str]:
    """Return the cells above the header; where white space parts words, too, as many phrases as there are columns."""
    if not table.above or table.layout.header is None:
        return []
    line, cells = table.above[-1]
    if not table.text.dialect.delimiter:
        text = table.text.rows[table.text.place(line)][1][:4000].rstrip()
        ways = (re.split(r"\s{2,}|\t", text), re.split(r"\s{2,}|\t", text.lstrip()), cells)
        return next((list(way) for way in ways if len(way) == len(table.heads)), [])
    return cells


def is_generic(name: str) -> bool:
    """Return whether a heading says what was measured and not of which sample."""
    return bool(_GENERIC.fullmatch(name))


def _continues(begun: array[float], last: float, at: float) -> bool:
    """Return whether a wavelength goes on from the last one in the direction of those before."""
    return len(begun) < 2 or (at - last) * (begun[1] - begun[0]) > 0.0


def _shape(cell: str) -> str:
    """Return a cell with its number taken out: "Spectral Data 380[nm]" and "Spectral Data 385[nm]" have one shape."""
    return re.sub(r"\d+(?:[.,]\d+)?", "0", cell[:60])


def read_across(table: Section, rows: Iterable[Row], notes: list[str]) -> None:
    """Read the spectra of each row, until a row is another header of wavelengths.

    Raises
    ------
    InputError
        Several spectra a row, and no words beside their wavelengths that tell them apart.
    """
    heads, axes, dialect = table.heads, table.layout.axes, table.text.dialect
    found = wavelength_runs(heads, dialect)
    runs = _told_apart(table, found) if axes in found else {axes: words_beside(heads[axes[0]])}
    taken = {at for run in runs for at in run}
    others = [at for at in range(len(heads)) if at not in taken]
    _check_none_left([heads[at] for at in others], max(map(len, runs)), dialect)
    named = dialect.names_wavelength(heads[axes[0]])
    before = " ".join(heads[: min(taken)])
    axis, by_line = stated_unit(before, [] if named else table.words.splitlines()[:400])
    unsaid = axis is None and not named
    plain = [at for at in others if colour_axis(heads[at]) is None]
    words = " ".join(heads[at] for at in plain if not is_reciprocal_header(heads[at]))
    kinds = [at for at in others if OF_KINDS.search(heads[at])]
    # A name is better than a number; without either, whatever stands first.
    names = [at for at in plain if is_name_header(heads[at])]
    names = sorted(names, key=lambda at: bool(re.search(r"\bid\b|_id$|^no\b|^#", heads[at], re.I)))
    of_names = set(names)
    names += [at for at in plain if not names_condition(heads[at])]
    empty = [
        Column(
            label if len(runs) > 1 else "",
            f"{words} {_spelt_out(label)}",
            _unit_beside(label),
            array("d", ((dialect.wavelength(heads[at]) or (math.nan,))[0] for at in run)),
            axis or NANOMETRE,
            by_line,
            " ".join(head for head in heads[: min(taken)] if is_wavelength_header(head) or axis_unit(head)),
            unit_open=unsaid and is_wavelength_header(before),
            unsaid=unsaid and not is_wavelength_header(before),
        )
        for run, label in runs.items()
    ]
    columns: list[Column] = []
    without = pending = count = filled = 0
    last_name = ""
    for line, cells in rows:
        of_row = [replace(column, values=array("d")) for column in empty]
        for run, column in zip(runs, of_row, strict=True):
            column.unit = "%" if in_percent(cell(cells, run[0])) else column.unit
            for at in run:
                column.take(line, cell(cells, at), dialect)
        if _is_header(table, others, cells, of_row[0], line):
            if not pending and trimmed(cells) == heads:
                continue  # repeated, as on each page of a print
            table.further = (line, "across")
            break
        if all(column.is_empty for column in of_row):
            pending += 1
            continue
        if len(cells) <= max(at for run, column in zip(runs, of_row, strict=True) if not column.is_empty for at in run):
            raise ragged(line, len(cells), len(heads))
        cells = trimmed(cells)
        if len(cells) > len(heads):
            raise ragged(line, len(cells), len(heads), cells)
        without, pending, table.last_line = without + pending, 0, line
        table.count(len(taken))
        count += 1
        called = next((at for at in names if cell(cells, at)), -1)
        name = cells[called] if called >= 0 else f"row {count}"
        # Readings of a sample stand below its name in the first of their rows.
        if last_name and called not in of_names and any(_tells_apart(heads[at], cell(cells, at)) for at in plain):
            called, name, filled = names[0], last_name, filled + 1
        last_name = name if called in of_names else ""
        for column in (column for column in of_row if not column.is_empty):
            column.name = f"{name} {column.name}".strip()
            column.words = " ".join([column.words, *(cells[at] for at in kinds if at < len(cells))])
            column.beside = {heads[at]: cells[at] for at in others if at != called and heads[at] and cell(cells, at)}
            columns.append(column)
    without += pending if table.further is None else 0
    if without:
        notes.append(f"{without} lines below the header have no values at wavelengths and are left out")
    if filled:
        notes.append(f"{filled} rows without a name are further readings of the one above")
    check_columns(columns, dialect)
    check_shifted(columns, heads[-1])
    table.blocks = [columns]


def _tells_apart(head: str, text: str) -> bool:
    """Return whether a cell tells readings of one sample apart: their number, angle or condition, and not what each is
    for, such as standard and batch.
    """
    numbered = re.fullmatch(_OF_REPEATS, head, re.I) is not None
    return bool(text) and (numbered or are_angles(head, [text]) or bool(conditions_in(text)))


def _check_none_left(heads: Sequence[str], longest: int, dialect: Dialect) -> None:
    """Refuse wavelengths across a header that are in no spectrum: half as many as the longest has, since a few are
    readings of another kind; or plain numbers of light, which stand apart from the others.
    """
    left = [head for head in heads if dialect.names_wavelength(head)]
    apart = [head for head in heads if dialect.is_number(head) and LIGHT_NM[0] <= dialect.number(head) <= LIGHT_NM[1]]
    if 2 * len(left) >= longest or len(apart) >= _FEWEST_APART:
        raise InputError(
            "wavelengths in another order than those beside them",
            field="header",
            found=shortened(", ".join(left if 2 * len(left) >= longest else apart), 120),
            expected="the wavelengths of each spectrum in a row, upwards or downwards, with the same words beside them",
            hint="put the columns of one spectrum side by side, under the same words such as SCI 400nm, SCI 410nm, ...",
        )


def _told_apart(table: Section, runs: Sequence[tuple[int, ...]]) -> dict[tuple[int, ...], str]:
    """Return each stretch of wavelengths across a header with the words beside them, or those in the row above."""
    heads = table.heads
    above = table.above[-1][1] if table.above else []
    beside = [words_beside(heads[run[0]]) for run in runs]
    for words in (beside, [f"{cell(above, run[0])} {own}".strip() for run, own in zip(runs, beside, strict=True)]):
        if len({each.casefold() for each in words}) == len(runs):
            return dict(zip(runs, words, strict=True))
    raise InputError(
        f"{len(runs)} spectra in a row, and no words that tell them apart",
        field="header",
        found=", ".join(f"{heads[run[0]]} to {heads[run[-1]]}" for run in runs),
        expected="a word beside the wavelengths of each, such as SCI 400nm and SCE 400nm",
        hint="write into the header what each of them is",
    )


def _spelt_out(label: str) -> str:
    """Return words beside wavelengths with the quantity that a letter stands for."""
    letter = re.match(r"(?:%\s?)?([RT])\b", label)
    return f"{label} {'reflectance' if letter[1] == 'R' else 'transmittance'}" if letter else label


def _unit_beside(label: str) -> str:
    """Return the unit among words beside wavelengths."""
    bracket = _UNIT_BRACKET.search(label)
    return bracket[1] if bracket and unit_in(bracket[0]) else "%" if unit_in(label) == "percent" else ""


def _is_header(table: Section, others: Sequence[int], cells: Sequence[str], row: Column, line: int) -> bool:
    """Return whether a row has wavelengths where spectra have values: with their unit, or below the same headings.

    Raises
    ------
    InputError
        Its values could be either.
    """
    dialect, heads, values = table.text.dialect, table.heads, row.values
    if row.is_empty:
        return len(labelled_wavelengths(cells, dialect)) >= min(3, len(values))
    known = [at for at in others if heads[at]]
    if known and all(at < len(cells) and cells[at].casefold() == heads[at].casefold() for at in known):
        numbers = [dialect.number(cell) for at, cell in enumerate(cells) if at not in others and cell]
        if len(numbers) > 1 and _climbs(numbers):
            return True
    refuse_wavelengths(values, f"line {line}")
    return False


def refuse_wavelengths(values: Sequence[float], field: str) -> None:
    """Refuse values that nothing calls anything and that are as wavelengths are: they climb in equal steps.

    Raises
    ------
    InputError
        They do; for they may be a spectrum all the same.
    """
    if len(values) < 5 or not _climbs(values):
        return
    steps = [b - a for a, b in pairwise(values)]
    if max(steps) - min(steps) > 1e-9 * abs(steps[0]):
        return
    raise InputError(
        "a spectrum, or the wavelengths of another table?",
        field=field,
        found=f"{values[0]:g}, {values[1]:g} ... {values[-1]:g} in equal steps",
        expected="wavelengths with their unit, such as 380nm, or one table a file",
        hint="write the unit behind the wavelengths, or save the second table as a file of its own",
    )


def _climbs(values: Sequence[float]) -> bool:
    """Return whether values rise throughout in the range of wavelengths in nm."""
    return values[0] >= 100.0 and values[-1] <= 20_000.0 and all(a < b for a, b in pairwise(values))
