"""Spectra in CGATS.17, IT8.7 and ArgyllCMS files: charts, lamps (.sp), displays (.ccss), readings (.ti3).

What was measured, by the file's own words, the first that speaks:

1. MEAS_TYPE or MEASUREMENT_TYPE: emission, ambient and flash; reflective; transmissive.
2. DEVICE_CLASS: DISPLAY and EMISINPUT are emission, OUTPUT and INPUT reflectance.
3. a .ccss, or the keywords DISPLAY, TECHNOLOGY or LUMINANCE_XYZ_CDM2: emission.
4. the words of DESCRIPTOR and TARGET_TYPE.
5. nothing, which a note says: a SPECT file with values above its norm is emission, the rest reflectance.

Values are divided by SPECTRAL_NORM where it stands. SPECTRAL_PCT is percent, SPECTRAL_DEC fractions; ArgyllCMS readings
(CTI3) without a norm are percent of the perfect diffuser. Elsewhere the values decide, with a note. A norm and names of
fields that say different things are refused.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..spectrum import Quantity
from .cgats_tables import CgatsTable, read_tables
from .reading import SpectralFile
from .shared.gathering import MOST_SAMPLES, Gathering, reflective_divisor
from .shared.text import head_text, is_missing, shortened
from .shared.words import (
    colour_axis,
    condition_in,
    illuminant_in,
    measured,
    names_light,
    observer_in,
    quantity_in,
    stated_colours,
)

NAME = "CGATS"
SUFFIXES = (".txt", ".sp", ".cie", ".ti3", ".it8", ".ccss", ".cgats")

_IDENTIFIER = re.compile(r"\s*(?:CGATS|ISO ?28178|IT8|CTI[123]|CCSS|CCMX|SPECT\b|CMF\b|CAL\b|LGOROWLENGTH|MPP\b)", re.I)
_KEYWORD = re.compile(r"^\s*(?:BEGIN_DATA_FORMAT|BEGIN_DATA|NUMBER_OF_FIELDS|NUMBER_OF_SETS|KEYWORD\s+\")", re.M)
_BAND = re.compile(
    r"(?:SPECTRAL_(?P<scale>PCT|DEC)|SPECTRAL_?NM|SPECTRAL|SPECTRUM|SPEC|NM|R|LAMBDA|WL)[_ ]?"
    r"(?P<nm>\d{3,4}(?:[.,]\d+)?)(?:[_ ]?NM)?|(?P<plain>\d{3,4}(?:[.,]\d+)?)[_ ]?NM",
    re.I,
)
_MARKED = {"PCT": 100.0, "DEC": 1.0}
_PAIR_VALUE = {"SPECTRAL_PCT": "percent", "SPECTRAL_DEC": "fraction"}
_MEASURED: tuple[tuple[str, Quantity], ...] = (
    ("EMIS|AMBIENT|FLASH|DISPLAY|PROJECTOR", "emission"),
    ("TRANSM", "transmittance"),
    ("REFLECT|REMISS", "reflectance"),
)
_NAMES = ("SAMPLE_NAME", "PATCH_NAME", "SAMPLE_LOC", "SAMPLE_ID", "SAMPLEID", "SAMPLENAME", "ID", "NAME", "STRING")
_ILLUMINANT_KEYS = ("ILLUMINATION_NAME", "ILLUMINANT", "WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER")
_OBSERVER_KEYS = ("OBSERVER_ANGLE", "OBSERVER", "WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER", "MEASUREMENT_SOURCE")
_DETAILS = {
    "geometry": ("MEASUREMENT_GEOMETRY",),
    "instrument": ("INSTRUMENTATION", "TARGET_INSTRUMENT", "INSTRUMENT"),
    "filter": ("FILTER", "INSTRUMENT_FILTER", "FILTER_STATUS"),
    "backing": ("SAMPLE_BACKING",),
    "display": ("DISPLAY",),
}
_CONDITION_KEYS = ("MEASUREMENT_SOURCE", "MEASUREMENT_CONDITION", "M_CONDITION", "FILTER", "DESCRIPTOR", "CONDITION")


def recognises(path: Path, head: bytes) -> bool:
    """Text that starts with the identifier of such a file, or holds its keywords."""
    text = head_text(head)
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return bool(_KEYWORD.search(text) or (_IDENTIFIER.match(first) and len(first.split()) <= 2))


def read(path: Path) -> SpectralFile:
    """Read every spectrum of every table, with the XYZ and Lab beside it.

    Raises
    ------
    InputError
        Tables that do not fit what they state, or that hold no spectra; the message says what they hold.
    """
    gathering = Gathering(path, NAME)
    details: dict[str, str] = {}
    without: list[str] = []
    tables = read_tables(path)
    for number, table in enumerate(tables, 1):
        details |= {key: shortened(value, 200) for key, value in table.keywords.items() if not _BAND.fullmatch(key)}
        for note in table.notes:
            gathering.note(note)
        if table.identifier.upper() == "CMF":
            without.append("colour-matching functions")
        elif not _bands(table) and not _pairs(table):
            without.append(_holdings(table))
        else:
            _gather(table, gathering, path, "" if len(tables) == 1 else f"table {number}")
    if without and len(without) == len(tables):
        raise InputError(
            "no spectra in this file",
            file=path,
            field="BEGIN_DATA_FORMAT",
            found="; ".join(without[:4]),
            expected="spectral fields such as SPECTRAL_NM380, SPEC_380 or nm380",
            hint="export the measurement with its spectra: a colour alone does not tell how it looks in another light",
        )
    for held in without:
        gathering.note(f"a table without spectra is left out: {held}")
    return gathering.finish(details)


def _bands(table: CgatsTable) -> list[tuple[int, float, str]]:
    """Column, wavelength in nm and "PCT", "DEC" or "" of each field that is named for a wavelength."""
    found = []
    for column, field in enumerate(table.fields):
        if match := _BAND.fullmatch(field):
            nm = float((match["nm"] or match["plain"]).replace(",", "."))
            found.append((column, nm, (match["scale"] or "").upper()))
    return found if len(found) > 1 else []


def _pairs(table: CgatsTable) -> list[tuple[int, int, str]]:
    """Columns of wavelength and value, and "PCT" or "DEC", where wavelengths stand in the data."""
    upper = [field.upper() for field in table.fields]
    return [
        (column, column + 1, upper[column + 1][-3:])
        for column in range(len(upper) - 1)
        if upper[column] == "SPECTRAL_NM" and upper[column + 1] in _PAIR_VALUE
    ]


def _holdings(table: CgatsTable) -> str:
    kinds = sorted({field.upper().split("_")[0] for field in table.fields if "_" in field} - {"SAMPLE"})
    return f"{len(table.rows)} samples with {', '.join(kinds[:8]) or 'names'} and no spectra"


def _gather(table: CgatsTable, gathering: Gathering, path: Path, place: str) -> None:
    bands, pairs = _bands(table), _pairs(table)
    if len(table.rows) * max(len(bands), len(pairs)) > MOST_SAMPLES:
        raise InputError("too many samples in one file", file=path, expected=f"at most {MOST_SAMPLES}")
    if bands:
        grid, order = _grid(table, bands, gathering, path)
        values_at, marks = [bands[index][0] for index in order], {band[2] for band in bands}
    else:
        grid, values_at, marks = None, [pair[1] for pair in pairs], {pair[2] for pair in pairs}
    values = np.array([[table.number(row[column]) for column in values_at] for row in table.rows])
    values = values.reshape(len(table.rows), len(values_at))
    finite = values[np.isfinite(values)]
    lowest, highest = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    norm = _norm(table, marks, path)
    quantity = _quantity(table, highest / (norm or 1.0), gathering)
    divisor = norm or _divisor(table, quantity, marks, lowest, highest, gathering, path)
    if norm and norm != 1.0:
        gathering.note(f"values are divided by SPECTRAL_NORM, {norm:g}")
    common = _common(table, place)
    light, angle = _illuminant(table), _observer(table)
    spectral = {column for column, *_ in bands} | {column for pair in pairs for column in pair[:2]}
    beside = [(column, field) for column, field in enumerate(table.fields) if column not in spectral]
    named = {field.upper(): column for column, field in reversed(beside)}
    order = [named[key] for key in _NAMES if key in named]
    for index, row in enumerate(table.rows):
        name = next((row[column] for column in order if row[column].strip()), "")
        name = name or (path.stem if len(table.rows) == 1 else f"{path.stem} {index + 1}")
        wrong = next((row[at] for at in values_at if np.isnan(table.number(row[at])) and not is_missing(row[at])), None)
        if wrong is not None:
            refusal = InputError("not a number", file=path, field=name, found=repr(shortened(wrong, 40)))
            gathering.rejected.append((name, refusal))
            continue
        colours = {field: table.number(row[column]) for column, field in beside if _is_colour(field)}
        others = {field: shortened(row[column]) for column, field in beside if not _is_colour(field) and row[column]}
        own = grid if grid is not None else np.array([table.number(row[pair[0]]) for pair in pairs])
        stated = stated_colours(colours, light, angle)
        gathering.add(name, own, values[index], quantity, divisor=divisor, stated=stated, details={**others, **common})


def _is_colour(field: str) -> bool:
    return "_" in field and colour_axis(field) is not None


def _grid(
    table: CgatsTable, bands: list[tuple[int, float, str]], gathering: Gathering, path: Path
) -> tuple[np.ndarray, list[int]]:
    """Wavelengths (L,) ascending and the order of the bands.

    ArgyllCMS names a band for its wavelength rounded to a nanometre: SPECTRAL_BANDS, SPECTRAL_START_NM and
    SPECTRAL_END_NM say exactly where it is, as long as they agree with the names to that rounding.
    """
    order = sorted(range(len(bands)), key=lambda index: bands[index][1])
    named = np.array([bands[index][1] for index in order])
    count = _keyword_number(table, "SPECTRAL_BANDS", path)
    if count is not None and count != len(bands):
        raise InputError(
            "the data format has not the number of bands that the file states",
            file=path,
            field="SPECTRAL_BANDS",
            found=f"{len(bands)} spectral fields",
            expected=f"{count:g}, as stated",
            hint="export the file again, or correct the count",
        )
    start, end = _keyword_number(table, "SPECTRAL_START_NM", path), _keyword_number(table, "SPECTRAL_END_NM", path)
    if start is None or end is None or not start < end:
        return named, order
    exact = np.linspace(start, end, len(bands))
    if (np.abs(exact - named) > 0.5 + 1e-6).any():
        gathering.note("SPECTRAL_START_NM and SPECTRAL_END_NM do not agree with the names of the bands, which are used")
        return named, order
    return exact, order


def _keyword_number(table: CgatsTable, key: str, path: Path) -> float | None:
    """The number that a keyword states, None where the file does not have it."""
    words = table.keywords.get(key)
    if words is None:
        return None
    value = table.number(words.strip())
    if np.isnan(value):
        raise InputError("not a number", file=path, field=key, found=shortened(words) or "nothing", expected="a number")
    return value


def _norm(table: CgatsTable, marks: set[str], path: Path) -> float | None:
    """What the file divides by, None where it does not say; the names of fields may say it, too, and then the same."""
    norm = _keyword_number(table, "SPECTRAL_NORM", path)
    if norm is not None and not norm > 0.0:
        raise InputError(
            "a norm that nothing can be divided by",
            file=path,
            field="SPECTRAL_NORM",
            found=f"{norm:g}",
            expected="a positive number, such as 100",
        )
    said = {_MARKED[mark] for mark in marks & set(_MARKED)}
    if norm is not None and said - {norm}:
        raise InputError(
            "two units in one table",
            file=path,
            field="SPECTRAL_NORM",
            found=f"{norm:g}, and fields named {' and '.join(f'SPECTRAL_{mark}' for mark in sorted(marks))}",
            expected="100 with SPECTRAL_PCT, 1 with SPECTRAL_DEC",
            hint="correct the one that is wrong",
        )
    return norm


def _quantity(table: CgatsTable, highest: float, gathering: Gathering) -> Quantity:
    """What was measured, by the rule at the head of this module; `highest` is relative to the norm."""
    keywords, identifier = table.keywords, table.identifier.upper()
    for key in ("MEAS_TYPE", "MEASUREMENT_TYPE"):
        for pattern, quantity in _MEASURED:
            if re.search(pattern, keywords.get(key, ""), re.I):
                return quantity
    device = keywords.get("DEVICE_CLASS", "").upper()
    if device in ("DISPLAY", "EMISINPUT") or identifier.startswith("CCSS"):
        return "emission"
    if device in ("OUTPUT", "INPUT"):
        return "reflectance"
    if {"DISPLAY", "TECHNOLOGY", "LUMINANCE_XYZ_CDM2"} & set(keywords):
        return "emission"
    words = f"{keywords.get('DESCRIPTOR', '')} {keywords.get('TARGET_TYPE', '')}"
    # ArgyllCMS calls its own files "Spectral power/reflectance information", whichever they are.
    told = measured(quantity_in(words)) or ("emission" if names_light(words) else None)
    if told is not None and "power/reflectance" not in words:
        return told
    if identifier == "SPECT" and highest > 1.0 + 1e-9:
        gathering.note("the file does not say what was measured; values above its norm are taken as emission")
        return "emission"
    gathering.note("the file does not say what was measured; taken as reflectance")
    return "reflectance"


def _divisor(
    table: CgatsTable,
    quantity: Quantity,
    marks: set[str],
    lowest: float,
    highest: float,
    gathering: Gathering,
    path: Path,
) -> float:
    """What to divide by for fractions where no norm is stated."""
    if quantity == "emission":
        return 1.0
    if "PCT" in marks or "DEC" in marks:
        divisor, note = reflective_divisor(lowest, highest, "percent" if "PCT" in marks else "fraction", path)
    elif table.identifier.upper().startswith("CTI") and highest > 1.5:
        divisor, note = 100.0, "ArgyllCMS readings without SPECTRAL_NORM are percent and are divided by 100"
    else:
        divisor, note = reflective_divisor(lowest, highest, None, path)
    if note:
        gathering.note(note)
    return divisor


def _common(table: CgatsTable, place: str) -> dict[str, str]:
    """What the keywords say of every sample, under the names that all readers use."""
    found = {"table": place} if place else {}
    for name, keys in _DETAILS.items():
        if value := next((table.keywords[key] for key in keys if table.keywords.get(key)), ""):
            found[name] = shortened(value)
    if condition := condition_in(" ".join(table.keywords.get(key, "") for key in _CONDITION_KEYS)):
        found["condition"] = condition
    return found


def _illuminant(table: CgatsTable) -> str | None:
    """The illuminant that XYZ and Lab were computed for; a bare MEASUREMENT_SOURCE is the instrument's lamp."""
    named = (illuminant_in(table.keywords.get(key, "")) for key in _ILLUMINANT_KEYS)
    source = table.keywords.get("MEASUREMENT_SOURCE", "")
    return next((light for light in named if light), illuminant_in(source) if "=" in source else None)


def _observer(table: CgatsTable) -> str | None:
    return next((found for key in _OBSERVER_KEYS if (found := observer_in(table.keywords.get(key, "")))), None)
