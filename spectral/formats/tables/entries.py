"""Spectra of a text table: quantity, unit and condition from the words that stand beside the numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ....runtime.errors import InputError
from ...angles import geometry_of_columns
from ...measurement import at_an_angle, conditions_in
from ..import_options import ImportOptions, Scale
from ..registry import SpectralFile, StatedColour
from ..shared.colour_words import (
    colour_axis,
    condition_in,
    illuminant_in,
    illuminants_in,
    names_condition,
    observer_in,
    observers_in,
    stated_colours,
)
from ..shared.decisions import Sign, ValueRange, divisor_of, power_per_frequency, undecided
from ..shared.entry_rules import DELETED, Gathering, in_visible
from ..shared.text import shortened
from ..shared.words import names_power_per_frequency, quantity_in, unit_in
from .axis import NANOMETRE, refuse_angstroms, refuse_even_reciprocals, scaled
from .makers import name_by_maker
from .parsing import TextTable
from .quantities import OF_SCALES, counts_removed, identifiers_removed, judge, scatter_removed
from .section import Column


def table_entries(
    table: TextTable,
    path: Path,
    format_name: str,
    answer: ImportOptions,
    hints: Sequence[Sign] = (),
    may_be_counts: bool = False,
) -> SpectralFile:
    """Return a table's columns as entries.

    A column is what its own header says, else what the lines above its table say, else what the person says, else what
    several signs agree on (`shared.decisions`, which also says what follows where there is no unit). The unit is looked
    for in the same places. What nothing tells is refused, all of it at once.

    Parameters
    ----------
    answer : what a person says where the file does not.
    hints : signs that the format adds, such as the suffix of its name.
    may_be_counts : whether large values may be an instrument's counts.
    """
    gathering = Gathering(path, format_name)
    for note in table.notes:
        gathering.note(note)
    name_by_maker(table, path.stem)
    columns = _named(table, path)
    kept = counts_removed(columns)
    if len(kept) < len(columns):
        of_counts = [column.name for column in columns if column not in kept]
        gathering.note(f"columns of raw counts are left out: {', '.join(of_counts[:6])}")
    for column in kept:
        column.samples, column.grid_nm = np.asarray(column.values, dtype=np.float64), _grid(column, gathering)
    kept, identifiers = identifiers_removed(kept)
    if identifiers:
        gathering.note(f"columns of identifiers are left out: {', '.join(identifiers[:6])}")
    kept, scatter = scatter_removed(kept)
    if scatter:
        gathering.note(f"spectra beside the measurements, by their names, are left out: {', '.join(scatter[:6])}")
    together = Counter(column.table for column in kept)
    for column in kept:
        column.colours = _colours(column, table, together[column.table] == 1)
        lights = illuminants_in(column.around)
        if len(lights) > 1 and any(colour.illuminant is None for colour in column.colours):
            gathering.note(f"the file leaves open which of {', '.join(lights)} the colours beside the spectra are for")
    judge(kept, answer, hints, path, may_be_counts)
    _refuse_densities(kept)
    _find_scales(kept, answer)
    if open_ones := [column for column in kept if not (column.decision or column.refusal)]:
        signs = [sign for column in open_ones for sign in column.signs]
        refusal = undecided(signs, ", ".join(column.name for column in open_ones[:3]), len(open_ones))
        gathering.rejected.append((open_ones[0].name, refusal))
    for column in kept:
        if column.refusal:
            gathering.rejected.append((column.name, column.refusal))
        elif column.decision is not None:
            gathering.take(
                column.name,
                column.grid_nm,
                column.samples,
                column.decision,
                column.scale,
                stated=column.colours,
                details=_details(column, together[column.table] == 1),
            )
    return gathering.finish(table.preamble)


def _details(column: Column, alone: bool) -> dict[str, str]:
    """Collect what is said of a column; the keys above its table are about it where it is `alone` there."""
    details = dict(column.preamble) if alone else {}
    others = {head: cell for head, cell in column.beside.items() if not colour_axis(head)}
    details |= {shortened(head, 60): shortened(cell) for head, cell in others.items()}
    if geometry := geometry_of_columns(column.beside):
        details.setdefault("geometry", geometry)
    if column.unit:
        details["units"] = column.unit
    if condition := condition_in(column.words) or condition_in(column.around):
        details["condition"] = condition
    about = [line for line in column.around.splitlines() if quantity_in(line)]
    for part, said in [item for words in (column.words, *about) for item in conditions_in(words).items()]:
        details.setdefault(part, said)
    return details


def _colours(column: Column, table: TextTable, alone: bool) -> tuple[StatedColour, ...]:
    """Return the colours beside a column; those in the lines above are its own where it is `alone` in its table."""
    said = column.preamble if alone else {}
    said = said | {head: cell for head, cell in column.beside.items() if colour_axis(head)}
    own = " ".join(cell for head, cell in column.beside.items() if names_condition(head))
    lights, eyes = illuminants_in(column.around), observers_in(column.around)
    return stated_colours(
        {head: table.dialect.number(cell) for head, cell in said.items()},
        illuminant_in(own) or (lights[0] if len(lights) == 1 else None),
        observer_in(own) or (eyes[0] if len(eyes) == 1 else None),
    )


def _find_scales(columns: Sequence[Column], answer: ImportOptions) -> None:
    """Find the divisor of each column: one answer for all columns with one unit below one kind of heading."""
    groups: dict[tuple[int, Scale | None, str, bool], list[tuple[Column, str]]] = {}
    for column in columns:
        usable = column.bad is None and column.refusal is None
        if usable and column.decision is not None and column.decision.quantity != "emission":
            unit, words = _unit(column)
            key = (column.alike, unit, column.decision.quantity, column.decision.stated)
            groups.setdefault(key, []).append((column, words))
    for (_, unit, quantity, stated), group in groups.items():
        of_light = np.concatenate([_of_light(column.grid_nm, column.samples) for column, _ in group])
        if not of_light.size:
            continue
        angled = quantity == "reflectance" and any(map(_is_at_an_angle, (column for column, _ in group)))
        values = ValueRange.of(of_light, "radiance factor" if angled else quantity, stated)
        if unit is None and quantity == "radiance factor" and stated and values.highest <= 20.0:
            unit = "fraction"
        words = next((words for _, words in group if words), "the word for it")
        factors = [column.likeness.factor for column, _ in group if column.likeness]
        if unit is None and answer.scale is None and not stated and len(factors) == len(group):
            unit, words = ("percent" if min(factors) > 10.0 else "fraction"), "their published scale"
        scale = refusal = None
        try:
            if unit is None and answer.scale is None:
                _refuse_two_scales([column for column, _ in group], values)
            scale = divisor_of(values, unit, words, answer)
        except InputError as reason:
            refusal = reason
        for column, _ in group:
            column.scale, column.refusal = scale, refusal


def _is_at_an_angle(column: Column) -> bool:
    """Return whether a reading says that it is at an aspecular angle, where a reflectance is a radiance factor."""
    return at_an_angle(" ".join((column.name, column.words, *column.beside.values())))


def _refuse_two_scales(columns: Sequence[Column], values: ValueRange) -> None:
    """Refuse percents among fractions, without a unit: half of a table does not stay below one per cent."""
    dark = [column for column in columns if _of_light(column.grid_nm, column.samples).max(initial=0.0) <= 1.0]
    if values.only_percent and len(columns) > 1 and 2 * len(dark) >= len(columns):
        above = next(column.name for column in columns if all(column is not other for other in dark))
        raise InputError(
            "percent among fractions?",
            field="values",
            found=f"{len(dark)} of {len(columns)} spectra stay below 1, as {dark[0].name} does, and {above} does not",
            expected="one scale in a table, or a unit beside each spectrum",
            hint='write the unit behind each heading, such as "(%)"; if all are percent, say --scale percent',
        )


def _grid(column: Column, gathering: Gathering) -> np.ndarray:
    """Wavelengths of a column in nm; those that nothing but micrometres can be, and that are called wavelengths."""
    values = np.asarray(column.wavelengths, dtype=np.float64)
    axis, where = column.axis, "first column" if column.place != (0, 0) else "header"
    values, tenfold = scaled(values, axis, column.axis_words, where)
    if tenfold:
        gathering.note(f"the axis is {tenfold}, the power of ten in {shortened(column.axis_words.strip(), 60)!r}")
    if column.axis_by_line and values.size and _are_of_light(values) and values.min() > 0.0:
        # A line above may speak of something else.
        axis = axis if _are_of_light(axis.wavelengths_nm(values)) else NANOMETRE
    if column.unsaid or column.unit_open:
        refuse_angstroms(values, where)
        if column.unsaid:
            refuse_even_reciprocals(values, where)
    grid = axis.wavelengths_nm(values)
    if axis.reciprocal:
        column.over = axis.name
        gathering.note(f"the axis is in {axis.name} and converted: {axis.formula}")
    if column.unit_open and grid.size and grid.min() >= 0.1 and grid.max() <= 50.0:
        gathering.note(f"wavelengths from {grid.min():g} to {grid.max():g} without a unit are taken as micrometres")
        grid = grid * 1000.0
    return grid


def _are_of_light(grid: np.ndarray) -> bool:
    return bool(grid.min() >= 100.0 and grid.max() <= 20_000.0)


def _refuse_densities(columns: Sequence[Column]) -> None:
    """Refuse spectral power over frequency or energy: the power in a nanometre is another number."""
    for column in columns:
        if column.decision is None or column.decision.quantity != "emission":
            continue
        around = [line for line in column.around.splitlines() if quantity_in(line) == "emission"]
        unit = next((words for words in (column.words, column.unit, *around) if names_power_per_frequency(words)), "")
        if column.over or unit:
            column.refusal = power_per_frequency(column.name, unit or f"{column.decision.words}, over {column.over}")


def _of_light(grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values that say on which scale a column is: less flags, empty cells, and noise beyond the visible."""
    there = values > DELETED
    seen = values[in_visible(grid) & there]
    if seen.size:
        most = float(seen.max())
        there &= in_visible(grid) | ((values >= -0.01 * abs(most)) & (values <= 2.0 * most))
    return values[there]


def _named(table: TextTable, path: Path) -> list[Column]:
    """Return all columns, each with a name: the file's where the table gives none, numbered where a later block repeats
    it.
    """
    taken: set[str] = set()
    for number, block in enumerate(table.blocks, 1):
        for column in block:
            column.name = column.name or path.stem
            if column.name in taken:
                column.name = f"{column.name} ({number})"
        taken |= {column.name for column in block}
    return [column for block in table.blocks for column in block]


def _unit(column: Column) -> tuple[Scale | None, str]:
    """Percent or fractions, and where that stands: in the unit, the heading, or a line above the table that is about
    the measured values, not about humidity.
    """
    about = ("reflectance", "transmittance", "radiance factor")
    for words, what in ((column.words, "the heading"), (column.unit, "the unit")):
        if unit := unit_in(words):
            return unit, f"{what} {shortened(words, 60)!r}"
    for line in column.around.splitlines():
        if (quantity_in(line) in about or re.search(OF_SCALES, line, re.I)) and (unit := unit_in(line)):
            return unit, f"the line {shortened(line, 60)!r}"
    return None, ""
