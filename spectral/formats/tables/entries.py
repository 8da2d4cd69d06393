"""From a text table to a file of spectra: quantity, unit and condition from the words that stand beside the numbers."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..answer import Answer, Scale
from ..reading import SpectralFile, StatedColour
from ..shared.gathering import DELETED, Gathering, in_visible
from ..shared.scale import Divisor, Values, divisor_of
from ..shared.signs import Sign, taken_as, undecided
from ..shared.text import shortened
from ..shared.words import (
    colour_axis,
    condition_in,
    illuminant_in,
    observer_in,
    quantity_in,
    stated_colours,
    unit_in,
)
from .column import Column
from .parsing import Table, parse_table
from .quantities import Judged, counts_removed, judged

# Columns that say what the Lab and XYZ of a row are for.
_LIGHT_COLUMN = re.compile("illum|observer|obs$|light", re.I)


def read_table(path: Path, format_name: str, answer: Answer, hints: Sequence[Sign] = ()) -> SpectralFile:
    """Read every spectrum of a text table; `gathered` says what the parameters are.

    Raises
    ------
    InputError
        No table of wavelengths and numbers, or none of its spectra can be used.
    """
    return gathered(parse_table(path), path, format_name, answer, hints)


def gathered(table: Table, path: Path, format_name: str, answer: Answer, hints: Sequence[Sign] = ()) -> SpectralFile:
    """A table's columns as entries.

    A column is what its own header says, else what the lines above its table say, else what the person says, else what
    several signs agree on (`shared.signs`). The unit is looked for in the same places; `shared.scale` says what follows
    where there is none. What nothing tells is refused, all of it at once.

    Parameters
    ----------
    answer : what a person says where the file does not.
    hints : signs that the format adds, such as the suffix of its name.
    """
    gathering = Gathering(path, format_name)
    for note in table.notes:
        gathering.note(note)
    columns = _without_counts(_named(table, path), gathering)
    grids = [_grid(column, gathering) for column in columns]
    together = Counter(column.table for column in columns)
    stated = [_stated(column, table, together[column.table] == 1) for column in columns]
    found = judged(columns, grids, stated, answer, hints, path)
    units = [_unit(column) for column in columns]
    scales = _scales(columns, grids, found, units, answer, path)
    open_ones = [(column, one) for column, one in zip(columns, found, strict=True) if not (one.decision or one.refusal)]
    if open_ones:
        signs = [sign for _, one in open_ones for sign in one.signs]
        refusal = undecided(signs, path, ", ".join(column.name for column, _ in open_ones[:3]), len(open_ones))
        gathering.rejected.append((open_ones[0][0].name, refusal))
    for column, colours, one, grid, scale in zip(columns, stated, found, grids, scales, strict=True):
        if one.decision is None or isinstance(scale, InputError):
            refusal = one.refusal or scale
            if isinstance(refusal, InputError):
                gathering.rejected.append((column.name, refusal))
            continue
        if scale and scale.note:
            gathering.note(scale.note)
        details = dict(column.preamble) if together[column.table] == 1 else {}
        others = {head: cell for head, cell in column.beside.items() if not colour_axis(head)}
        details |= {shortened(head, 60): shortened(cell) for head, cell in others.items()}
        if column.unit:
            details["units"] = column.unit
        if condition := condition_in(column.words) or condition_in(column.around):
            details["condition"] = condition
        gathering.add(
            column.name,
            grid,
            column.values,
            one.decision.quantity,
            divisor=scale.by if scale else 1.0,
            stated=colours,
            details=details,
            taken=taken_as(one.decision, scale),
        )
    return gathering.finish(table.preamble)


def _stated(column: Column, table: Table, alone: bool) -> tuple[StatedColour, ...]:
    """The colours beside a column; those in the lines above are its own where it is `alone` in its table."""
    beside = {key: table.dialect.number(value) for key, value in column.preamble.items()} if alone else {}
    cells = {head: table.dialect.number(cell) for head, cell in column.beside.items() if colour_axis(head)}
    own = " ".join(cell for head, cell in column.beside.items() if _LIGHT_COLUMN.search(head))
    return stated_colours(
        {**beside, **cells},
        illuminant_in(own) or illuminant_in(column.around),
        observer_in(own) or observer_in(column.around),
    )


def _scales(
    columns: Sequence[Column],
    grids: Sequence[np.ndarray],
    found: Sequence[Judged],
    units: Sequence[tuple[Scale | None, str]],
    answer: Answer,
    path: Path,
) -> list[Divisor | InputError | None]:
    """What each column is divided by: one answer for all columns with one unit below one kind of heading."""
    groups: dict[tuple[int, Scale | None, str, bool], list[int]] = {}
    for index, (column, one, unit) in enumerate(zip(columns, found, units, strict=True)):
        if one.decision is not None and one.decision.quantity != "emission" and column.bad is None:
            key = (column.alike, unit[0], one.decision.quantity, one.decision.stated)
            groups.setdefault(key, []).append(index)
    scales: list[Divisor | InputError | None] = [None] * len(columns)
    for (_, unit, quantity, stated), places in groups.items():
        low, high = math.inf, -math.inf
        for index in places:
            values = _of_light(grids[index], np.asarray(columns[index].values, dtype=np.float64))
            low, high = min([low, *values.tolist()]), max([high, *values.tolist()])
        if not math.isfinite(low):
            continue
        if unit is None and quantity == "radiance factor" and stated and high <= 20.0:
            unit = "fraction"
        words = next((units[index][1] for index in places if units[index][1]), "the word for it")
        published = {one.factor for one in (found[index].likeness for index in places) if one} if not stated else set()
        if unit is None and answer.scale is None and published and all(found[index].likeness for index in places):
            unit, words = ("percent" if min(published) > 10.0 else "fraction"), "their published scale"
        values = Values(low, high, quantity != "transmittance", stated)
        scale: Divisor | InputError
        try:
            scale = divisor_of(values, unit, words, answer.scale, path)
        except InputError as reason:
            scale = reason
        for index in places:
            scales[index] = scale
    return scales


def _grid(column: Column, gathering: Gathering) -> np.ndarray:
    """Wavelengths of a column in nm; those that nothing but micrometres can be, and that are called wavelengths."""
    grid = np.asarray(column.wavelengths, dtype=np.float64) * column.nm
    if column.unit_open and grid.size and grid.min() >= 0.1 and grid.max() <= 50.0:
        gathering.note(f"wavelengths from {grid.min():g} to {grid.max():g} without a unit are taken as micrometres")
        grid = grid * 1000.0
    return grid


def _of_light(grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values that say on which scale a column is: less flags, empty cells, and noise beyond the visible."""
    values = np.where(values <= DELETED, np.nan, values)
    there = ~np.isnan(values)
    seen = values[in_visible(grid) & there]
    if seen.size:
        most = float(seen.max())
        there &= in_visible(grid) | ((values >= -0.01 * abs(most)) & (values <= 2.0 * most))
    return values[there]


def _named(table: Table, path: Path) -> list[Column]:
    """All columns, each with a name: the file's where the table gives none, numbered where a later block repeats it."""
    columns: list[Column] = []
    taken: set[str] = set()
    for number, block in enumerate(table.blocks, 1):
        for column in block:
            column.name = column.name or path.stem
            if column.name in taken:
                column.name = f"{column.name} ({number})"
            columns.append(column)
        taken |= {column.name for column in block}
    return columns


def _without_counts(columns: list[Column], gathering: Gathering) -> list[Column]:
    """Columns less those in counts, where others hold what was made of the counts."""
    kept = counts_removed(columns)
    if kept is None:
        return columns
    gathering.note("columns of raw counts are left out: the file holds what was made of them")
    return kept


def _unit(column: Column) -> tuple[Scale | None, str]:
    """Percent or fractions, and where that stands: in the unit, the heading, or a line above the table that is about
    the measured values, not about humidity.
    """
    about = ("reflectance", "transmittance", "radiance factor")
    for words, what in ((column.words, "the heading"), (column.unit, "the unit")):
        if unit := unit_in(words):
            return unit, f"{what} {shortened(words, 60)!r}"
    for line in column.around.splitlines():
        if (quantity_in(line) in about or re.search("unit|scale", line, re.I)) and (unit := unit_in(line)):
            return unit, f"the line {shortened(line, 60)!r}"
    return None, ""
