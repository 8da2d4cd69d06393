"""Colours without spectra, as many standards come: XYZ or CIELAB in CGATS, CxF3 or a table, or in a few words."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ..angles import are_angles, geometry_of_columns
from ..measurement import conditions_in, is_condition
from .cgats import conditions_of, illuminants_of, observers_of, recognises
from .cgats_tables import read_tables
from .cxf import colours_without_spectra
from .cxf import recognises as is_cxf
from .import_options import NO_ANSWER, ImportOptions
from .registry import HEAD, StatedColour
from .shared.colour_words import (
    beside_colour_axis,
    colour_axis,
    condition_in,
    illuminant_in,
    illuminants_in,
    names_condition,
    observer_in,
    observers_in,
    stated_colours,
)
from .shared.text import read_lines
from .shared.words import OF_STATISTICS, is_aside, statistics_among
from .tables.dialect import Dialect, check_lengths, dialects_of
from .tables.one_reading import check_whole
from .tables.section import ragged, trimmed

_WORDS = re.compile(r"(lab|lch|xyz)\s*:\s*([^@]+?)\s*(?:@\s*(\S+?)\s*/\s*(\S+))?$", re.I)
_NAMES = ("SAMPLE_NAME", "SAMPLE_ID", "NAME", "ID", "SAMPLE", "PATCH_NAME", "SAMPLE_LOC")
_ANGLE_HEAD = re.compile(r"(?:asp(?:ec(?:ular)?)?\.? ?)?(?:angles?|winkel|angolo)(?: ?[\[(].*)?", re.I)
# Colours in other coordinates: a heading for each of them, and the headings of what they are converted to.
_POLAR = tuple(re.compile(f"(?:lch_?)?{axis}", re.I) for axis in (r"l\*?", r"c\*?(?:ab)?", "h(?:ab)?°?"))
_CHROMATICITY = (re.compile("x"), re.compile("y"), re.compile("Y"))
_CONVERTED = (
    (_POLAR, ("L*", "a*", "b*"), "a* and b* are C* cos h and C* sin h"),
    (_CHROMATICITY, ("X", "Y", "Z"), "X and Z are x Y / y and (1 - x - y) Y / y"),
)
# Largest of X, Y and Z of white under daylights and bluer lights, Y = 1.
_WHITE_OF_ONE = 1.25
# L* of ten times white; silver paints come near it beside the mirror direction.
_LIGHTEST = 250.0
# Lines about Hunter's L, a, b of 1948; an instrument of the firm that bears his name may well give CIELAB.
_HUNTER = re.compile(
    r"(?<![a-z])hunter[ -]?(?:scale|values?|colou?r scale|l ?,? ?a ?,? ?b)(?![a-z])"
    r"(?! ?(?:[a-z]+ )?(?:ultra|colou?r|mini|lab|agera|aeros|vista))",
    re.I,
)
_LIKE = "lab:52.1,10.3,-5.6@D65/1964_10"


class UnclearColoursError(InputError):
    """Colours that are there, and of which something has to be said; a file without any is refused otherwise."""


class Coloured(NamedTuple):
    """A name, the colours stated of it, and what the file says of how they were measured."""

    name: str
    stated: tuple[StatedColour, ...]
    details: Mapping[str, str]

    def with_conditions(self, light: str | None, eye: str | None) -> Coloured:
        """Return it with the illuminant and the observer for colours that state none."""
        stated = (replace(one, illuminant=one.illuminant or light, observer=one.observer or eye) for one in self.stated)
        return self._replace(stated=tuple(stated))


def colour_in(text: str) -> StatedColour | None:
    """Return the colour that a person writes, such as "lab:52.1,10.3,-5.6@D65/1964_10"; None where the text is none.

    Raises
    ------
    InputError : not three numbers, or no illuminant and observer: a colour without them is not one.
    """
    match = _WORDS.match(text.strip())
    if match is None:
        return None
    space, numbers, light, eye = match.groups()
    if light is None:
        raise InputError(
            "a colour without its illuminant and observer",
            field="colour",
            found=text,
            expected=f"such as {_LIKE}",
        )
    try:
        values = np.array([float(part) for part in numbers.split(",")])
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(
            "not a colour", field="colour", found=text, expected="three numbers", hint=f"write it as {_LIKE}"
        )
    if space.lower() == "lch":
        turn = np.radians(values[2])
        values = np.array([values[0], values[1] * np.cos(turn), values[1] * np.sin(turn)])
    found = StatedColour("XYZ" if space.lower() == "xyz" else "Lab", values, light, eye)
    # Blacks are written as L*, a*, b*.
    _check_scale([found], NO_ANSWER if found.space == "XYZ" else ImportOptions(scale="percent"))
    return found


def read_colours(path: str | Path, answer: ImportOptions = NO_ANSWER) -> tuple[Coloured, ...]:
    """Read the colours that a file states by name; what it leaves open of illuminant and observer is the answer's.

    Raises
    ------
    InputError : the file states no colours.
    """
    path = existing_file(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    if is_cxf(path, head):
        found = [Coloured(*one) for one in colours_without_spectra(path)]
    else:
        found = (_cgats if recognises(path, head) else _table)(path, answer)
    if not found:
        raise InputError(
            "no colours in this file",
            file=path,
            expected="spectra, or columns such as LAB_L, LAB_A, LAB_B",
            hint="export the measurement with its spectra",
        )
    _check_scale([one for each in found for one in each.stated], answer)
    return tuple(one.with_conditions(*(answer.colours_for or (None, None))) for one in _without_statistics(found))


def _without_statistics(found: Sequence[Coloured]) -> list[Coloured]:
    """Return colours less those that are the scatter or another statistic of others, whose names go with the rest."""
    names = [one.name for one in found]
    said = [[cell for head, cell in one.details.items() if OF_STATISTICS.search(head)] for one in found]
    left_out = [at for at in statistics_among(names, said) if not is_aside(names[at])]
    of_all = {"left out": ", ".join(names[at] for at in left_out[:6])} if left_out else {}
    return [one._replace(details={**one.details, **of_all}) for at, one in enumerate(found) if at not in left_out]


def _check_scale(stated: Sequence[StatedColour], answer: ImportOptions) -> None:
    """Refuse colours of which none is above white on a scale to 1: on that to 100, all would be black; and an L* that
    nothing has.
    """
    light = [float(one.values[0]) for one in stated if one.space == "Lab"]
    wrong = next((one for one in light if not 0.0 <= one <= _LIGHTEST), None)
    if wrong is not None:
        raise UnclearColoursError("no lightness", field="L*", found=f"{wrong:.4g}", expected="L* of 0 to 100")
    if max((float(np.abs(one.values).max()) for one in stated if one.space == "Lab"), default=np.inf) <= 1.0 and (
        answer.scale != "percent"
    ):
        raise UnclearColoursError(
            "L*, a*, b* of a scale to 1, or all black",
            field="L*, a*, b*",
            found=f"L* up to {max(light):.4g}, and no a* or b* beyond 1",
            expected="L* of 0 to 100",
            hint="multiply them by 100 if that is their scale; a file of blacks is read with --scale percent",
        )
    largest = max((float(one.values.max()) for one in stated if one.space == "XYZ"), default=np.inf)
    if largest <= _WHITE_OF_ONE and answer.scale != "percent":
        raise UnclearColoursError(
            "XYZ of a scale to 1, or all black",
            field="XYZ",
            found=f"up to {largest:.4g}",
            expected="Y = 100 for the perfect diffuser",
            hint="multiply them by 100; blacks are written as lab:, and a file of blacks is read with --scale percent",
        )


def _the_one(names: tuple[str, ...], kind: str, answer: ImportOptions) -> str | None:
    """Return the illuminant or the observer that colours are for, None where none is named.

    Raises
    ------
    UnclearColoursError
        Several are, and the answer names none.
    """
    if len(names) > 1 and answer.colours_for is None:
        raise UnclearColoursError(
            f"two {kind}s above one set of colours",
            field=kind,
            found=", ".join(names),
            expected=f"one {kind}, or headings that name theirs, such as L*(D65/10)",
            hint="say which: --colours-for D65/1964_10; or export the colours of each light in columns of their own",
        )
    return names[0] if len(names) == 1 else None


def _cgats(path: Path, answer: ImportOptions) -> list[Coloured]:
    found = []
    for table in read_tables(path):
        details = conditions_of(table)
        heads = [field for field in table.fields if colour_axis(field)]
        if not heads:
            continue
        _check_twice(heads, "BEGIN_DATA_FORMAT")
        light = _the_one(illuminants_of(table), "illuminant", answer)
        eye = _the_one(observers_of(table), "observer", answer)
        upper = [field.upper() for field in table.fields]
        name_at = next((upper.index(name) for name in _NAMES if name in upper), None)
        for place, row in enumerate(table.rows, 1):
            cells = dict(zip(table.fields, row, strict=True))
            numbers = {field: table.number(cell) for field, cell in cells.items() if colour_axis(field)}
            name = row[name_at] if name_at is not None else f"{path.stem} {place}"
            about = {field: cell for field, cell in cells.items() if cell.strip() and _is_about_a_reading(field)}
            found += _colours_of(name, numbers, light, eye, details | about)
    return found


def _table(path: Path, answer: ImportOptions) -> list[Coloured]:
    """Return a header of names, L*, a* and b*, and a row each; the light and the observer stand anywhere above or in
    it.
    """
    every = read_lines(path)
    check_lengths(every)
    lines = [(at, line) for at, line in enumerate(every, 1) if line.strip()]
    # White space is in names, too.
    dialect = next((one for one in dialects_of([line for _, line in lines]) if one.delimiter), Dialect(",", "."))
    rows = [(at, trimmed(dialect.cells(line))) for at, line in lines]
    rows, words = _converted(rows, dialect)
    for start, (place, header) in enumerate(rows):
        if sum(colour_axis(cell) is not None for cell in header) < 3:
            continue
        above = "\n".join(" ".join(row) for _, row in rows[: start + 1])
        _check_headings(header, place, above)
        lights, eyes = illuminants_in(above), observers_in(above)
        details = (
            {"format": "CSV"}
            | ({"converted": words} if words else {})
            | dict(labelled for _, row in rows[:start] if (labelled := _labelled(row)))
        )
        found = []
        first = next((head for head in header if not (colour_axis(head) or _is_about_a_reading(head))), "")
        last = ""
        for at, row in rows[start + 1 :]:
            if len(row) > len(header):
                raise ragged(at, len(row), len(header), row)
            cells = dict(zip(header, row, strict=False))
            of_colours = {head: cell for head, cell in cells.items() if colour_axis(head)}
            check_whole(list(of_colours.values()), dialect, at)
            numbers = {head: dialect.number(cell) for head, cell in of_colours.items()}
            others = {head: cell for head, cell in cells.items() if head not in numbers and cell.strip()}
            own = " ".join(f"{head}: {cell}" for head, cell in others.items() if names_condition(head))
            named = next((head for head in others if not _is_about_a_reading(head)), None)
            # Further readings of a sample stand below its name.
            below = last and first not in others and any(are_angles(head, [cell]) for head, cell in others.items())
            name = last if below else others.pop(named) if named is not None else f"{path.stem} {at - place}"
            last = name if below or first == named else ""
            geometry = geometry_of_columns(others)
            said = details | ({} if geometry is None else {"geometry": geometry}) | others
            of_row = _colours_of(name, numbers, illuminant_in(own), observer_in(own), said)
            stated = [colour for one in of_row for colour in one.stated]
            light = _the_one(lights, "illuminant", answer) if any(one.illuminant is None for one in stated) else None
            eye = _the_one(eyes, "observer", answer) if any(one.observer is None for one in stated) else None
            found += [one.with_conditions(light, eye) for one in of_row]
        return found
    return []


def _converted(rows: list[tuple[int, list[str]]], dialect: Dialect) -> tuple[list[tuple[int, list[str]]], str]:
    """Turn a table of L*, C*, h or of x, y, Y, without L*, a*, b* or X, Y, Z, into one of these; with what was done."""
    for start, (_, header) in enumerate(rows):
        for patterns, wanted, words in _CONVERTED:
            heads = [re.sub(r"\s*[\[(](?:°|deg|degrees)[\])]$", "", head.strip()) for head in header]
            found = [[at for at, head in enumerate(heads) if pattern.fullmatch(head)] for pattern in patterns]
            if any(len(columns) != 1 for columns in found) or sum(colour_axis(head) is not None for head in header) > 2:
                continue
            first, second, third = (columns[0] for columns in found)
            made = [(at, list(row)) for at, row in rows]
            for at, name in zip((first, second, third), wanted, strict=True):
                made[start][1][at] = name
            for line, row in made[start + 1 :]:
                if len(row) <= max(first, second, third):
                    continue
                numbers = [dialect.number(row[at]) for at in (first, second, third)]
                row[first], row[second], row[third] = (
                    f"{number:.17g}".replace(".", dialect.decimal) for number in _in_usual(patterns, numbers, line)
                )
            return made, words
    return rows, ""


def _in_usual(patterns: object, numbers: Sequence[float], line: int) -> Sequence[float]:
    """Convert L*, C*, h in degrees to L*, a*, b* (CIE 015:2018, 8.2.1), or x, y, Y to X, Y, Z (7.3)."""
    if patterns is _POLAR:
        lightness, chroma, hue = numbers
        if chroma < 0.0:
            raise UnclearColoursError(
                "a chroma below 0", field=f"line {line}", found=chroma, expected="C* of 0 or more"
            )
        return lightness, chroma * np.cos(np.radians(hue)), chroma * np.sin(np.radians(hue))
    x, y, luminous = numbers
    if not (0.0 <= x <= 1.0 and 0.0 < y <= 1.0 and x + y <= 1.0):
        found = f"x {x:g}, y {y:g}"
        raise UnclearColoursError("no chromaticity", field=f"line {line}", found=found, expected="0 to 1, y above 0")
    return x * luminous / y, luminous, (1.0 - x - y) * luminous / y


def _colours_of(
    name: str, cells: Mapping[str, float], light: str | None, eye: str | None, details: Mapping[str, str]
) -> list[Coloured]:
    """Return the colours of one row; those of one light and observer that stand below several headings are readings
    apart.
    """
    by_words: dict[str, dict[str, float]] = {}
    for head, value in cells.items():
        by_words.setdefault(beside_colour_axis(head), {})[head] = value
    apart = {words: stated_colours(own, light, eye) for words, own in by_words.items()}
    apart = {words: colours for words, colours in apart.items() if colours}
    kinds = [(one.space, one.illuminant, one.observer) for colours in apart.values() for one in colours]
    if len(set(kinds)) == len(kinds):
        together = stated_colours(cells, light, eye)
        return [Coloured(name, together, details)] if together else []
    found = []
    for words, colours in apart.items():
        condition = condition_in(words)
        said = conditions_in(words) | ({"measurement condition": condition} if condition else {})
        found.append(Coloured(f"{name} {words}".strip(), colours, {**details, **said}))
    return found


def _is_about_a_reading(head: str) -> bool:
    """Return whether a heading is of how something was read, and so not of its name."""
    return is_condition(head) or names_condition(head) or bool(_ANGLE_HEAD.fullmatch(head.strip()))


def _check_headings(header: list[str], line: int, above: str) -> None:
    """Refuse a heading of a colour that stands twice: the line above may tell them apart, and is not read; and letters
    of Hunter's L, a, b, which CIELAB has, too.
    """
    heads = [head.strip() for head in header if colour_axis(head)]
    if (hunter := _HUNTER.search(above)) and not any("*" in head for head in heads):
        raise UnclearColoursError(
            "Hunter L, a, b are not L*, a*, b*",
            field=f"line {line}",
            found=f"{hunter[0].strip()}; {', '.join(heads[:3])}",
            expected="CIELAB, as L*, a*, b*, or XYZ",
            hint="export CIELAB or the spectra; where it is CIELAB, write L*, a*, b* into the headings",
        )
    _check_twice(heads, f"line {line}")


def _check_twice(heads: Sequence[str], field: str) -> None:
    if twice := [head for head in dict.fromkeys(heads) if heads.count(head) > 1]:
        raise UnclearColoursError(
            "two columns of one heading",
            field=field,
            found=", ".join(twice[:4]),
            expected="headings that tell them apart",
            hint='write what differs behind each, such as "L*(SCI)" and "L*(SCE)"',
        )


def _labelled(row: list[str]) -> tuple[str, str] | None:
    """Return a label and its words in a line above a table, in two cells or in one; None where it has no label."""
    words = [cell.strip() for cell in row if cell.strip()]
    label, mark, rest = (words or [""])[0].partition(":")
    if mark and rest.strip():
        return label.strip(), rest.strip()
    return (label.strip(), words[1]) if len(words) == 2 else None
