"""From a text table to a file of spectra: quantity, unit and condition from the words that stand beside the numbers."""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import groupby
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...spectrum import Quantity
from ..reading import SpectralFile
from ..shared.gathering import DELETED, Gathering, in_visible, reflective_divisor
from ..shared.text import shortened
from ..shared.words import (
    Unit,
    colour_axis,
    condition_in,
    illuminant_in,
    measured,
    names_light,
    names_perhaps_light,
    names_power,
    names_sensitivity,
    observer_in,
    quantity_in,
    quantity_of_set,
    stated_colours,
    unit_in,
)
from .column import Column
from .parsing import Table, parse_table

# Columns that say what the Lab and XYZ of a row are for.
_LIGHT_COLUMN = re.compile("illum|observer|obs$|light", re.I)


def read_table(path: Path, format_name: str, usual: Quantity) -> SpectralFile:
    """Read every spectrum of a text table; what the file does not call anything is taken for the `usual` quantity.

    Raises
    ------
    InputError
        No table of wavelengths and numbers, or none of its spectra can be used.
    """
    return gathered(parse_table(path), path, format_name, usual)


def gathered(table: Table, path: Path, format_name: str, usual: Quantity) -> SpectralFile:
    """A table's columns as entries.

    A column is what its own header says, else what the lines above its table say, else `usual`, with a note. The unit
    is looked for in the same places; `reflective_divisor` says what follows where there is none.
    """
    gathering = Gathering(path, format_name)
    for note in table.notes:
        gathering.note(note)
    columns = _without_counts(_named(table, path), gathering)
    told = _told(columns, path)
    if not all(told):
        if usual != "emission" and all(names_light(column.name) for column in columns):
            usual = "emission"
        if usual != "emission" and len(columns) == 1:
            _check_no_light(columns[0].name, path)
        gathering.note(f"the file does not say what was measured; taken as {usual}")
    units: list[Unit | None] = [
        unit_in(column.unit) or unit_in(column.words) or _unit_of_lines(column.around) for column in columns
    ]
    grids = [_grid(column, gathering) for column in columns]
    ranges: dict[tuple[int, Unit | None], tuple[float, float]] = {}
    for column, quantity, unit, grid in zip(columns, told, units, grids, strict=True):
        if (quantity or usual) != "emission" and column.bad is None:
            low, high = ranges.get((column.alike, unit), (math.inf, -math.inf))
            values = _of_light(grid, np.asarray(column.values, dtype=np.float64)).tolist()
            ranges[column.alike, unit] = min([low, *values]), max([high, *values])
    together = Counter(column.table for column in columns)
    for column, quantity, unit, grid in zip(columns, told, units, grids, strict=True):
        if (refusal := _refusal(column, quantity, path)) is not None:
            gathering.rejected.append((column.name, refusal))
            continue
        kind = measured(quantity) or usual
        divisor = 1.0
        if kind != "emission" and (column.alike, unit) in ranges:
            low, high = ranges[column.alike, unit]
            stated_unit = "fraction" if unit is None and kind == "radiance factor" and high <= 20.0 else unit
            divisor, note = reflective_divisor(low, high, stated_unit, path, told=quantity is not None)
            if note:
                gathering.note(note)
        alone = together[column.table] == 1
        beside = {key: table.dialect.number(value) for key, value in column.preamble.items()} if alone else {}
        cells = {head: table.dialect.number(cell) for head, cell in column.beside.items() if colour_axis(head)}
        details = dict(column.preamble) if alone else {}
        details |= {shortened(head, 60): shortened(cell) for head, cell in column.beside.items() if head not in cells}
        if column.unit:
            details["units"] = column.unit
        if condition := condition_in(column.words) or condition_in(column.around):
            details["condition"] = condition
        own = " ".join(cell for head, cell in column.beside.items() if _LIGHT_COLUMN.search(head))
        stated = stated_colours(
            {**beside, **cells},
            illuminant_in(own) or illuminant_in(column.around),
            observer_in(own) or observer_in(column.around),
        )
        gathering.add(column.name, grid, column.values, kind, divisor=divisor, stated=stated, details=details)
    return gathering.finish(table.preamble)


def _told(columns: list[Column], path: Path) -> list[str | None]:
    """What each column says of itself, else the lines above its table, else all headings of it together."""
    told: list[str | None] = []
    for _, group in groupby(columns, key=lambda column: column.table):
        of_table = list(group)
        around = quantity_in(of_table[0].around)
        heads = [column.words for column in of_table]
        together = quantity_of_set(heads, path.stem) if around is None else None
        if together == "colours":
            raise InputError(
                "three samples, or the channels of a camera?",
                file=path,
                field="header",
                found=", ".join(heads),
                expected="a word above them that says what was measured",
                hint='write "reflectance" or "emission" on a line above the header; sensitivities are not imported',
            )
        bare = [_own(column) for column in of_table]
        silent = [column for column, own in zip(of_table, bare, strict=True) if own is None]
        power = all(names_power(column.words or column.unit) for column in silent)
        told += [together or own or around or ("emission" if power else None) for own in bare]
    return told


def _own(column: Column) -> str | None:
    """What a column's own heading and unit say."""
    if names_sensitivity(column.words):
        return "sensitivity"
    own = quantity_in(f"{column.words} {column.unit}")
    # "a.u." behind a word for power are arbitrary units.
    return None if own == "absorbance" and names_power(column.words) else own


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


def _check_no_light(name: str, path: Path) -> None:
    if names_perhaps_light(name):
        raise InputError(
            "a sample, or a light?",
            file=path,
            field=shortened(name),
            found="a name alone, no word for what was measured",
            expected="a header that says reflectance, transmittance or emission",
            hint='write "reflectance" or "spectral power" on a line above the header',
        )


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
    kept = [column for column in columns if not re.search("counts?", f"{column.words} {column.unit}", re.I)]
    if 0 < len(kept) < len(columns) and any(quantity_in(f"{column.words} {column.unit}") for column in kept):
        gathering.note("columns of raw counts are left out: the file holds what was made of them")
        return kept
    return columns


def _unit_of_lines(words: str) -> Unit | None:
    """Percent or fractions, on a line above the table that is about the measured values, not about humidity."""
    about = ("reflectance", "transmittance", "radiance factor")
    for line in words.splitlines():
        if (quantity_in(line) in about or re.search("unit|scale", line, re.I)) and (found := unit_in(line)):
            return found
    return None


def _refusal(column: Column, quantity: str | None, path: Path) -> InputError | None:
    if quantity == "absorbance":
        return InputError(
            "absorbance is neither reflectance nor transmittance",
            file=path,
            field=column.name,
            found=column.words or column.unit or None,
            expected="reflectance, transmittance or emission",
            hint="export %R or %T: instruments show absorbance, K/S or log(1/R) as another mode of the same scan",
        )
    if quantity == "sensitivity":
        return InputError(
            "a sensitivity is not the spectrum of a colour",
            file=path,
            field=column.name,
            found=column.words or None,
            expected="reflectance, transmittance or emission",
            hint="colour-matching functions, cone fundamentals and responses of sensors are not imported",
        )
    if quantity == "index":
        return InputError(
            "a refractive index is not the spectrum of a colour",
            file=path,
            field=column.name,
            found=column.words or None,
            expected="reflectance, transmittance or emission",
            hint="describe the material with tables of n and k instead",
        )
    if column.bad is not None:
        line, cell = column.bad
        return InputError(
            "not a number",
            file=path,
            field=f"{column.name}, line {line}",
            found=repr(shortened(cell, 40)),
            expected="a number, or an empty cell where there is none",
        )
    return None
