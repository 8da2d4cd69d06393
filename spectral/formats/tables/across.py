"""Tables with wavelengths across their header."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from ...errors import InputError
from ..shared.gathering import MOST_SAMPLES
from ..shared.text import is_missing
from ..shared.words import colour_axis
from .column import Column, NextTable, ragged, trimmed
from .dialect import Dialect, in_percent
from .layout import Layout, Row, is_name_header, nm_per_unit, told_wavelengths


class AcrossReader:
    """Reads a table with wavelengths across its header, a spectrum a row, until a row is another such header."""

    def __init__(self, layout: Layout, heads: list[str], dialect: Dialect, path: Path) -> None:
        self.axes, self.heads, self.dialect, self.path = layout.axes, heads, dialect, path
        taken = set(layout.axes)
        self.others = [column for column in range(len(heads)) if column not in taken]
        self.last_line = 0
        self.next: NextTable | None = None

    def read(self, rows: Iterator[Row], notes: list[str]) -> list[list[Column]]:
        """The spectra; `next` says afterwards where another table begins."""
        heads, others, dialect = self.heads, self.others, self.dialect
        wavelengths = array("d", ((dialect.wavelength(heads[column]) or (math.nan,))[0] for column in self.axes))
        nm = nm_per_unit(" ".join(heads[: self.axes[0]]))
        prefix = re.match(r"\s*([RT])[ _.:-]?\s*\d", heads[self.axes[0]])
        words = " ".join(heads[column] for column in others if colour_axis(heads[column]) is None)
        words += {"R": " reflectance", "T": " transmittance"}[prefix[1]] if prefix else ""
        kinds = [column for column in others if re.search("type|mode|quantity|measure|geometr", heads[column], re.I)]
        names = [column for column in others if is_name_header(heads[column]) and colour_axis(heads[column]) is None]
        # A name is better than a number; without either, whatever stands first.
        names.sort(key=lambda column: bool(re.search(r"\bid\b|_id$|^no\b|^#", heads[column], re.I)))
        names += [column for column in others if colour_axis(heads[column]) is None]
        columns: list[Column] = []
        without = pending = samples = 0
        for line, cells in rows:
            values = array("d", (dialect.number(cells[at]) if at < len(cells) else math.nan for at in self.axes))
            empty = all(value != value for value in values)
            if self._is_header(cells, values, line, told=empty):
                if not pending and trimmed(list(cells)) == heads:
                    continue  # repeated, as on each page of a print
                self.next = NextTable(self.last_line, line, "across")
                break
            if empty:
                pending += 1
                continue
            if len(cells) <= self.axes[-1] or (len(trimmed(cells)) > len(heads)):
                raise ragged(self.path, line, len(cells), len(heads))
            without, pending, self.last_line = without + pending, 0, line
            samples += len(values)
            if samples > MOST_SAMPLES:
                raise InputError("too many samples in one file", file=self.path, expected=f"at most {MOST_SAMPLES}")
            wrong = (at for at, value in zip(self.axes, values, strict=True) if value != value and at < len(cells))
            bad = next(((line, cells[at]) for at in wrong if not is_missing(cells[at])), None)
            called = next((at for at in names if at < len(cells) and cells[at]), -1)
            name = cells[called] if called >= 0 else ""
            beside = {
                heads[at]: cells[at] for at in others if at < len(cells) and at != called and heads[at] and cells[at]
            }
            kind = " ".join([words, *(cells[at] for at in kinds if at < len(cells))])
            unit = "%" if in_percent(cells[self.axes[0]]) else ""
            columns.append(Column(name or f"row {len(columns) + 1}", kind, unit, wavelengths, values, nm, bad, beside))
        if self.next is None:
            without += pending
        if without:
            notes.append(f"{without} lines below the header have no values at wavelengths and are left out")
        return [columns]

    def _is_header(self, cells: Sequence[str], values: Sequence[float], line: int, told: bool) -> bool:
        """Whether a row has wavelengths where spectra have values: with their unit, or below the same headings.

        Raises
        ------
        InputError
            Its values could be either.
        """
        if told:
            return len(told_wavelengths(cells, self.dialect)) >= min(3, len(self.axes))
        known = [at for at in self.others if self.heads[at]]
        if known and all(at < len(cells) and cells[at].casefold() == self.heads[at].casefold() for at in known):
            numbers = [self.dialect.number(cell) for at, cell in enumerate(cells) if at not in self.others and cell]
            if len(numbers) > 1 and _climbs(numbers):
                return True
        if len(values) < 5 or not _climbs(values):
            return False
        steps = [b - a for a, b in pairwise(values)]
        if max(steps) - min(steps) > 1e-9 * abs(steps[0]):
            return False
        raise InputError(
            "a spectrum, or the wavelengths of another table?",
            file=self.path,
            field=f"line {line}",
            found=f"{values[0]:g}, {values[1]:g} ... {values[-1]:g} in equal steps",
            expected="wavelengths with their unit, such as 380nm, or one table a file",
            hint="write the unit behind the wavelengths, or save the second table as a file of its own",
        )


def _climbs(values: Sequence[float]) -> bool:
    """Whether values rise throughout in the range of wavelengths in nm."""
    return values[0] >= 100.0 and values[-1] <= 20_000.0 and all(a < b for a, b in pairwise(values))
