"""Spectra in CGATS.17, IT8.7 and ArgyllCMS files: charts, lamps (.sp), displays (.ccss), readings (.ti3).

What was measured is told by the file's own words: `cgats_quantity` has the rules.

Values are divided by SPECTRAL_NORM where it stands. SPECTRAL_PCT is percent, SPECTRAL_DEC fractions; ArgyllCMS readings
(CTI3) without a norm are percent of the perfect diffuser. Elsewhere the values decide, with a note. A norm and names of
fields that say different things are refused, and so is what was only assumed where a stated colour says otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ..measurement import at_an_angle, is_condition
from .cgats_bands import BAND, bands, further_bands, grid_of, keyword_number, wavelength_pairs
from .cgats_quantity import StatedQuantity, check_agreement, said_quantity, signs_of_table
from .cgats_tables import CgatsTable, read_tables
from .import_options import NO_ANSWER, ImportOptions, Scale
from .registry import SpectralFile, StatedColour, names_its_file
from .shared.colour_words import (
    colour_axis,
    condition_in,
    illuminant_in,
    illuminants_in,
    observer_in,
    observers_in,
    stated_colours,
)
from .shared.decisions import (
    COLOURS_ALONE,
    Decision,
    Divisor,
    Sign,
    ValueRange,
    decided,
    divisor_of,
    scatter_alone,
    signs_of_all,
    undecided,
)
from .shared.entry_rules import MOST_SAMPLES, Gathering
from .shared.resemblance import Luminances, luminances
from .shared.text import head_text, is_missing, shortened
from .shared.words import OF_STATISTICS, statistics_among

NAME = "CGATS"
ASKS = True
SUFFIXES = (".txt", ".sp", ".cie", ".ti3", ".it8", ".ccss", ".cgats")

_IDENTIFIER = re.compile(r"\s*(?:CGATS|ISO ?28178|IT8|CTI[123]|CCSS|CCMX|SPECT\b|CMF\b|CAL\b|LGOROWLENGTH|MPP\b)", re.I)
_KEYWORD = re.compile(r"^\s*(?:BEGIN_DATA_FORMAT|BEGIN_DATA|NUMBER_OF_FIELDS|NUMBER_OF_SETS|KEYWORD\s+\")", re.M)
_MARKED = {"PCT": 100.0, "DEC": 1.0}
_SCALES: dict[float, Scale] = {100.0: "percent", 1.0: "fraction"}
_NAMES = ("SAMPLE_NAME", "PATCH_NAME", "SAMPLE_LOC", "SAMPLE_ID", "SAMPLEID", "SAMPLENAME", "ID", "NAME", "STRING")
_ILLUMINANT_KEYS = ("ILLUMINATION_NAME", "ILLUMINANT", "WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER")
_OBSERVER_KEYS = ("OBSERVER_ANGLE", "OBSERVER", "WEIGHTING_FUNCTION", "COMPUTATIONAL_PARAMETER", "MEASUREMENT_SOURCE")
_DETAILS = {
    "geometry": ("MEASUREMENT_GEOMETRY",),
    "instrument": ("INSTRUMENTATION", "TARGET_INSTRUMENT", "INSTRUMENT"),
    "filter": ("FILTER", "INSTRUMENT_FILTER", "FILTER_STATUS"),
    "backing": ("SAMPLE_BACKING", "BACKING"),
    "display": ("DISPLAY",),
    "units": ("UNITS", "SPECTRAL_UNITS"),
}
# Samples whose stated colours are looked at, and a value that percent of a black ink stay below.
_COMPARED, _DARKEST_PERCENT = 200, 1.5
# Times its norm that a fluorescent white stays below.
_ABOVE_NORM = 1.5
_CONDITION_KEYS = ("MEASUREMENT_SOURCE", "MEASUREMENT_CONDITION", "M_CONDITION", "FILTER", "DESCRIPTOR", "CONDITION")


def recognises(path: Path, head: bytes) -> bool:
    """Text that starts with the identifier of such a file, or holds its keywords."""
    text = head_text(head).replace("\r\n", "\n").replace("\r", "\n")
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return bool(_KEYWORD.search(text) or (_IDENTIFIER.match(first) and len(first.split()) <= 2))


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
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
        details |= {key: shortened(value, 200) for key, value in table.keywords.items() if not BAND.fullmatch(key)}
        for note in table.notes:
            gathering.note(note)
        if table.identifier.upper() == "CMF":
            without.append("colour-matching functions")
        elif not bands(table) and not wavelength_pairs(table):
            without.append(_holdings(table))
        else:
            _gather(table, gathering, path, "" if len(tables) == 1 else f"table {number}", answer)
    if without and len(without) == len(tables):
        raise InputError(
            "no spectra in this file",
            field="BEGIN_DATA_FORMAT",
            found="; ".join(without[:4]),
            expected="spectral fields such as SPECTRAL_NM380, SPEC_380 or nm380",
            hint=COLOURS_ALONE,
        )
    for held in without:
        gathering.note(f"a table without spectra is left out: {held}")
    return gathering.finish(details)


def _holdings(table: CgatsTable) -> str:
    kinds = sorted({field.upper().split("_")[0] for field in table.fields if "_" in field} - {"SAMPLE"})
    return f"{len(table.rows)} samples with {', '.join(kinds[:8]) or 'names'} and no spectra"


def _gather(table: CgatsTable, gathering: Gathering, path: Path, place: str, answer: ImportOptions) -> None:
    fields, points = bands(table), wavelength_pairs(table)
    if len(table.rows) * max(len(fields), len(points)) > MOST_SAMPLES:
        raise InputError("too many samples in one file", expected=f"at most {MOST_SAMPLES}")
    if fields:
        grid, order = grid_of(table, fields)
        values_at, marks = [fields[index].column for index in order], {band.scale for band in fields}
    else:
        grid, values_at, marks = None, [pair[1] for pair in points], {pair[2] for pair in points}
    values = np.array([[table.number(row[column]) for column in values_at] for row in table.rows])
    values = values.reshape(len(table.rows), len(values_at))
    grids = [np.array([table.number(row[pair[0]]) for pair in points]) if grid is None else grid for row in table.rows]
    common = _common(table, place)
    light, angle = illuminant_of(table), observer_of(table)
    several = [", ".join(names) for names in (illuminants_of(table), observers_of(table)) if len(names) > 1]
    if several and any(map(_is_colour, table.fields)):
        gathering.note(f"the file leaves open which of {' and '.join(several)} the colours beside the spectra are for")
    spectral = {band.column for band in fields} | {column for pair in points for column in pair[:2]}
    beside = [(column, field) for column, field in enumerate(table.fields) if column not in spectral]
    for row in further_bands(beside):
        gathering.note(f"fields {row[0][1]} to {row[-1][1]} are another spectrum of each sample, and left out")
        beside = [each for each in beside if each not in row]
    colours = [(column, field) for column, field in beside if _is_colour(field)]
    stated = [
        stated_colours({field: table.number(row[column]) for column, field in colours}, light, angle)
        for row in table.rows
    ]
    said = said_quantity(table, [band.quantity for band in fields])
    named = {field.upper(): column for column, field in reversed(beside)}
    order = [named[key] for key in _NAMES if key in named]
    names = [next((row[column] for column in order if row[column].strip()), "") for row in table.rows]
    try:
        decision, scale = _measured(table, said, marks, names, values, grids, stated, answer, path)
    except InputError as reason:
        gathering.rejected.append((place or path.stem, reason))
        return
    stated_of = [at for at, head in beside if OF_STATISTICS.search(head)]
    left_out = statistics_among(
        names, [[*table.keywords.values(), *(row[at] for at in stated_of)] for row in table.rows]
    )
    if left_out:
        called = ", ".join(dict.fromkeys(names[index] or f"set {index + 1}" for index in left_out[:6]))
        gathering.note(f"sets that are the scatter or the limits of others are left out: {called}")
    if len(left_out) == len(names) > 0:
        gathering.rejected.append((place or path.stem, scatter_alone(place or path.stem, "its keywords or its names")))
    for index, row in enumerate(table.rows):
        if index in left_out:
            continue
        name = names[index] or (path.stem if len(table.rows) == 1 else f"{path.stem} {index + 1}")
        wrong = next((row[at] for at in values_at if np.isnan(table.number(row[at])) and not is_missing(row[at])), None)
        if wrong is not None:
            refusal = InputError("not a number", field=name, found=repr(shortened(wrong, 40)))
            gathering.rejected.append((name, refusal))
            continue
        others = {field: shortened(row[column]) for column, field in beside if not _is_colour(field) and row[column]}
        details = others | common
        gathering.take(name, grids[index], values[index], decision, scale, stated=stated[index], details=details)


def _measured(
    table: CgatsTable,
    said: StatedQuantity,
    marks: set[str],
    names: Sequence[str],
    values: np.ndarray,
    grids: list[np.ndarray],
    stated: list[tuple[StatedColour, ...]],
    answer: ImportOptions,
    path: Path,
) -> tuple[Decision, Divisor]:
    """Decide what the values (N,L) of a table are, and what to divide them by.

    Raises
    ------
    InputError
        Nothing tells, or what does is at odds with the numbers, the colours beside, or the person.
    """
    finite = values[np.isfinite(values)]
    highest = float(finite.max()) if finite.size else 0.0
    norm = _norm(table, marks)
    few = slice(_COMPARED)

    def beside(divisor: float) -> Luminances:
        return luminances(grids[few], values[few] / divisor, stated[few])

    # The signs of the numbers, where all are on one grid.
    one_grid = bool(grids) and all(grid is grids[0] for grid in grids)
    numbers = signs_of_all(grids[0], values, "BEGIN_DATA") if one_grid else []
    if said.quantity is not None:
        signs = [Sign("words", said.quantity, said.words, True)]
    else:
        usual = norm or (100.0 if highest > 2.0 else 1.0)
        above = table.identifier.upper() == "SPECT" and norm is not None and highest / norm > _ABOVE_NORM
        condition = condition_in(" ".join(table.keywords.get(key, "") for key in _CONDITION_KEYS))
        signs = [*signs_of_table(table, said, condition, beside(usual), above, path), *numbers]
    decision = decided(signs, numbers, answer, None, "BEGIN_DATA")
    if decision is None:
        raise undecided(signs, None, len(values))
    # A file that says how surfaces were measured says reflectance, if not the word.
    worded = decision.stated or answer.quantity is None
    angled = decision.quantity == "reflectance" and any(map(at_an_angle, names))
    seen = ValueRange.of(finite, "radiance factor" if angled else decision.quantity, worded)
    scale = _divisor(table, decision, marks, norm, seen, answer)
    if norm and norm != 1.0:
        scale = scale._replace(note=f"values are divided by SPECTRAL_NORM, {norm:g}")
    dark = norm is None and scale.by == 100.0 and highest <= _DARKEST_PERCENT
    if decision.quantity != "emission" and (not decision.stated or dark):
        assumed = f"{decision.quantity} in {'percent' if scale.by == 100.0 else f'parts of {scale.by:g}'}"
        check_agreement(beside(scale.by).ratio, assumed)
    return decision, scale


def _is_colour(field: str) -> bool:
    return "_" in field and colour_axis(field) is not None


def _norm(table: CgatsTable, marks: set[str]) -> float | None:
    """Return the norm of the file, None where it has none; the names of fields may say it, too, and then the same."""
    norm = keyword_number(table, "SPECTRAL_NORM")
    if norm is not None and not norm > 0.0:
        raise InputError(
            "a norm that nothing can be divided by",
            field="SPECTRAL_NORM",
            found=f"{norm:g}",
            expected="a positive number, such as 100",
        )
    said = {_MARKED[mark] for mark in marks & set(_MARKED)}
    if norm is not None and said - {norm}:
        raise InputError(
            "two units in one table",
            field="SPECTRAL_NORM",
            found=f"{norm:g}, and fields named {' and '.join(f'SPECTRAL_{mark}' for mark in sorted(marks))}",
            expected="100 with SPECTRAL_PCT, 1 with SPECTRAL_DEC",
            hint="correct the one that is wrong",
        )
    return norm


def _divisor(
    table: CgatsTable,
    decision: Decision,
    marks: set[str],
    norm: float | None,
    values: ValueRange,
    answer: ImportOptions,
) -> Divisor:
    """Find the divisor to fractions: by the norm, else what the names of fields or the format say, else the values."""
    if decision.quantity == "emission":
        return Divisor(norm or 1.0, "fraction", "")
    if norm is not None:
        if norm not in _SCALES:
            return Divisor(norm, "fraction", f"SPECTRAL_NORM {norm:g}")
        return divisor_of(values, _SCALES[norm], "SPECTRAL_NORM", answer)
    if mark := next((mark for mark in _MARKED if mark in marks), None):
        return divisor_of(values, _SCALES[_MARKED[mark]], f"fields called SPECTRAL_{mark}", answer)
    by_argyll = table.keywords.get("DEVICE_CLASS", "").upper() in ("OUTPUT", "INPUT")
    if table.identifier.upper().startswith("CTI") and (by_argyll or values.highest > _DARKEST_PERCENT):
        note = "ArgyllCMS readings without SPECTRAL_NORM are percent and are divided by 100"
        return divisor_of(values, "percent", "the format", answer)._replace(note=note)
    return divisor_of(values, None, "", answer)


def _common(table: CgatsTable, place: str) -> dict[str, str]:
    """Return what the keywords say of every sample, under the names that all readers use."""
    found = {"table": place} if place else {}
    for name, keys in _DETAILS.items():
        if value := next((table.keywords[key] for key in keys if table.keywords.get(key)), ""):
            found[name] = shortened(value)
    if condition := condition_in(" ".join(table.keywords.get(key, "") for key in _CONDITION_KEYS)):
        found["condition"] = condition
    return conditions_of(table) | found


def conditions_of(table: CgatsTable) -> dict[str, str]:
    """Return the keywords that say how the samples of a table were measured."""
    stated = {key: shortened(value, 200) for key, value in table.keywords.items() if value and is_condition(key)}
    return stated | {"format": NAME}


def illuminants_of(table: CgatsTable) -> tuple[str, ...]:
    """Return the illuminants that XYZ and Lab may be for; a bare MEASUREMENT_SOURCE is the instrument's lamp."""
    source = table.keywords.get("MEASUREMENT_SOURCE", "")
    named = _of_keywords(table, _ILLUMINANT_KEYS, illuminants_in, illuminant_in)
    return named or (illuminants_in(source) if "=" in source else ())


def observers_of(table: CgatsTable) -> tuple[str, ...]:
    """Return the observers that XYZ and Lab may be for."""
    return _of_keywords(table, _OBSERVER_KEYS, observers_in, observer_in)


def illuminant_of(table: CgatsTable) -> str | None:
    """Return the illuminant that XYZ and Lab were computed for, None where none is stated, or several are."""
    found = illuminants_of(table)
    return found[0] if len(found) == 1 else None


def observer_of(table: CgatsTable) -> str | None:
    """Return the observer that XYZ and Lab were computed for, None where none is stated, or several are."""
    found = observers_of(table)
    return found[0] if len(found) == 1 else None


def _of_keywords(
    table: CgatsTable,
    keys: Sequence[str],
    all_in: Callable[[str], tuple[str, ...]],
    one_in: Callable[[str], str | None],
) -> tuple[str, ...]:
    parts = [part.strip() for key in keys for part in table.keywords.get(key, "").split(";")]
    found = [name for part in parts for name in all_in(part) or (one_in(part),)]
    return tuple(dict.fromkeys(name for name in found if name))
