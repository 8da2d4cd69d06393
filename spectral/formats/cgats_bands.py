"""Spectral fields of a CGATS table, and their wavelengths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...runtime.errors import InputError
from ..spectrum import Quantity
from .cgats_tables import CgatsTable
from .shared.text import shortened

BAND = re.compile(
    r"(?:SPECTRAL_(?P<scale>PCT|DEC)|SPECTRAL_?NM|SPECTRAL|SPECTRUM|SPEC|NM|R|LAMBDA|WL)[_ ]?"
    r"(?P<nm>\d{3,4}(?:[.,]\d+)?)(?:[_ ]?NM)?|(?P<plain>\d{3,4}(?:[.,]\d+)?)[_ ]?NM",
    re.I,
)
# Names that mean a wavelength where many of them go up through a spectrum together, and might mean anything alone.
_ROW = re.compile(r"(?P<word>%?[^\W\d_]*)[_ ]?(?P<nm>\d{3,4}(?:[.,]\d+)?)(?:[_ ]?NM)?", re.I)
_FURTHER = re.compile(r"(?P<word>.*?)[_ ]?(?P<nm>\d{3,4}(?:[.,]\d+)?)(?:[_ ]?NM)?", re.I)
_WORDS: dict[str, tuple[str, Quantity | None]] = {
    "": ("", None), "s": ("", None), "sp": ("", None), "λ": ("", None),
    "refl": ("", "reflectance"), "reflectance": ("", "reflectance"), "%r": ("PCT", "reflectance"),
    "trans": ("", "transmittance"), "transmittance": ("", "transmittance"), "%t": ("PCT", "transmittance"),
}  # fmt: skip
_FEWEST, _WIDEST_STEP_NM, _SPAN_NM = 8, 50.0, (200.0, 2600.0)
_PAIR_VALUE = ("SPECTRAL_PCT", "SPECTRAL_DEC")


class Band(NamedTuple):
    """A field that is named for a wavelength: its column, nm, "PCT", "DEC" or "", and the quantity that it names."""

    column: int
    nm: float
    scale: str
    quantity: Quantity | None = None


def bands(table: CgatsTable) -> list[Band]:
    """Return the fields that are named for a wavelength, none where fewer than two are."""
    found = []
    for column, field in enumerate(table.fields):
        if match := BAND.fullmatch(field):
            found.append(Band(column, _nm(match["nm"] or match["plain"]), (match["scale"] or "").upper()))
    return found if len(found) > 1 else _bands_in_a_row(table)


def _bands_in_a_row(table: CgatsTable) -> list[Band]:
    """Fields such as 380, S_380 or %R380, where they can be nothing else: many, alike, and in a spectrum's order."""
    alike: dict[str, list[Band]] = {}
    for column, field in enumerate(table.fields):
        match = _ROW.fullmatch(field)
        if match and (word := match["word"].casefold()) in _WORDS:
            alike.setdefault(word, []).append(Band(column, _nm(match["nm"]), *_WORDS[word]))
    rows = [row for row in alike.values() if len(row) >= _FEWEST]
    if len(rows) != 1 or len(rows) != len(alike):
        return []
    steps = np.diff([band.nm for band in rows[0]])
    steps = steps if steps[0] > 0 else -steps
    inside = all(_SPAN_NM[0] <= band.nm <= _SPAN_NM[1] for band in rows[0])
    return rows[0] if inside and (steps > 0).all() and (steps <= _WIDEST_STEP_NM).all() else []


def further_bands(beside: Sequence[tuple[int, str]]) -> list[list[tuple[int, str]]]:
    """Columns and names of further spectra among fields that are not taken for bands, such as T380 beside R380."""
    alike: dict[str, list[tuple[int, str]]] = {}
    for column, field in beside:
        if (match := _FURTHER.fullmatch(field)) and _SPAN_NM[0] <= _nm(match["nm"]) <= _SPAN_NM[1]:
            alike.setdefault(match["word"].casefold(), []).append((column, field))
    return [row for row in alike.values() if len(row) >= _FEWEST]


def _nm(text: str) -> float:
    return float(text.replace(",", "."))


def wavelength_pairs(table: CgatsTable) -> list[tuple[int, int, str]]:
    """Columns of wavelength and value, and "PCT" or "DEC", where wavelengths stand in the data."""
    upper = [field.upper() for field in table.fields]
    return [
        (column, column + 1, upper[column + 1][-3:])
        for column in range(len(upper) - 1)
        if upper[column] == "SPECTRAL_NM" and upper[column + 1] in _PAIR_VALUE
    ]


def grid_of(table: CgatsTable, found: list[Band]) -> tuple[np.ndarray, list[int]]:
    """Wavelengths (L,) ascending and the order of the bands.

    ArgyllCMS names a band for its wavelength rounded to a nanometre: SPECTRAL_BANDS, SPECTRAL_START_NM and
    SPECTRAL_END_NM say exactly where it is, as long as they agree with the names to that rounding.
    """
    order = sorted(range(len(found)), key=lambda index: found[index].nm)
    named = np.array([found[index].nm for index in order])
    count = keyword_number(table, "SPECTRAL_BANDS")
    if count is not None and count != len(found):
        raise InputError(
            "the data format has not the number of bands that the file states",
            field="SPECTRAL_BANDS",
            found=f"{len(found)} spectral fields",
            expected=f"{count:g}, as stated",
            hint="export the file again, or correct the count",
        )
    start, end = keyword_number(table, "SPECTRAL_START_NM"), keyword_number(table, "SPECTRAL_END_NM")
    if start is None or end is None or not start < end:
        return named, order
    exact = np.linspace(start, end, len(found))
    if (np.abs(exact - named) > 0.5 + 1e-6).any():
        raise InputError(
            "the file says two things of where its bands are",
            field="SPECTRAL_START_NM and SPECTRAL_END_NM",
            found=f"{start:g} to {end:g} nm, and fields named for {named[0]:g} to {named[-1]:g} nm",
            expected="the first and the last wavelength of the fields",
            hint="correct the ones that are wrong",
        )
    return exact, order


def keyword_number(table: CgatsTable, key: str) -> float | None:
    """Return the number that a keyword states, None where the file does not have it."""
    words = table.keywords.get(key)
    if words is None:
        return None
    value = table.number(words.strip())
    if np.isnan(value):
        raise InputError("not a number", field=key, found=shortened(words) or "nothing", expected="a number")
    return value
