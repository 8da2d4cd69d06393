"""Dialect of a text table: the separator of its cells, and the decimal mark."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache

from ....runtime.errors import InputError
from ..shared.text import cell_number

#: Characters of one line; beyond it, nobody's header of wavelengths goes.
LONGEST_LINE = 4 * 2**20

_COMMENT = re.compile(r"^\s*(?:#|//|!|%(?!\s*[RT]\b))\s?")
_NM = r"(?P<nm>\d{1,5}(?:[.,]\d{1,6})?)"
# Behind a wavelength: a unit in brackets, what was measured, how.
_BEHIND = r"(?:[_ ]{0,2}(?:[\[(][^\[\]()]{1,16}[\])]|%\s?[RT]?|[RT]\s?%?|refl\w{0,12}|trans\w{0,12}|SC[IE]))?"
# "380 nm", "S_380nm", "Spectral Data 380[nm]", "R(400 nm)", "M0_400nm", "400 nm [%]": the unit tells.
_WITH_UNIT = re.compile(
    r"(?:(?:[A-Za-zρτλ%@]|\d{1,3}\s?°|\d{1,2}\s?(?:as|[:/]))"
    r"(?:[\w .:/°%-]{0,30}?(?:\s?[\[(]%[\])])?[_ .:=@-]{1,3}%?[RT]?|[A-Za-z_ .%-]{0,30}?[_ .:=@-]{0,2}))?"
    rf"[\[(]?{_NM}\s{{0,2}}[\[(]?\s?(?P<unit>nm|µm|μm|um|[åÅ])\s?[\])]?\.?{_BEHIND}",
    re.I,
)
# "R_400", "SPECTRAL_NM380", "R(400)": without a unit, only words that mean spectra; S1, S2 ... are samples.
_WITH_WORD = re.compile(
    r"(?:R|T|S_|SPD|SC[IE]|rho|tau|ρ|τ|λ|lambda|wl|wavelength|nm|spec|spectral(?:[_ ]nm)?|spectrum|refl(?:ectance)?|"
    r"transmittance|remission|(?:ir)?radiance|%\s?[RT]|[RT]\s?%)(?:\s?[\[(]%[\])])?"
    rf"[_ .:=@-]{{0,2}}[\[(]?(?P<nm>\d{{3,5}}(?:[.,]\d{{1,6}})?)[\])]?{_BEHIND}",
    re.I,
)
# "400 (%)", "400 %R": percent at a wavelength.
_WITH_PERCENT = re.compile(r"(?P<nm>\d{3,4}(?:[.,]\d{1,6})?)\s?(?:[\[(]\s?%\s?[RT]?\s?[\])]|%\s?[RT])", re.I)

_SHORTEST_NAMED, _SCALE = 100.0, re.compile(r"(?<![A-Za-z\d])[x×*/] ?10+\b", re.I)
_DIGIT = re.compile(r"\d")
# Least content of two cells with a number each.
_TWO_NUMBERS = re.compile(r"\d\D+\d")


def two_numbers(line: str) -> bool:
    """Return whether there may be two cells with a number each in a line, whatever parts them: soon seen of most lines.

    >>> two_numbers("380 nm  0.25"), two_numbers("In 1924, the CIE met.")
    (True, False)
    """
    return _TWO_NUMBERS.search(line) is not None


# Digits, signs, decimal marks and what parts cells, and nothing else: not one word.
_DIGITS_AND_MARKS = re.compile(r"[-+\d.,;|¦~^&\s%eE]*\d[-+\d.,;|¦~^&\s%eE]*")
_PARTED = {".": re.compile(r"[,;|¦~^&\s]"), ",": re.compile(r"[.;|¦~^&\s]|,\D*$|,\d*,")}


def _number(cell: str, decimal: str) -> float:
    return cell_number(cell.rstrip("% ") if cell.endswith("%") else cell, decimal)


def is_torn(cell: str, decimal: str) -> bool:
    """Return whether a cell holds a number, or several, of another way to read the table: no number itself, and no
    word.

    >>> is_torn("0 7", "."), is_torn("7,09", "."), is_torn("7,09", ","), is_torn("n/a", ".")
    (True, True, False, False)
    """
    return _number(cell, decimal) != _number(cell, decimal) and _is_of_pieces(cell, decimal)


def _is_of_pieces(cell: str, decimal: str) -> bool:
    return bool(_DIGITS_AND_MARKS.fullmatch(cell) and _PARTED[decimal].search(cell.rstrip("% ")))


@lru_cache(maxsize=1 << 14)  # who looks for a table asks for each cell in many ways
def _wavelength(cell: str, decimal: str) -> tuple[float, bool] | None:
    # Most cells of most files are words.
    if _DIGIT.search(cell) is None:
        return None
    plain = _number(cell, decimal)
    if plain == plain:
        return plain, False
    match = _named(cell)
    if match is None:
        return None
    unit = match.groupdict().get("unit") or "nm"
    nm = 1.0 if unit[0] in "nN" else 0.1 if unit in "åÅ" else 1000.0
    found = float(match["nm"].replace(",", ".")) * nm
    # "Wavelength (10 nm)" and "Wavelength x1000 (nm)" name a step or a scale.
    return None if found < _SHORTEST_NAMED or _SCALE.search(cell) else (found, True)


def _named(cell: str) -> re.Match[str] | None:
    cell = cell[:60]
    return _WITH_UNIT.fullmatch(cell) or _WITH_WORD.fullmatch(cell) or _WITH_PERCENT.fullmatch(cell)


def words_beside(cell: str) -> str:
    """Return the words beside the wavelength that a heading names, "" where there are none.

    >>> words_beside("SCI 400nm"), words_beside("R(400 nm) [%]"), words_beside("400")
    ('SCI', 'R [%]', '')
    """
    match = _named(cell) if _DIGIT.search(cell) else None
    if match is None:
        return ""
    end = match.end("unit") if match.groupdict().get("unit") else match.end("nm")
    before, behind = cell[: match.start("nm")].rstrip("_ .:=@-[("), cell[end:].lstrip("_ .:])")
    return f"{before} {behind}".strip()


@dataclass(frozen=True)
class Dialect:
    """Separator of the cells of a line ("" for white space), and the decimal mark."""

    delimiter: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Stripped cells of one line."""
        if not self.delimiter and '"' not in line:
            return line.split()
        if self.delimiter == "|":
            # In Markdown also at both ends.
            line = line.strip().removeprefix("|").removesuffix("|")
        if not self.delimiter:
            with suppress(csv.Error, StopIteration):
                return next(csv.reader([" ".join(line.split())], delimiter=" "))
            return line.split()
        if '"' in line:
            with suppress(csv.Error, StopIteration):
                quoted = next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True))
                return [cell.strip() for cell in quoted]
        return [cell.strip().strip('"') for cell in line.split(self.delimiter)]

    def number(self, cell: str) -> float:
        """Return the number in a cell, NaN if there is none; a percent sign after it is left out (see `in_percent`)."""
        return _number(cell, self.decimal)

    def is_number(self, cell: str) -> bool:
        """Return whether a cell holds a number."""
        return not math.isnan(_number(cell, self.decimal))

    def wavelength(self, cell: str) -> tuple[float, bool] | None:
        """Return the wavelength that a cell names, and whether it says so with a unit or a word; None if it is none."""
        return _wavelength(cell, self.decimal)

    def names_wavelength(self, cell: str) -> bool:
        """Return whether a cell names a wavelength with a unit or a word."""
        found = self.wavelength(cell)
        return found is not None and found[1]


def in_percent(cell: str) -> bool:
    """Return whether a spreadsheet wrote the number in a cell with a percent sign."""
    return cell.endswith("%") and any(sign.isdigit() for sign in cell)


# In this order: white space is also inside names, and a comma is also a decimal mark.
_CANDIDATES = (("\t", ".,"), (";", ".,"), ("|", ".,"), (",", ".,"), ("", ".,"))


def dialect_of(lines: Sequence[str]) -> Dialect:
    """Return the dialect in which most cells of a sample of lines are numbers, in rows of two numbers or more."""
    return dialects_of(lines)[0]


def dialects_of(lines: Sequence[str]) -> list[Dialect]:
    """Dialects in which a sample of lines has rows of two numbers or more, that of most numbers first.

    A cell that holds pieces of numbers counts against a dialect. There is always one.
    """
    middle = len(lines) // 2
    sample = [*lines[:150], *lines[max(150, middle - 100) : middle + 100], *lines[max(150, len(lines) - 50) :]]
    sample = [line for line in (line[:20_000] for line in sample) if two_numbers(line)]
    scored: list[tuple[int, Dialect]] = []
    quoted = any('"' in line for line in sample)
    for delimiter, marks in _CANDIDATES:
        if delimiter == "," and not quoted:
            marks = "."  # the other one parts cells
        dialects = [Dialect(delimiter, mark) for mark in marks]
        rows = [dialects[0].cells(line)[:300] for line in sample if delimiter in line]
        # The first of two marks that read all cells alike.
        of_each = sorted(((_score(dialect, rows), dialect) for dialect in dialects), key=lambda pair: -pair[0])
        scored += of_each[: 1 if of_each[0][0] == of_each[-1][0] else 2]
    most = max(score for score, _ in scored)
    best = next(dialect for score, dialect in scored if score >= 0.6 * most)
    return [best, *(dialect for score, dialect in scored if score > 0 and dialect != best)]


def _score(dialect: Dialect, rows: Sequence[Sequence[str]]) -> int:
    counts = (sum(_worth(cell, dialect.decimal) for cell in row) for row in rows)
    return sum(count for count in counts if count > 1)


@lru_cache(maxsize=1 << 14)
def _worth(cell: str, decimal: str) -> int:
    """1 for a number or a wavelength, -1 for pieces of numbers, 0 for words."""
    return 1 if _wavelength(cell, decimal) is not None else -_is_of_pieces(cell, decimal)


def comment(line: str) -> str | None:
    """Return the words of a line that is a comment, None of any other."""
    match = _COMMENT.match(line)
    return line[match.end() :].strip() if match else None


def check_lengths(lines: Sequence[str]) -> None:
    """Refuse a line that is too long to be a row of a table."""
    for index, line in enumerate(lines, 1):
        if len(line) > LONGEST_LINE:
            raise InputError(
                "a line is too long",
                field=f"line {index}",
                found=f"{len(line)} characters",
                expected=f"at most {LONGEST_LINE}",
            )
