"""Text that light meters and spectrometers export: keys and values, then a wavelength and a value a line.

UPRtek and Sekonic meters write each wavelength with its unit ("380nm", "Spectral Data 380[nm]"), Ocean Optics puts a
marker before the numbers. Keys such as CCT, LUX or Tristimulus Value X stay in the details; X, Y and Z are kept as
stated tristimulus values.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, names_its_file
from .shared.decisions import Sign
from .shared.text import head_text, is_jcamp
from .tables.dialect import dialect_of
from .tables.entries import table_entries
from .tables.parsing import TextTable, parse_table

NAME = "instrument text"
ASKS = True
SUFFIXES = (".txt", ".xls", ".csv")

_MARKER = re.compile(r"^[>\s]*Begin (?:Processed )?Spectral Data", re.I | re.M)
_LIGHT_METER = re.compile(r"^\W*(?:CCT|Tcp|LUX|fc|Illuminance|Duv|CRI|LambdaP)\b", re.I | re.M)
_KEY = re.compile(
    r"^\W*(?:CCT|Tcp|LUX|fc|Illuminance|Duv|CRI|LambdaP|Viewing Angle|Tristimulus|Peak Wavelength|I-?Time|"
    r"Integration time)\b",
    re.I | re.M,
)


def recognises(path: Path, head: bytes) -> bool:
    """Text with a marker before its spectrum, or with keys of a light meter and wavelengths that carry their unit."""
    text = head_text(head)
    if not text or "BEGIN_DATA" in text or is_jcamp(text):
        return False
    if _MARKER.search(text):
        return True
    if not _KEY.search(text):
        return False
    lines = [line for line in text.splitlines() if line.strip()]
    dialect = dialect_of(lines)
    first = [dialect.wavelength(cells[0]) for line in lines if (cells := dialect.cells(line))]
    return sum(bool(found and found[1] and 100.0 <= found[0] <= 20_000.0) for found in first) >= 3


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read the spectrum of an instrument's report: emission where it has the keys of a light meter.

    A report that lists one spectrum at two steps keeps the finer.

    Raises
    ------
    InputError
        No wavelengths with values, or values that the quantity cannot take.
    """
    table = _finest(parse_table(path, answer))
    # A spectrometer's program writes counts in the same layout as what it makes of them.
    may_be_counts = _MARKER.search(table.words) is not None
    key = _LIGHT_METER.search(table.words)
    said = f"the key {key[0].strip()!r} of a light meter" if key else ""
    hints = [Sign("format", "emission", said, True)] if key else []
    return table_entries(table, path, NAME, answer, hints, may_be_counts)


def _finest(table: TextTable) -> TextTable:
    """Return the table with the block of most samples alone, where its blocks are the same range at several steps."""
    blocks = [block for block in table.blocks if block]
    if len(blocks) < 2 or any(len(block) != 1 for block in blocks):
        return table
    columns = [block[0] for block in blocks]
    ends = {(min(column.wavelengths), max(column.wavelengths)) for column in columns}
    sizes = [len(column.wavelengths) for column in columns]
    if len(ends) > 1 or len(set(sizes)) < len(sizes):
        return table
    finest = columns[sizes.index(max(sizes))]
    note = f"the report lists the spectrum at {len(columns)} steps; the finest, of {max(sizes)} samples, is read"
    return replace(table, blocks=[[finest]], notes=[*table.notes, note])
