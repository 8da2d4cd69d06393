"""What each column of a text table measures: its own heading, the lines above, and the signs of `shared.signs`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..answer import Answer
from ..reading import StatedColour
from ..shared.luminance import luminances
from ..shared.resemblance import Likeness, likenesses
from ..shared.signs import (
    Decision,
    Sign,
    contradicted,
    decided,
    is_sensitivity,
    not_a_colour,
    signs_beside,
    signs_of_name,
    signs_of_numbers,
    speaks_against,
)
from ..shared.text import shortened
from ..shared.words import (
    colour_axis,
    illuminant_in,
    measured,
    names_power,
    names_raw,
    names_sensitivity,
    quantity_in,
    quantity_in_lines,
    quantity_of_set,
)
from .column import Column

_LETTER = re.compile(r"\s*[RT]\s*")
_TITLE = re.compile(r"title|comments?|descript\w*|name|sample(?: ?name)?|material|product|object", re.I)
_WANTED = "reflectance, transmittance or emission"


@dataclass(frozen=True, eq=False)
class Judged:
    """What was found of one column.

    Parameters
    ----------
    decision : what it measures; None where it is refused, or nothing tells.
    refusal : why it is refused, whatever anybody says; None where it is not.
    signs : every sign that was seen, for the refusal of what nothing tells.
    likeness : the published table whose numbers it has.
    """

    decision: Decision | None
    refusal: InputError | None
    signs: tuple[Sign, ...]
    likeness: Likeness | None = None


def judged(
    columns: Sequence[Column],
    grids: Sequence[np.ndarray],
    beside: Sequence[tuple[StatedColour, ...]],
    answer: Answer,
    hints: Sequence[Sign],
    path: Path,
) -> list[Judged]:
    """What each column measures.

    Parameters
    ----------
    grids : (L,) of each column, nm.
    beside : the colours that are stated beside each column.
    hints : signs that the format adds.

    Raises
    ------
    InputError
        Three columns that may be samples, or the channels of a camera.
    """
    stated = _stated(columns, answer, path)
    alike = _likenesses(columns, grids)
    belied = _belied_by_colours(columns, grids, beside)
    of_file = [*hints, *signs_of_name("file name", path.stem, "the file name")]
    found = []
    for column, told, grid, likeness in zip(columns, stated, grids, alike, strict=True):
        refusal = _refusal(column, told, likeness, path)
        if refusal is not None:
            found.append(Judged(None, refusal, ()))
            continue
        signs = [told] if told else [*of_file, *_hints_around(column, path, column.table not in belied)]
        called, file = column.name.casefold(), path.stem.casefold()
        if not (told or called in file or file in called):
            signs += signs_of_name("names of spectra", column.name, "the name")
        numbers = signs_of_numbers(grid, np.asarray(column.values, dtype=np.float64), likeness)
        signs += [] if told else numbers
        try:
            decision = decided(signs, answer, path, column.name)
            if decision is not None and speaks_against(decision, numbers):
                raise contradicted(decision, numbers, path, column.name)
        except InputError as reason:
            found.append(Judged(None, reason, tuple(signs), likeness))
            continue
        found.append(Judged(decision, None, tuple(signs), likeness))
    return found


def _stated(columns: Sequence[Column], answer: Answer, path: Path) -> list[Sign | None]:
    """What each column states of itself, else the lines above its table, else all headings of it together."""
    stated: list[Sign | None] = []
    for _, group in groupby(columns, key=lambda column: column.table):
        of_table = list(group)
        around, line = quantity_in_lines(of_table[0].around)
        heads = [column.words for column in of_table]
        together = quantity_of_set(heads, path.stem) if around is None else None
        if together == "colours" and answer.quantity is None:
            raise InputError(
                "three samples, or the channels of a camera?",
                file=path,
                field="header",
                found=", ".join(heads),
                expected="a word above them that says what was measured",
                hint='write "reflectance" or "emission" on a line above the header, or say --as reflectance; '
                "sensitivities are not imported",
            )
        together = None if together == "colours" else together
        bare = [_own(column) for column in of_table]
        if None in bare:  # beside samples that are called anything, a letter is a name, too
            bare = [
                None if _LETTER.fullmatch(column.words) else own for column, own in zip(of_table, bare, strict=True)
            ]
        silent = [column for column, own in zip(of_table, bare, strict=True) if own is None]
        power = bool(silent) and all(names_power(column.words or column.unit) for column in silent)
        for column, own in zip(of_table, bare, strict=True):
            words = column.words if column.unit in column.words else f"{column.words} {column.unit}"
            heading = f"the heading {shortened(words.strip(), 60)!r}"
            if together:
                stated.append(Sign("heading", together, f"the headings {shortened(', '.join(heads), 60)!r}", True))
            elif own:
                stated.append(Sign("heading", own, heading, True))
            elif around:
                stated.append(Sign("lines", around, f"the line {shortened(line, 60)!r}", True))
            else:
                stated.append(Sign("heading", "emission", heading, True) if power else None)
    return stated


def _own(column: Column) -> str | None:
    """What a column's own heading and unit say."""
    if names_sensitivity(column.words):
        return "sensitivity"
    heading = f"{column.words} {column.unit}"
    if raw := names_raw(heading):
        return raw
    own = quantity_in(heading)
    # "a.u." behind a word for power are arbitrary units.
    return None if own == "absorbance" and names_power(column.words) else own


def _belied_by_colours(
    columns: Sequence[Column], grids: Sequence[np.ndarray], beside: Sequence[tuple[StatedColour, ...]]
) -> set[int]:
    """Numbers of the tables whose L* beside are not those of their spectra as surfaces, neither as fractions nor as
    percent: a display has L*, too, against its own white.
    """
    tables: dict[int, list[tuple[np.ndarray, np.ndarray, tuple[StatedColour, ...]]]] = {}
    for column, grid, colours in zip(columns, grids, beside, strict=True):
        lab = tuple(colour for colour in colours if colour.space == "Lab")
        if lab and column.bad is None and len(column.values) == grid.size:
            tables.setdefault(column.table, []).append((grid, np.asarray(column.values, dtype=np.float64), lab))
    found = set()
    for number, rows in tables.items():
        nm, values, labs = zip(*rows, strict=True)
        told = [luminances(nm, [row / by for row in values], labs) for by in (1.0, 100.0)]
        if any(one.ratios for one in told) and not any(one.ratios and one.mostly_of_surfaces for one in told):
            found.add(number)
    return found


def _hints_around(column: Column, path: Path, colours: bool) -> list[Sign]:
    """What the lines above hint at, such as a title; a chart and a lamp in them may both be true.

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


def _likenesses(columns: Sequence[Column], grids: Sequence[np.ndarray]) -> list[Likeness | None]:
    """The published table that each column resembles, all on one grid at once."""
    groups: dict[bytes, list[int]] = {}
    for index, grid in enumerate(grids):
        groups.setdefault(grid.tobytes(), []).append(index)
    found: list[Likeness | None] = [None] * len(columns)
    for places in groups.values():
        whole = [index for index in places if len(columns[index].values) == grids[index].size]
        if not whole:
            continue
        values = np.array([np.asarray(columns[index].values, dtype=np.float64) for index in whole])
        for index, likeness in zip(whole, likenesses(grids[whole[0]], values), strict=True):
            found[index] = likeness
    return found


def _refusal(column: Column, told: Sign | None, likeness: Likeness | None, path: Path) -> InputError | None:
    """Why a column is no spectrum of a colour, whatever anybody says of it."""
    said = told.says if told else None
    if likeness is not None and is_sensitivity(likeness):
        return not_a_colour(likeness, path, column.name)
    if said in _REFUSED:
        problem, hint = _REFUSED[said]
        found = column.words or column.unit or None
        return InputError(problem, file=path, field=column.name, found=found, expected=_WANTED, hint=hint)
    if column.bad is not None:
        line, cell = column.bad
        return InputError(
            "not a number",
            file=path,
            field=f"{column.name}, line {line}",
            found=repr(shortened(cell, 40)),
            expected="a number, or an empty cell where there is none",
        )
    return None


_REFUSED = {
    "absorbance": (
        "absorbance is neither reflectance nor transmittance",
        "export %R or %T: instruments show absorbance, K/S or log(1/R) as another mode of the same scan",
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
        "export what the instrument makes of them: irradiance, or reflectance against a white reference",
    ),
    "photons": (
        "photons are not power",
        "export power per nm (W); or divide each value by its wavelength, and call it relative power",
    ),
}


def counts_removed(columns: list[Column]) -> list[Column] | None:
    """Columns less those in counts, where others hold what was made of the counts; None where nothing is left out."""
    kept = [column for column in columns if not re.search("counts?", f"{column.words} {column.unit}", re.I)]
    made = any(measured(quantity_in(f"{column.words} {column.unit}")) for column in kept)
    return kept if 0 < len(kept) < len(columns) and made else None
