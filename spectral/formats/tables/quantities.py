"""Quantities of the columns of a text table: each by its own heading, the lines above, and the signs of
`shared.decisions`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np

from ....runtime.errors import InputError
from ..import_options import ImportOptions
from ..shared.colour_words import colour_axis, illuminant_in
from ..shared.decisions import (
    NO_COUNTS,
    NO_SCATTER,
    Sign,
    decided,
    refuse_sensitivity,
    scatter_alone,
    signs_beside,
    signs_of_name,
    signs_of_numbers,
)
from ..shared.languages import spelt
from ..shared.resemblance import likenesses, luminances
from ..shared.text import shortened
from ..shared.words import (
    OF_STATISTICS,
    counts_in_lines,
    names_any_power,
    names_density,
    names_derived,
    names_identifier,
    names_only_light,
    names_power,
    names_raw,
    names_scatter,
    names_scatter_in_lines,
    names_sensitivity,
    other_scale_in,
    quantity_in,
    quantity_in_lines,
    quantity_of_set,
    statistics_among,
    unit_in,
)
from .axis import LIGHT_NM
from .rows import refuse_wavelengths
from .section import Column

_SURFACES = ("reflectance", "transmittance", "radiance factor")
_LETTER = re.compile(r"\s*[RT]\s*")
# Functions of a power, beside the words for one.
_OF_POWER = (
    r"radiance ?/ ?irradiance|"
    rf"deriv[ae]t|{spelt('derivative', 'difference')}|difference|differential|\bdelta\b|[Δ∆]|\bsqrt|√|"
    r"square root|\bsquared?\b|"
    # Weighted by an eye or a skin, summed up, or no power at all.
    r"\b(?:lm|lx|cd)\b.{0,12}(?:/ ?nm|nm ?(?:\^|\*\*)?[-−⁻]\s?[1¹])|spectral[ _](?:il)?lumin|luminous (?:flux|int)|"
    r"photopic|scotopic|melanopic|erythem|actinic|\beffective|\bweight(?:ed|ing)|[xyzv][ _-]?bar\b|V ?\((?:λ|lambda)\)|"
    r"cumulat|\bintegra(?:l|ted)\b|radiance temperature|coefficient|correction factor|\bratio\b|"
    r"\bdB(?:[mW]|(?![a-z]))|decibel|\b(?:log(?:_?10)?|ln)\b|\bd ?(?:ir)?radiance ?/ ?d"
)
#: Words of a line above a table that speaks of the scale of its values.
OF_SCALES = (
    r"unit|scal[ei]|\by.?factor|multip|\b(?:values?|data|numbers) (?:are |is )?(?:in|as|given|stated|expressed)\b"
)
# Quantities over wavelengths that no sample is called after, as a whole; and within the names of rows.
_OTHERS = re.compile(
    r"\W*(?:(?:spectral|total|diffuse|relative|internal) )*(?:haze|opacity|turbidity|contrast ratio|"
    r"absorpt(?:ion|ance|ivity)|emissivity|emittance|scattering|photopic|weighted|cumulative|integral|"
    r"band ?width|slit(?: width)?|exposure|quantum yield|"
    r"(?:correction|calibration|cal\.?)(?: factors?)?)\W*(?:[\[(].*)?",
    re.I,
)
_IN_NAMES = re.compile(r"(?<!\w)(?:K/S|F\(R\)|log ?\(? ?1 ?/ ?R|absorbance)(?!\w)", re.I)
_TITLE = re.compile(r"title|comments?|descript\w*|name|sample(?: ?name)?|material|product|object", re.I)
# Weights of ASTM E308, by which tristimulus values are summed: one of each of X, Y and Z.
_WEIGHT = re.compile(r"\W*W[ _]?(?:10|2)?[ _,]?([xyz])(?![A-Za-z])", re.I)
_WANTED = "reflectance, transmittance or emission"
# Largest sample of fractions of a surface that is not black: a light that was normalised has 1.
_DARKEST_OF_FRACTIONS, _NORMALISED = 0.01, 1.0
# Largest number without a percent sign that may be a fraction.
_PERHAPS_FRACTIONS = 2.0
# Largest whole number that an analogue-digital converter may give.
_COUNTED = 1000.0


def judge(
    columns: Sequence[Column], answer: ImportOptions, hints: Sequence[Sign], path: Path, may_be_counts: bool = False
) -> None:
    """Find what each column measures: its `decision`, or why there is none, and the `signs` of it.

    Parameters
    ----------
    hints : signs that the format adds.
    may_be_counts : whether the values may be an instrument's counts, of which nothing hints at what they measure.

    Raises
    ------
    InputError
        Three columns that may be samples, or the channels of a camera; one that may hold wavelengths.
    """
    stated = _stated(columns, answer, path)
    for column in columns:
        if column.place != (0, 0) and not (quantity_in(column.heading) or names_power(column.words)):
            _refuse_second_axis(column)
    _find_likenesses(columns)
    belied = _belied_by_colours(columns)
    table_of: dict[int, list[Column]] = {}
    for column in columns:
        table_of.setdefault(column.table, []).append(column)
    of_file = [*hints, *signs_of_name("file name", path.stem, "the file name")]
    # Beside what an instrument made of its readings, numbers above any percentage are those readings.
    of_surfaces = {
        column.table for column, sign in zip(columns, stated, strict=True) if sign and sign.says in _SURFACES
    }
    for column, sign_stated in zip(columns, stated, strict=True):
        try:
            _check(column, sign_stated, path)
            numbers = signs_of_numbers(column.grid_nm, column.samples, column.likeness)
            open_ = sign_stated is None or (sign_stated.says == "emission" and not sign_stated.states)
            signs = [sign_stated] if sign_stated else []
            if open_:
                signs += [*of_file, *_hints_around(column, path, column.table not in belied)]
            called, file = column.name.casefold(), path.stem.casefold()
            if open_ and not (called in file or file in called):
                signs += signs_of_name("names of spectra", column.name, "the name")
            # Counts of a lamp or of a paint have its names and its shape, too.
            published = column.likeness is not None and column.likeness.published
            counted = may_be_counts or (_may_be_counted(column) and not published)
            hints_count = sign_stated is not None or not counted
            own = [sign for sign in numbers if sign.origin != "range" or column.table not in of_surfaces]
            column.signs = ([*signs, *own] if open_ else signs) if hints_count else []
            decision = decided(column.signs, numbers, answer, column.name)
            if decision and decision.quantity != "emission":
                _check_sample(column, numbers, table_of[column.table])
            column.decision = decision
        except InputError as reason:
            column.refusal = reason


def _refuse_second_axis(column: Column) -> None:
    """Refuse a column whose values climb through the wavelengths of light in equal steps."""
    values = [value for value in column.values if value == value]
    if values and values[0] <= LIGHT_NM[1] and values[-1] >= LIGHT_NM[0]:
        refuse_wavelengths(values, column.name)


def _stated(columns: Sequence[Column], answer: ImportOptions, path: Path) -> list[Sign | None]:
    """Find what each column states of itself, else the lines above its table, else all headings of it together."""
    stated: list[Sign | None] = []
    for _, group in groupby(columns, key=lambda column: column.table):
        of_table = list(group)
        around, line = quantity_in_lines(of_table[0].around)
        heads = [column.words for column in of_table]
        together = quantity_of_set(heads, path.stem) if around is None else None
        if together == "colours":
            if answer.quantity is None:
                raise InputError(
                    "three samples, or the channels of a camera?",
                    field="header",
                    found=", ".join(heads),
                    expected="a word above them that says what was measured",
                    hint='write "reflectance" or "emission" on a line above the header, or say --as reflectance; '
                    "sensitivities are not imported",
                )
            together = None
        owned = [_own(column, heads) for column in of_table]
        weighed = [_WEIGHT.match(column.words) or _WEIGHT.match(column.name) for column in of_table]
        if len({match[1].casefold() for match in weighed if match}) == 3:
            owned = ["sensitivity" if match else own for match, own in zip(weighed, owned, strict=True)]
        if None in owned:  # beside samples that are called anything, a letter is a name, too
            owned = [None if _LETTER.fullmatch(head) else own for head, own in zip(heads, owned, strict=True)]
        silent = [column for column, own in zip(of_table, owned, strict=True) if own is None]
        # Large whole numbers are counted, whatever is called intensity.
        power = all(names_power(column.words or column.unit) and not _may_be_counted(column) for column in silent)
        perhaps = power and _may_be_fractions(silent)
        counted = counts_in_lines(of_table[0].around) if around is None else None
        scaled = next(filter(_has_other_scale, of_table[0].around.splitlines()), None)
        for column, own in zip(of_table, owned, strict=True):
            words = column.words if column.unit in column.words else column.heading
            heading = f"the heading {shortened(words.strip(), 60)!r}"
            if together:
                stated.append(Sign("heading", together, f"the headings {shortened(', '.join(heads), 60)!r}", True))
            elif scaled and (own or around) in _SURFACES and unit_in(column.heading) is None:
                stated.append(Sign("lines", "other scale", f"the line {shortened(scaled.strip(), 60)!r}", True))
            elif around == "perhaps absorbance" and not own:
                stated.append(Sign("lines", "absorbance", f"the line {shortened(line, 60)!r}"))
            elif around and not own:
                stated.append(Sign("lines", around, f"the line {shortened(line, 60)!r}", True))
            elif counted and not own:
                stated.append(Sign("lines", "counts", f"the line {shortened(counted, 60)!r}", True))
            else:
                says = own or ("emission" if power else None)
                stated.append(Sign("heading", says, heading, bool(own) or not perhaps) if says else None)
    return stated


def _has_other_scale(line: str) -> bool:
    """Return whether a line above a table says that its values are on a scale of their own."""
    about = quantity_in(line) in _SURFACES or re.search(OF_SCALES, line, re.I)
    return bool(about and other_scale_in(line))


def _may_be_fractions(columns: Sequence[Column]) -> bool:
    """Return whether columns below words such as "Intensity" may be what a surface sends back, as fractions of 1."""
    if not all(names_any_power(column.words or column.unit) for column in columns):
        return False
    largest = max((float(np.nanmax(column.samples, initial=0.0)) for column in columns), default=0.0)
    return _DARKEST_OF_FRACTIONS <= largest < _NORMALISED


def _may_be_counted(column: Column) -> bool:
    return bool(column.samples.max(initial=0.0) >= _COUNTED and _is_whole(column))


def _own(column: Column, heads: Sequence[str]) -> str | None:
    """Read a column's own heading and unit; `heads` : of all columns of its table."""
    if names_sensitivity(column.words):
        return "sensitivity"
    own = names_raw(column.heading) or quantity_in(column.heading)
    if _OTHERS.fullmatch(column.words) or (column.place == (0, 0) and _IN_NAMES.search(column.name)):
        return "other quantity"
    if re.search(_OF_POWER, column.heading, re.I) and (
        own == "emission" or (own is None and names_power(column.words))
    ):
        return "function of power"
    if own in (None, "reflectance", "transmittance") and names_derived(column.heading, heads):
        return "derived"
    if own in (*_SURFACES, "emission") and " " in column.words.strip() and names_scatter(column.words):
        return "scatter"
    of_values = column.heading.replace(column.axis_words, " ") if column.axis_words else column.heading
    if own in (None, *_SURFACES) and other_scale_in(of_values, power_alone=own is None):
        return "other scale"
    # "a.u." behind a word for power are arbitrary units.
    return None if own == "absorbance" and names_power(column.words) else own


def _belied_by_colours(columns: Sequence[Column]) -> set[int]:
    """Numbers of the tables whose L* beside are not those of their spectra as surfaces, neither as fractions nor as
    percent: a display has L*, too, against its own white.
    """
    tables: dict[int, list[Column]] = {}
    for column in columns:
        if column.bad is None:
            tables.setdefault(column.table, []).append(column)
    found = set()
    for number, rows in tables.items():
        labs = [tuple(colour for colour in row.colours if colour.space == "Lab") for row in rows]
        sign_stated = [
            luminances((row.grid_nm for row in rows), (row.samples / by for row in rows), labs) for by in (1.0, 100.0)
        ]
        if any(one.ratios for one in sign_stated) and not any(
            one.ratios and one.mostly_of_surfaces for one in sign_stated
        ):
            found.add(number)
    return found


def _hints_around(column: Column, path: Path, colours: bool) -> list[Sign]:
    """Find what the lines above hint at, such as a title; a chart and a lamp in them may both be true.

    colours : whether colours beside may be those of the spectrum.
    """
    found: list[Sign] = []
    for key, words in [*column.preamble.items(), *column.beside.items()]:
        if _TITLE.fullmatch(key):
            found += signs_beside(words, f"the {key.casefold()}", path)
    starred = {
        axis[1] for head in (*column.preamble, *column.beside) if (axis := colour_axis(head)) and axis[0] == "Lab"
    }
    if colours and len(starred) == 3:
        found.append(Sign("colours beside", "reflectance", "L*, a* and b* beside, as surfaces have"))
        named = " ".join((column.around, *column.preamble, *column.beside, *column.beside.values()))
        if light := illuminant_in(named):
            found.append(Sign("illuminant", "reflectance", f"the illuminant {light} that they are for"))
    return found


def _find_likenesses(columns: Sequence[Column]) -> None:
    """The published table that each column resembles, all on one grid at once."""
    groups: dict[bytes, list[Column]] = {}
    for column in columns:
        groups.setdefault(column.grid_nm.tobytes(), []).append(column)
    for alike in groups.values():
        values = np.array([column.samples for column in alike])
        for column, likeness in zip(alike, likenesses(alike[0].grid_nm, values), strict=True):
            column.likeness = likeness


def _check(column: Column, sign_stated: Sign | None, path: Path) -> None:
    """Refuse what is no spectrum of a colour, whatever anybody says of it."""
    refuse_sensitivity([column.likeness], column.name)
    called = (column.name, path.stem, *(words for key, words in column.preamble.items() if _TITLE.fullmatch(key)))
    if sign_stated is None and (density := next((words for words in called if names_density(words)), None)):
        sign_stated = Sign("names", "absorbance", f"the name {shortened(density, 40)!r}", True)
    if sign_stated and sign_stated.states and sign_stated.says in _REFUSED:
        problem, hint = _REFUSED[sign_stated.says]
        found = (sign_stated.origin != "lines" and (column.words or column.unit)) or sign_stated.words
        raise InputError(problem, field=column.name, found=found, expected=_WANTED, hint=hint)
    if column.bad is not None:
        line, cell = column.bad
        raise InputError(
            "not a number",
            field=f"{column.name}, line {line}",
            found=repr(shortened(cell, 40)),
            expected="a number, or an empty cell where there is none",
        )
    if column.in_percent and 0.0 < column.without_sign <= _PERHAPS_FRACTIONS:
        raise InputError(
            "percent beside fractions?",
            field=column.name,
            found=f"numbers with a percent sign, and others without one up to {column.without_sign:g}",
            expected="a percent sign behind each number of a spectrum, or behind none",
            hint="write all of its numbers in one way",
        )


def _check_sample(column: Column, numbers: Sequence[Sign], table: Sequence[Column]) -> None:
    """Refuse a spectrum of a surface that is called as a light is, or as identifiers are, and may be either.

    numbers : signs in its own numbers; `table` : all that stands in its table.
    """
    down = column.place != (0, 0)
    if down and quantity_in(column.heading):
        return  # says itself what it is of
    light = names_only_light(column.name) or (names_only_light(column.words) if down else None)
    if light == "perhaps" and all(sign.says != "emission" for sign in numbers):
        # "A" beside "D65" is no letter.
        light = "light" if any(names_only_light(other.name) == "light" for other in table) else None
    called = names_identifier(column.name)
    if called == "perhaps":
        numbered = _is_whole(column) and not all(map(_is_whole, table))
    else:
        numbered = bool(called) and (_is_whole(column) or len(table) > 1)
    if light or numbered:
        what = "light" if light else "number of samples or rows"
        raise InputError(
            f"a sample, or a {what}?",
            field=column.name,
            found=" and ".join(("its name", *(sign.words for sign in numbers if light))),
            expected="samples, called as no light and no identifier is",
            hint=f"where it is a sample, call it so: 'sample {shortened(column.name, 40)}'; where it is a {what}, "
            + ("save it as a file of its own, or remove it" if light else "remove it"),
        )


def identifiers_removed(columns: list[Column]) -> tuple[list[Column], list[str]]:
    """Columns less those of identifiers, and the names of these, where there are others.

    Whole numbers that are called so are; where samples may be called so, too, those beside fractions that do not change
    or that count.
    """
    of_fractions = {column.table for column in columns if not _is_whole(column)}
    left_out = [at for at, column in enumerate(columns) if _are_identifiers(column, column.table in of_fractions)]
    if len(left_out) == len(columns):
        return columns, []
    return [column for at, column in enumerate(columns) if at not in left_out], [columns[at].name for at in left_out]


def scatter_removed(columns: list[Column]) -> tuple[list[Column], list[str]]:
    """Columns less those that are called as a scatter, a difference or a weight is, and their names, where there are
    others. "Std" is the standard, where nothing is called a mean.
    """
    if columns and all(names_scatter_in_lines([column.around]) for column in columns):
        raise scatter_alone(columns[0].name, "the lines above")
    left_out = statistics_among(
        [column.name for column in columns],
        [
            [column.around, *(said for head, said in column.beside.items() if OF_STATISTICS.search(head))]
            for column in columns
        ],
    )
    kept = [column for at, column in enumerate(columns) if at not in left_out]
    return kept, [shortened(columns[at].name, 200) for at in left_out]


def _are_identifiers(column: Column, beside_fractions: bool) -> bool:
    called = column.place != (0, 0) and not quantity_in(column.heading) and names_identifier(column.name)
    numbers = column.samples[np.isfinite(column.samples)]
    if not called or numbers.size < 2 or not _is_whole(column):
        return False
    steps = np.diff(numbers)
    # A white is the same throughout, too.
    counts = not np.ptp(steps) and (steps[0] != 0.0 or numbers[0] not in (0.0, 1.0, 100.0))
    return called == "identifier" or (beside_fractions and bool(counts))


def _is_whole(column: Column) -> bool:
    return not (column.samples[np.isfinite(column.samples)] % 1.0).any()


_REFUSED = {
    "scatter": NO_SCATTER,
    "absorbance": (
        "absorbance is neither reflectance nor transmittance",
        "export %R or %T: instruments show absorbance, K/S or log(1/R) as another mode of the same scan",
    ),
    "derived": (
        "a function of a reflectance or a transmittance is neither",
        "export the reflectance or the transmittance itself, in percent or as fractions",
    ),
    "other quantity": (
        "another quantity than the spectrum of a colour",
        "export reflectance, transmittance or emission; where it is the name of a sample, call it otherwise",
    ),
    "function of power": (
        "a function of a power is none",
        "export the power itself, such as W/m2/nm, and no logarithm, difference or derivative of it",
    ),
    "other scale": (
        "a scale that is neither to 1 nor to 100",
        "divide the values so that a perfect white has 1 or 100, and call them reflectance or reflectance (%)",
    ),
    "sensitivity": (
        "a sensitivity is not the spectrum of a colour",
        "colour-matching functions, cone fundamentals and responses of sensors are not imported",
    ),
    "index": (
        "a refractive index is not the spectrum of a colour",
        "describe the material with tables of n and k instead",
    ),
    "counts": (
        "raw counts are neither power nor reflectance",
        NO_COUNTS,
    ),
    "photons": (
        "photons are not power",
        "export power per nm (W); or divide each value by its wavelength, and call it relative power",
    ),
}


def counts_removed(columns: list[Column]) -> list[Column]:
    """Columns less those in counts, where there are others."""
    return [column for column in columns if names_raw(column.heading) != "counts"] or columns
