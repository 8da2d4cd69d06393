"""Text tables about something else than spectra: stock lists and logs lie beside measurements, too.

Such a file is passed over in a folder, where a damaged table of spectra is refused. So it has to be plain: as many
cells in every row, and in none of them a word or a number that a spectrum's file could have.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ....runtime.errors import InputError
from ..shared.colour_words import colour_axis, condition_in
from ..shared.text import read_lines
from ..shared.words import names_power, names_sensitivity, quantity_in
from .axis import is_reciprocal_header
from .dialect import Dialect, comment, dialect_of
from .layout import Row, is_wavelength_header, layout_of, wavelengths_across

# Largest list that somebody keeps beside measurements.
_LARGEST_BYTES, _MOST_CELLS, _LONGEST_LINE, _SHOWN_LINES = 2 << 20, 100_000, 8000, 2000
_WORDS = re.compile(
    r"spect|wave|lambda|λ|illumin|observer|\bnm\b|nanomet|\d\s?nm\b|microns?\b|\b[µμu]m\b|1/cm|CIE", re.I
)
_LEADING = re.compile(r"\d{3,5}(?!\d)")
# Fewest numbers in a row or a column which could be wavelengths that mark a damaged table. With fewer rows the table is
# cut short.
_FEW = 3


def is_of_something_else(path: Path) -> bool:
    """True for rows of cells without wavelengths and without any word of a spectrum; False where there is any doubt.

    Never raises: what cannot be read, is cut to a row or two, is large or no text, is for its reader to refuse.
    """
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            return False
        lines = [line for line in read_lines(path) if line.strip()]
    except (InputError, OSError):
        return False
    plain = [line for line in lines if comment(line) is None]
    if len(plain) < _FEW or max(map(len, lines)) > _LONGEST_LINE:
        return False
    dialect = dialect_of(plain)
    marks = [mark for mark in "\t;," if all(mark in line for line in plain[:2])]
    if dialect.delimiter not in marks:
        # Without numbers, nothing tells a dialect: the mark that both first rows have does.
        dialect = Dialect(marks[0] if marks else "", ".")
    rows = [(number, dialect.cells(line)) for number, line in enumerate(plain)]
    if not dialect.delimiter or len({len(cells) for _, cells in rows}) > 1:
        return False
    cells = {cell for _, row in rows for cell in row}
    if len(cells) > _MOST_CELLS or layout_of(rows[:_SHOWN_LINES], dialect) is not None:
        return False
    words = [path.stem, *(line for line in lines if comment(line) is not None), *cells]
    return not (any(map(_speaks_of_spectra, words)) or _has_colours(cells) or _may_have_wavelengths(rows, dialect))


def _speaks_of_spectra(words: str) -> bool:
    checks = (quantity_in, is_wavelength_header, is_reciprocal_header, names_power, names_sensitivity, condition_in)
    return bool(_WORDS.search(words)) or any(says(words) for says in checks)


def _has_colours(cells: Iterable[str]) -> bool:
    """Return whether three headings are the axes of one colour space: that is a measurement, if of no spectrum."""
    axes = {axis for axis in map(colour_axis, cells) if axis is not None}
    return any(sum(space == name for name, _ in axes) == 3 for space in ("XYZ", "Lab"))


def _may_have_wavelengths(rows: Sequence[Row], dialect: Dialect) -> bool:
    if any(len(wavelengths_across(cells, dialect)) >= _FEW for _, cells in rows):
        return True
    if any(dialect.names_wavelength(cell) for _, cells in rows for cell in cells):
        return True
    down = [list(column) for column in zip(*(cells for _, cells in rows), strict=True)]
    # In a row with damaged marks, a cell holds a wavelength and its value.
    down += [[match[0] if (match := _LEADING.match(cell)) else "" for cell in column] for column in down[:2]]
    return any(len(wavelengths_across(cells, dialect)) >= _FEW for cells in down)
