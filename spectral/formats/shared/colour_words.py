"""Vocabulary of colours beside spectra: illuminant, observer, measurement condition, axes of CIELAB and XYZ."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ...observers import ANGLES
from ..registry import StatedColour
from .text import one_line

_CONDITION_COLUMN = re.compile("illum|observer|obs$|light", re.I)
_ILLUMINANT = (
    r"D\s?(?:50|55|65|75|93)|F\s?L?\s?\d{1,2}|FL\d{1,2}|LED-[BV]\w+|ID(?:50|65)|TL[ -]?8[345]|CWF|WWF|U(?:30|40|50)|"
    r"horizon|(?-i:[ABCE])"
)
_NAMED_ILLUMINANT = re.compile(
    rf"(?:illumin\w*|lichtart|source|light|ill)(?:s|\W?\d(?=\W))?\W{{0,3}}(?:name\W{{0,3}})?(?:CIE\s*)?({_ILLUMINANT})\b",
    re.I,
)
_PLAIN_ILLUMINANT = re.compile(r"(?<![A-Za-z0-9])(D\s?(?:50|55|65|75|93)|FL?\s?\d{1,2}|TL[ -]?8[345]|CWF)(?![0-9])")
_WITH_ANGLE = re.compile(rf"(?<![A-Za-z0-9])({_ILLUMINANT})\s*[/,_ -]\s*(?:2|10)\s*(?:°|deg|º|$|[)\]])", re.I)
_CALLED_ILLUMINANT = (
    _NAMED_ILLUMINANT,
    _WITH_ANGLE,
    re.compile(r"(?<![A-Za-z0-9])(D\s?(?:50|55|65|75|93)|FL?\s?\d{1,2}|TL[ -]?8[345]|CWF)/(?:2|10)(?![\d.])"),
)
# A light named behind another one; a letter alone only in a list of nothing else.
_AND = r"(?:[,;/&+]|\b(?:and|or|und|et)\b)"
_FURTHER_ILLUMINANT = re.compile(
    rf"\s*{_AND}\s*(?:CIE\s*)?(?:illuminant\s*)?((?!(?:CIE )?[ABCE]\b){_ILLUMINANT})(?![A-Za-z0-9])|"
    rf"\s*{_AND}?\s*(?:CIE\s*)?(?:illuminant\s*)?({_ILLUMINANT})(?=\s*(?:{_AND}|$)|\s+(?:{_ILLUMINANT})\b)",
    re.I,
)
_OBSERVER = re.compile(
    r"(?:viewing angle|field of view)\D{0,8}(2|10)\b|"
    r"(?<![\d.,])(2|10)(?:\.0+)?\s*(?:°|º|deg|_?degree)|observer\w*\W{0,4}(?:angle\W{0,4})?(?:CIE\s*)?(2|10|1931|1964)\b|"
    r"CIE\s*_?(1931|1964)|(?:D\d\d|[AC]|FL?\d{1,2})\s*[/_-]\s*(2|10)\b",
    re.I,
)
_CONDITION = re.compile(r"(?<![A-Za-z0-9])(M[0-3])(?![0-9A-Za-z])")


def names_condition(heading: str) -> bool:
    """Return whether a heading is that of the illuminant or the observer that colours are for."""
    return bool(_CONDITION_COLUMN.search(heading))


def illuminant_in(words: str) -> str | None:
    """Name of the illuminant in words such as "Illumination=D50", "D65/10°" or "A", as `illuminant` knows it."""
    words = one_line(words).strip("\"'")
    exact = re.fullmatch(rf"(?:CIE\s*)?(?:(?:std|standard)\.?\s*)?(?:illuminant\s*)?({_ILLUMINANT})", words, re.I)
    found = exact or _NAMED_ILLUMINANT.search(words) or _WITH_ANGLE.search(words) or _PLAIN_ILLUMINANT.search(words)
    return None if found is None else _illuminant(found[1])


def _illuminant(name: str) -> str:
    return re.sub(r"^F(?=\d)", "FL", re.sub(r"\s", "", name).upper())


def illuminants_in(lines: str) -> tuple[str, ...]:
    """Return all illuminants that lines name, each once; lights that only stand in a line count where none is called
    one, and with it where they follow it.

    >>> illuminants_in("Illuminant: D65"), illuminants_in("Illuminants: D65, A"), illuminants_in("D65/10 A/10")
    (('D65',), ('D65', 'A'), ('D65', 'A'))
    """
    called: list[str] = []
    plain: list[str] = []
    for line in map(one_line, lines.splitlines()):
        matches = sorted((one for each in _CALLED_ILLUMINANT for one in each.finditer(line)), key=re.Match.start)
        strong = [_and_further(match, line) for match in matches]
        weak = [_and_further(match, line) for match in _PLAIN_ILLUMINANT.finditer(line)]
        named = {name for names in strong for name in names}
        called += [name for names in [*strong, *(names for names in weak if named & set(names))] for name in names]
        plain += [name for names in weak for name in names]
    return tuple(dict.fromkeys(called or plain))


def _and_further(found: re.Match[str], line: str) -> list[str]:
    """Return the illuminant that was found and those that are listed behind it."""
    names = [_illuminant(found[1])]
    while further := _FURTHER_ILLUMINANT.match(line, found.end()):
        names.append(_illuminant(further[1] or further[2]))
        found = further
    return names


def observer_in(words: str) -> str | None:
    """Short name of the standard observer in words such as "ObserverAngle=2", "10°" or "CIE 1931"."""
    words = one_line(words).strip("\"'")
    if words in ANGLES:
        return ANGLES[words]
    found = _OBSERVER.search(words)
    return None if found is None else _observer(found)


def _observer(found: re.Match[str]) -> str:
    return ANGLES[next(group for group in found.groups() if group)]


def observers_in(lines: str) -> tuple[str, ...]:
    """Return all standard observers that lines name, each once; an angle alone counts where none is called one."""
    of_lines = [list(_OBSERVER.finditer(one_line(line))) for line in lines.splitlines()]
    called = [matches for matches in of_lines if any(match[2] is None for match in matches)]
    return tuple(dict.fromkeys(_observer(match) for matches in called or of_lines for match in matches))


def condition_in(words: str) -> str | None:
    """Measurement condition of ISO 13655, "M0" to "M3"."""
    found = _CONDITION.search(one_line(words))
    return found[1] if found else None


_COLOUR_COLUMN = re.compile(
    r"(?:tristimulus(?: values?)? )?(?:(?P<space>XYZ|CIE[ _]?XYZ|LAB|CIE[ _]?LAB|CIE)[ _.:-]+)?"
    r"(?P<axis>X|Y|Z|L|a|b) ?\*?(?P<rest>$|[ (\[/,_].*|(?<=\*)[-\u2212]?\d.*)",
    re.I,
)
# A reading and its axis, such as "-15° L*", "45as15 a*" and "D65/10° X"; a letter alone needs an angle or a light.
_AXIS_LAST = re.compile(
    r"(?P<before>.{1,60}?)(?:[ _,;:/|)\]-]+|(?<=[°º]))(?:CIE ?)?(?P<axis>L|a|b|(?-i:[XYZ]))(?P<star>(?<![XYZ]) ?\*)?",
    re.I,
)
_READ_SO = re.compile(
    rf"(?:{_ILLUMINANT})(?:\s*[/,_ -]\s*(?:2|10))?\s*(?:°|º|deg)?|(?:r?\d+)?as(?:p(?:ec\w*)?)?[ _]*[-\u2212]?\d+|"
    r"[-\u2212]?\d+ ?(?:°|º|deg)?(?: ?as(?:p(?:ec\w*)?)?)?|SC[IE]",
    re.I,
)
_ONLY_LIGHT = re.compile(rf"(?:{_ILLUMINANT})(?:\s*[/,_ -]\s*(?:2|10)\s*(?:°|º|deg)?)?", re.I)
# Differences (not the geometry d/8), limits and other spaces with the same letters: none is a colour of CIELAB.
_NO_COLOUR = re.compile(
    r"[Δ∆δ]|(?<![a-z])(?:d(?! ?[/:])|delta|diff\w*|dev\w*|tol\w*|limits?|std\W?dev\w*|sd|sigma|min\w*|max\w*|hunter|"
    r"ok|din ?99)(?![a-z0-9])",
    re.I,
)


def _colour_heading(header: str) -> tuple[str, str, str] | None:
    """Return the axis of a heading of colours, the space it names and the words beside it; None of any other."""
    line = one_line(header)
    last = _AXIS_LAST.fullmatch(line)
    # "A/10° L*" is L* under illuminant A, and no a*.
    is_read_so = last is not None and _READ_SO.fullmatch(last["before"].strip(" ()[]")) is not None
    if not is_read_so and (match := _COLOUR_COLUMN.match(line)) is not None:
        axis, space, beside = match["axis"], (match["space"] or "").upper(), match["rest"]
    elif last is not None and (is_read_so or last["star"]):
        axis, space, beside = last["axis"], "XYZ" if last["axis"] in "XYZ" else "LAB", last["before"]
    else:
        return None
    return (
        None if _NO_COLOUR.search(beside) else (axis, space, re.sub(r"^at\b", "", beside.strip(" ()[],;:/_")).strip())
    )


def colour_axis(header: str) -> tuple[str, int] | None:
    """("XYZ", 0..2) or ("Lab", 0..2) of a column such as XYZ_X, "L*", "LAB_B", "a*(10°/D65)" or "-15° L*", None of any
    other.
    """
    found = _colour_heading(header)
    if found is None:
        return None
    letter, space, _ = found
    axis = letter.upper()
    if axis in "XYZ" and "LAB" not in space:
        # Lower-case x, y, z without a space before them are chromaticity coordinates.
        return ("XYZ", "XYZ".index(axis)) if space or letter.isupper() else None
    if axis in "LAB" and "XYZ" not in space:
        starred = "*" in header or "LAB" in space or "CIE" in space
        return ("Lab", "LAB".index(axis)) if starred or letter in ("L", "a", "b") else None
    return None


def beside_colour_axis(header: str) -> str:
    """Return the words beside the axis in the heading of a colour, such as "SCI" in "L*(SCI)" and "15°" in "15° L*"."""
    found = _colour_heading(header)
    return found[2] if found else ""


def stated_colours(
    cells: Mapping[str, float], illuminant: str | None = None, observer: str | None = None
) -> tuple[StatedColour, ...]:
    """Tristimulus values among cells by header; an illuminant and observer in a header go before those given."""
    found: dict[tuple[str, str | None, str | None], dict[int, float]] = {}
    for header, value in cells.items():
        axis = colour_axis(header)
        if axis is None or not np.isfinite(value):
            continue
        own, beside = header.partition("(")[2].rstrip(" )]") or header, beside_colour_axis(header)
        light = (
            illuminant_in(own) if "(" in header else illuminant_in(beside) if _ONLY_LIGHT.fullmatch(beside) else None
        )
        found.setdefault((axis[0], light, observer_in(own)), {}).setdefault(axis[1], float(value))
    stated = []
    for (space, light, angle), values in found.items():
        if len(values) == 3:
            triple = np.array([values[index] for index in range(3)])
            stated.append(
                StatedColour(
                    "XYZ" if space == "XYZ" else "Lab",
                    triple,
                    light or illuminant,
                    angle or observer,
                )
            )
    return tuple(stated)
