"""Spectral power in two columns (`.spd`), and the glazing files of LBNL's Optics: wavelength, T, R front, R back."""

from __future__ import annotations

import re
from pathlib import Path

from ...runtime.errors import InputError
from .import_options import NO_ANSWER, ImportOptions
from .registry import HEAD, SpectralFile, names_its_file
from .shared.decisions import Sign
from .shared.text import head_text, is_jcamp
from .tables.entries import table_entries
from .tables.parsing import parse_table

NAME = "SPD"
ASKS = True
SUFFIXES = (".spd", ".usr", ".opt")

_GLAZING = re.compile(r"^\s*\{\s*Units,?\s*Wavelength Units\s*\}", re.I)
_PRODUCT = re.compile(r"\{\s*Product Name:\s*([^}]*?)\s*\}", re.I)
# Suffixes of the two parts of a refractive index in renderers' files.
_INDEX = re.compile(r"[.-](?:eta|k)\.spd$", re.I)
_SIDES = (("transmittance", "T"), ("reflectance", "R front"), ("reflectance", "R back"))


def recognises(path: Path, head: bytes) -> bool:
    """Return a glazing header, or a text of numbers that is named .spd."""
    text = head_text(head)
    if _GLAZING.match(text):
        return True
    if path.suffix.casefold() != ".spd" or is_jcamp(text):
        return False
    return bool(re.search(r"\d", text)) and text.lstrip()[:1] not in ("<", "{")


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read the columns of a text, or the three spectra of a glazing.

    The suffix is a hint at spectral power, of which the name of the file is the origin: renderers call reflectances so,
    too.

    Raises
    ------
    InputError
        No columns of wavelengths and values, or a refractive index.
    """
    if _INDEX.search(path.name):
        raise InputError(
            "a refractive index is not the spectrum of a colour",
            expected="spectral power, reflectance or transmittance",
            hint="describe the conductor with tables of n and k instead",
        )
    table = parse_table(path, answer)
    with path.open("rb") as file:
        head = head_text(file.read(HEAD))
    columns = table.blocks[0] if table.blocks else []
    if _GLAZING.match(head) and len(columns) == len(_SIDES):
        product = _PRODUCT.search(head)
        for column, (quantity, side) in zip(columns, _SIDES, strict=True):
            column.words, column.name = quantity, f"{product[1] if product else path.stem} {side}"
    hints = [Sign("file name", "emission", "the suffix .spd")] if path.suffix.casefold() == ".spd" else []
    return table_entries(table, path, NAME, answer, hints)
