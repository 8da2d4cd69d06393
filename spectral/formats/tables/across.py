"""Tables with wavelengths across their header."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterable, Sequence
from itertools import pairwise

from ...errors import InputError
from ..shared.words import colour_axis
from .dialect import in_percent
from .layout import Row, is_name_header, nm_per_unit, told_wavelengths
from .section import Column, Section, cell, ragged, trimmed


def read_across(table: Section, rows: Iterable[Row], notes: list[str]) -> None:
    """Read a spectrum a row, until a row is another header of wavelengths."""
    heads, axes, dialect = table.heads, table.layout.axes, table.text.dialect
    others = [at for at in range(len(heads)) if at not in set(axes)]
    wavelengths = array("d", ((dialect.wavelength(heads[at]) or (math.nan,))[0] for at in axes))
    nm = nm_per_unit(" ".join(heads[: axes[0]]))
    prefix = re.match(r"\s*([RT])[ _.:-]?\s*\d", heads[axes[0]])
    plain = [at for at in others if colour_axis(heads[at]) is None]
    words = " ".join(heads[at] for at in plain)
    words += {"R": " reflectance", "T": " transmittance"}[prefix[1]] if prefix else ""
    kinds = [at for at in others if re.search("type|mode|quantity|measure|geometr", heads[at], re.I)]
    # A name is better than a number; without either, whatever stands first.
    names = [at for at in plain if is_name_header(heads[at])]
    names = sorted(names, key=lambda at: bool(re.search(r"\bid\b|_id$|^no\b|^#", heads[at], re.I))) + plain
    columns: list[Column] = []
    without = pending = 0
    for line, cells in rows:
        column = Column("", "", "%" if in_percent(cell(cells, axes[0])) else "", wavelengths, nm)
        for at in axes:
            column.take(line, cell(cells, at), dialect)
        if _is_header(table, others, cells, column, line):
            if not pending and trimmed(cells) == heads:
                continue  # repeated, as on each page of a print
            table.further = (line, "across")
            break
        if column.is_empty:
            pending += 1
            continue
        if len(cells) <= axes[-1]:
            raise ragged(line, len(cells), len(heads))
        cells = trimmed(cells)
        if len(cells) > len(heads):
            raise ragged(line, len(cells), len(heads))
        without, pending, table.last_line = without + pending, 0, line
        table.count(len(axes))
        called = next((at for at in names if cell(cells, at)), -1)
        column.name = cells[called] if called >= 0 else f"row {len(columns) + 1}"
        column.words = " ".join([words, *(cells[at] for at in kinds if at < len(cells))])
        column.beside = {heads[at]: cells[at] for at in others if at != called and heads[at] and cell(cells, at)}
        columns.append(column)
    without += pending if table.further is None else 0
    if without:
        notes.append(f"{without} lines below the header have no values at wavelengths and are left out")
    table.blocks = [columns]


def _is_header(table: Section, others: Sequence[int], cells: Sequence[str], row: Column, line: int) -> bool:
    """Whether a row has wavelengths where spectra have values: with their unit, or below the same headings.

    Raises
    ------
    InputError
        Its values could be either.
    """
    dialect, heads, values = table.text.dialect, table.heads, row.values
    if row.is_empty:
        return len(told_wavelengths(cells, dialect)) >= min(3, len(values))
    known = [at for at in others if heads[at]]
    if known and all(at < len(cells) and cells[at].casefold() == heads[at].casefold() for at in known):
        numbers = [dialect.number(cell) for at, cell in enumerate(cells) if at not in others and cell]
        if len(numbers) > 1 and _climbs(numbers):
            return True
    if len(values) < 5 or not _climbs(values):
        return False
    steps = [b - a for a, b in pairwise(values)]
    if max(steps) - min(steps) > 1e-9 * abs(steps[0]):
        return False
    raise InputError(
        "a spectrum, or the wavelengths of another table?",
        field=f"line {line}",
        found=f"{values[0]:g}, {values[1]:g} ... {values[-1]:g} in equal steps",
        expected="wavelengths with their unit, such as 380nm, or one table a file",
        hint="write the unit behind the wavelengths, or save the second table as a file of its own",
    )


def _climbs(values: Sequence[float]) -> bool:
    """Whether values rise throughout in the range of wavelengths in nm."""
    return values[0] >= 100.0 and values[-1] <= 20_000.0 and all(a < b for a, b in pairwise(values))
