"""How a text table is written: what parts its cells, and which mark is the decimal one."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from ..shared.text import number

#: Characters of one line; beyond it, nobody's header of wavelengths goes.
LONGEST_LINE = 4 * 2**20

_COMMENT = re.compile(r"^\s*(?:#|//|!|%(?!\s*[RT]\b))\s?")
# "380 nm", "S_380nm", "Spectral Data 380[nm]", "R400nm": the unit tells, whatever stands before.
_WITH_UNIT = re.compile(
    r"(?:[A-Za-zρτλ%][A-Za-z_ .%-]{0,30}?[_ .:-]{0,2})?(?P<nm>\d{1,5}(?:[.,]\d{1,6})?)\s{0,2}"
    r"[\[(]?\s?(?P<unit>nm|µm|μm|um)\s?[\])]?\.?",
    re.I,
)
# "R_400", "SPECTRAL_NM380", "nm 380": without a unit, only words that mean spectra; S1, S2 ... are samples.
_WITH_WORD = re.compile(
    r"(?:R|T|S_|SPD|rho|tau|ρ|τ|λ|lambda|wl|wavelength|nm|spec|spectral(?:[_ ]nm)?|spectrum|refl(?:ectance)?|%[RT])"
    r"[_ .:-]{0,2}(?P<nm>\d{3,5}(?:[.,]\d{1,6})?)",
    re.I,
)


@dataclass(frozen=True)
class Dialect:
    """What parts the cells of a line ("" for white space), and the decimal mark."""

    delimiter: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Stripped cells of one line."""
        if not self.delimiter:
            return line.split()
        if '"' not in line:
            return [cell.strip() for cell in line.split(self.delimiter)]
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            return [cell.strip().strip('"') for cell in line.split(self.delimiter)]

    def number(self, cell: str) -> float:
        """The number in a cell, NaN if there is none; a percent sign after it is left out (see `in_percent`)."""
        return number(cell.rstrip("% ") if cell.endswith("%") else cell, self.decimal)

    def wavelength(self, cell: str) -> tuple[float, bool] | None:
        """The wavelength that a cell names, and whether it says so with a unit or a word; None if it is none."""
        plain = self.number(cell)
        if plain == plain:
            return plain, False
        cell = cell[:60]
        if match := _WITH_UNIT.fullmatch(cell):
            return float(match["nm"].replace(",", ".")) * (1.0 if match["unit"][0] in "nN" else 1000.0), True
        if match := _WITH_WORD.fullmatch(cell):
            return float(match["nm"].replace(",", ".")), True
        return None


def in_percent(cell: str) -> bool:
    """Whether a spreadsheet wrote the number in a cell with a percent sign."""
    return cell.endswith("%") and any(sign.isdigit() for sign in cell)


# In this order: white space is also inside names, and a comma is also a decimal mark.
_CANDIDATES = (("\t", ".,"), (";", ".,"), (",", ".,"), ("", ".,"))


def dialect_of(lines: Sequence[str]) -> Dialect:
    """The dialect in which most cells of a sample of lines are numbers, in rows of two numbers or more."""
    middle = len(lines) // 2
    sample = [*lines[:150], *lines[max(150, middle - 100) : middle + 100], *lines[max(150, len(lines) - 50) :]]
    sample = [line[:20_000] for line in sample if line.strip()]
    best: list[tuple[int, Dialect]] = []
    for delimiter, marks in _CANDIDATES:
        scored = [(_score(Dialect(delimiter, mark), sample), Dialect(delimiter, mark)) for mark in marks]
        best.append(max(scored, key=lambda pair: pair[0]))
    most = max(score for score, _ in best)
    return next(dialect for score, dialect in best if score >= 0.6 * most)


def _score(dialect: Dialect, sample: Sequence[str]) -> int:
    total = 0
    for line in sample:
        if dialect.delimiter and dialect.delimiter not in line:
            continue
        numbers = sum(dialect.wavelength(cell) is not None for cell in dialect.cells(line)[:300])
        total += numbers if numbers > 1 else 0
    return total


def comment(line: str) -> str | None:
    """The words of a line that is a comment, None of any other."""
    match = _COMMENT.match(line)
    return line[match.end() :].strip() if match else None


def checked_lines(lines: list[str], path: Path) -> list[str]:
    """The lines, if each is short enough to be a row of a table."""
    for index, line in enumerate(lines, 1):
        if len(line) > LONGEST_LINE:
            raise InputError(
                "a line is too long",
                file=path,
                field=f"line {index}",
                found=f"{len(line)} characters",
                expected=f"at most {LONGEST_LINE}",
            )
    return lines
