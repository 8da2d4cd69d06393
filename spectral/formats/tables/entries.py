"""From a text table to a file of spectra: quantity, unit and condition from the words that stand beside the numbers."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...spectrum import Quantity
from ..reading import SpectralFile
from ..shared.gathering import Gathering, reflective_divisor
from ..shared.text import shortened
from ..shared.words import (
    Unit,
    colour_axis,
    condition_in,
    illuminant_in,
    measured,
    names_light,
    observer_in,
    quantity_in,
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

    A column is what its own header says, else what the lines above the table say, else `usual`, with a note. The unit
    is looked for in the same places; `reflective_divisor` says what follows where there is none.
    """
    gathering = Gathering(path, format_name)
    for note in table.notes:
        gathering.note(note)
    around = quantity_in(table.words)
    columns = _without_counts(_named(table, path), gathering)
    told = [quantity_in(f"{column.words} {column.unit}") or around for column in columns]
    silent = not all(told)
    if silent and usual != "emission" and all(names_light(column.name) for column in columns):
        usual = "emission"
    if silent:
        gathering.note(f"the file does not say what was measured; taken as {usual}")
    unit_around = _unit_of_lines(table.words)
    units: list[Unit | None] = [unit_in(column.unit) or unit_in(column.words) or unit_around for column in columns]
    ranges: dict[Unit | None, tuple[float, float]] = {}
    for column, quantity, unit in zip(columns, told, units, strict=True):
        if (quantity or usual) != "emission" and column.bad is None:
            low, high = ranges.get(unit, (math.inf, -math.inf))
            values = [value for value in column.values if value == value]
            ranges[unit] = min([low, *values]), max([high, *values])
    alone = len(columns) == 1
    beside = {key: table.dialect.number(value) for key, value in table.preamble.items()} if alone else {}
    condition_around = condition_in(table.words)
    light, angle = illuminant_in(table.words), observer_in(table.words)
    for column, quantity, unit in zip(columns, told, units, strict=True):
        if (refusal := _refusal(column, quantity, path)) is not None:
            gathering.rejected.append((column.name, refusal))
            continue
        kind = measured(quantity) or usual
        divisor = 1.0
        if kind != "emission" and unit in ranges:
            low, high = ranges[unit]
            stated_unit = "fraction" if unit is None and kind == "radiance factor" and high <= 20.0 else unit
            divisor, note = reflective_divisor(low, high, stated_unit, path, told=quantity is not None)
            if note:
                gathering.note(note)
        cells = {head: table.dialect.number(cell) for head, cell in column.beside.items() if colour_axis(head)}
        details = dict(table.preamble) if alone else {}
        details |= {shortened(head, 60): shortened(cell) for head, cell in column.beside.items() if head not in cells}
        if column.unit:
            details["units"] = column.unit
        if condition := condition_in(column.words) or condition_around:
            details["condition"] = condition
        grid = np.asarray(column.wavelengths, dtype=np.float64) * column.nm
        own = " ".join(cell for head, cell in column.beside.items() if _LIGHT_COLUMN.search(head))
        stated = stated_colours({**beside, **cells}, illuminant_in(own) or light, observer_in(own) or angle)
        gathering.add(column.name, grid, column.values, kind, divisor=divisor, stated=stated, details=details)
    return gathering.finish(table.preamble)


def _named(table: Table, path: Path) -> list[Column]:
    """All columns, each with a name: the file's where the table gives none, numbered where wavelengths start again."""
    columns = []
    for number, block in enumerate(table.blocks, 1):
        for column in block:
            column.name = column.name or path.stem
            if number > 1:
                column.name = f"{column.name} ({number})"
            columns.append(column)
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
