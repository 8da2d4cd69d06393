"""One spectrum of a text table in the making, and rows that do not fit it."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ...errors import InputError


@dataclass
class Column:
    """One spectrum in the making.

    Parameters
    ----------
    name : "" where the table calls it nothing but what was measured.
    words, unit : its header, and the unit in it.
    wavelengths, values : as in the file; NaN where a cell is empty.
    nm : nanometres per unit of `wavelengths`.
    unit_open : whether the table calls them wavelengths and gives no unit.
    bad : line and text of the first cell that is neither a number nor empty.
    beside : other cells that belong to it, by header.
    place : its column and that of its wavelengths, where both run down.
    around, preamble : words, and keys and values, of the lines above its table.
    table, alike : number of its table in the file, and of the first one with the same headings.
    """

    name: str
    words: str
    unit: str
    wavelengths: array[float]
    values: array[float]
    nm: float = 1.0
    bad: tuple[int, str] | None = None
    beside: dict[str, str] = field(default_factory=dict)
    unit_open: bool = False
    place: tuple[int, int] = (0, 0)
    around: str = ""
    preamble: dict[str, str] = field(default_factory=dict)
    table: int = 0
    alike: int = 0


@dataclass(frozen=True)
class NextTable:
    """Where another table begins in a file: lines are counted as in the file.

    Parameters
    ----------
    after : the last line of the table before; what follows it is about the next.
    line : the first line of numbers ("down"), or the header of wavelengths ("across").
    """

    after: int
    line: int
    way: Literal["down", "across"]


def trimmed(cells: list[str]) -> list[str]:
    """Cells without the empty ones at the end."""
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def ragged(path: Path, line: int, found: int, expected: int) -> InputError:
    """The refusal of a row that is shorter or longer than its table."""
    return InputError(
        "a row is cut short" if found < expected else "a row is too long",
        file=path,
        field=f"line {line}",
        found=f"{found} cells",
        expected=f"{expected} cells, as in the header",
        hint="the file may be truncated; export it again",
    )
