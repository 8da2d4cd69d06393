"""Dialect in which a table is written: it is found quickly, and as the plain way finds it."""

import math
import random

import pytest
from metamer.spectral.formats import csv, instrument_text
from metamer.spectral.formats.registry import HEAD
from metamer.spectral.formats.tables import dialect as module
from metamer.spectral.formats.tables.dialect import Dialect, dialect_of, two_numbers


def plain_wavelength(dialect, cell):
    value = dialect.number(cell)
    if not math.isnan(value):
        return value, False
    for pattern in (module._WITH_UNIT, module._WITH_WORD):
        if match := pattern.fullmatch(cell[:60]):
            micrometres = pattern is module._WITH_UNIT and match["unit"][0] not in "nN"
            return float(match["nm"].replace(",", ".")) * (1000.0 if micrometres else 1.0), True
    return None


def plainly_torn(dialect, cell):
    """Digits and marks, and one mark too many for a number."""
    letters = set(cell) - set("0123456789+-.,;%eE \t\xa0")
    other = {".": ",", ",": "."}[dialect.decimal]
    cell = cell.rstrip("% ")
    marks = any(mark in cell for mark in (other, ";", " ")) or (dialect.decimal == "," and cell.count(",") > 1)
    return not letters and any(sign.isdigit() for sign in cell) and math.isnan(dialect.number(cell)) and marks


def plain_dialect(lines):
    """Every cell of every line, in every dialect."""
    best = []
    for delimiter, marks in module._CANDIDATES:
        scores = []
        for dialect in (Dialect(delimiter, mark) for mark in marks):
            score = 0
            for line in lines:
                if delimiter in line:
                    cells = dialect.cells(line)[:300]
                    count = sum(plain_wavelength(dialect, cell) is not None for cell in cells)
                    count -= sum(plainly_torn(dialect, cell) for cell in cells)
                    score += count if count > 1 else 0
            scores.append((score, dialect))
        best.append(max(scores, key=lambda pair: pair[0]))
    most = max(score for score, _ in best)
    return next(dialect for score, dialect in best if score >= 0.6 * most)


PIECES = ["380", "0.25", "0,25", "1e-3", "12%", "R_400", "400 nm", "1.5 µm", "nm", "a7", "a 3", "٣", "-", "", "1_0"]


@pytest.mark.parametrize("seed", range(40))
def test_the_dialect_is_what_the_plain_way_finds(seed):
    drawn = random.Random(seed)
    parts = drawn.choice(["\t", ";", ",", " ", "  ", ", "])
    lines = [parts.join(drawn.choice(PIECES) for _ in range(drawn.randrange(1, 7))) for _ in range(12)]
    lines = [line for line in lines if line.strip()]
    assert dialect_of(lines) == plain_dialect(lines), lines


@pytest.mark.parametrize("cell", [*PIECES, "inf", "nan", "1e999", " 400", "400\xa0nm", "x" * 100 + "4"])
@pytest.mark.parametrize("mark", ".,")
def test_cells_are_what_the_plain_way_finds(cell, mark):
    assert Dialect(";", mark).wavelength(cell) == plain_wavelength(Dialect(";", mark), cell)


@pytest.mark.parametrize(
    ("line", "two"), [("380 0.2", True), ("a1b2", True), ("380", False), ("a word or 2", False), ("", False)]
)
def test_lines_without_two_numbers_are_soon_known(line, two):
    assert two_numbers(line) == two


def test_prose_and_programs_are_not_searched_for_tables(tmp_path, monkeypatch):
    """No dialect is looked for in a text that has no line of two numbers, no instrument without its keys."""
    monkeypatch.setattr(csv, "dialect_of", lambda lines: pytest.fail("looked for a dialect"))
    monkeypatch.setattr(instrument_text, "dialect_of", lambda lines: pytest.fail("looked for a dialect"))
    prose = b"The colour of the wall, measured in 1931.\nIt was a grey one.\n" * 100
    program = b"import os\n\ndef half(x):\n    return x / 2\n" * 100
    for name, text in (("README.txt", prose), ("half.py", program)):
        (tmp_path / name).write_bytes(text)
        assert not csv.recognises(tmp_path / name, text[:HEAD])
    assert not instrument_text.recognises(tmp_path / "log.txt", b"12:00 3 4\n" * 100)
