"""Readings of one thing at several angles: their grouping, and the flop index.

Multi-angle instruments light at one angle and read at several aspecular angles, measured from the mirror direction
towards the light. A file has each angle as a spectrum of its own, which is no material: together they are one sample.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float

from .illuminants import illuminant
from .measurement import ANGLE_NOTATION, ANGLE_WITHOUT_LIGHT, MUST_AGREE, Geometry, Measurement, signed
from .observers import observer

_One = TypeVar("_One")
#: Aspecular angles of the flop index, lit at 45 degrees, and the conditions that it is for.
FLOP_ANGLES, FLOP_CONDITIONS = (15.0, 45.0, 110.0), ("D65", "1964_10")
#: Fewer angles tell neither of an effect nor of a BRDF.
FEWEST = 3
# Aspecular angles of the instruments there are, and sets of which two tell of one where words stand before all of them:
# samples may be numbered, and tints have 25 and 75 %.
_USUAL = frozenset((-45.0, -30.0, -15.0, 15.0, 20.0, 25.0, 45.0, 60.0, 75.0, 80.0, 110.0))
_MOSTLY = 0.8
_MANY = 64
_COMMON = (frozenset(FLOP_ANGLES), frozenset((-15.0, 15.0)), frozenset((25.0, 45.0)), frozenset((45.0, 75.0)))
# Digits at the end of a name, and whether they are degrees (of an angle, not of a temperature); d may be days.
_NUMBERED = re.compile(
    r"(.*?)(?<![\d.])([-\u2212]?\d+(?:\.\d+)?)\s*[(\[]?(?:(°|º|˚|∘|deg(?:rees?|\.)?|grad)|d\.?)?[)\]]?", re.I
)
_DEGREES = re.compile(r"[-\u2212]?\d+(?:\.\d+)?\s*(?:°|º|˚|∘|deg(?:rees?|\.)?|grad)", re.I)
# Degrees before a name or within it, which are no temperature and no grid.
_DEGREES_BEFORE = re.compile(
    r"((?:.*[\s_,;(\[])?)([-\u2212]?\d+(?:\.\d+)?)\s*(?:°|º|˚|∘|deg(?:rees?|\.)?|grad)(?![a-z])[)\]]?(.+)", re.I
)
# Quantity behind an angle.
_MEASURED = re.compile(
    r"[ _,;(\[]+%? ?(?:R|refl(?:ectance|\.)?|reflexion|remission|radiance factor|β|%) ?%?[)\]]?$", re.I
)
# Words before an angle that name no sample.
_NO_SAMPLE = re.compile(r"r|ρ|refl(?:ectance)?|at|(?:\w+[ _-])?(?:angle|winkel)", re.I)
_AN_ANGLE = re.compile(r"(?:^|[ _-])(?:angle|winkel)$", re.I)
# Signs between an angle and a name.
_JOINTS = " ,;:_-/@°|=(["
_NO_ANGLE = "hue|screen|raster|phase|contact|temp"
_ANGLE_COLUMN = re.compile(
    rf"(?!.*(?:{_NO_ANGLE})).*(?:angle|winkel|aspecular|geometr).*|as|\W*(?:°|deg(?:rees?)?|grad)\W*", re.I
)
# Columns of one direction alone, which call it no angle; whose numbers are steps of 5 degrees.
_DIRECTION_COLUMN = re.compile(
    r"(?:incid|detect|viewing|observation|illumination|einfall|einstrahl|ausfall|beobachtung)\w*", re.I
)
_IN_DEGREES = r"[ _-]*(?:[\[(]?\s*(?:°|deg(?:rees?)?)\s*[\])]?)?"
_LIGHT_COLUMN = re.compile(
    r"(?:light|lamp|source|illuminat\w*|incid\w*|einstrahl\w*|einfall\w*|beleuchtung\w*)[ _-]*(?:angle|winkel)?"
    rf"{_IN_DEGREES}",
    re.I,
)
_ASPECULAR_COLUMN = re.compile(rf"(?:aspecular|differenz)[ _-]*(?:angle|winkel)?{_IN_DEGREES}", re.I)


class Unlit(NamedTuple):
    """Reading at an aspecular angle, degrees, without the angle of the light.

    The words that state it, the angle, and whether they mark it as one ("as15", "15°", a column of angles) or are only
    a number.
    """

    words: str
    aspecular: float
    noted: bool = False


@dataclass(frozen=True, eq=False)
class AngleReading(Generic[_One]):
    """Reading of any kind with its name, the name of its thing if the file has one, and its measurement."""

    item: _One
    name: str
    thing: str
    measurement: Measurement

    @property
    def angle(self) -> Geometry | None:
        """Angle of a multi-angle instrument; None for other geometries."""
        geometry = self.measurement.geometry
        return geometry if geometry is not None and geometry.kind == "multi-angle" else None


@dataclass(frozen=True, eq=False)
class Thing(Generic[_One]):
    """Readings of one thing, or one reading at no angle; `by_name` : grouped by names equal but for the angle."""

    name: str
    readings: tuple[AngleReading[_One], ...]
    by_name: bool = False

    @property
    def angles(self) -> tuple[Geometry, ...]:
        """Distinct angles of its readings, in their order."""
        found: list[Geometry] = []
        for one in self.readings:
            if one.angle is not None and not any(one.angle.matches(other) for other in found):
                found.append(one.angle)
        return tuple(found)


def things(readings: Iterable[AngleReading[_One]]) -> tuple[Thing[_One], ...]:
    """Group readings at several angles by thing; every other reading is a thing of its own.

    Readings are of one thing if their file states it, or if their names differ only by the notation of an angle and the
    rest of their measurement agrees.
    """
    groups: dict[str, list[list[AngleReading[_One]]]] = {}
    order: list[list[AngleReading[_One]]] = []
    for one in readings:
        if one.angle is None:
            order.append([one])
            continue
        kinds = groups.setdefault(_called(one), [])
        kind = next((kind for kind in kinds if not any(_otherwise(one, other) for other in kind)), None)
        if kind is None:
            kinds.append([one])
            order.append(kinds[-1])
        else:
            kind.append(one)
    found = []
    for group in order:
        first = group[0]
        if first.angle is None:
            found.append(Thing(first.name, (first,)))
            continue
        name = _called(first)
        others = [kind for kind in groups[name] if kind is not group]
        parts = [part for part in (*MUST_AGREE, "data mode") if any(_differs(first, kind[0], part) for kind in others)]
        label = ", ".join([name, *(first.measurement.parts[part].words for part in parts)])
        found.append(Thing(label, tuple(group), len({one.thing or one.name for one in group}) > 1))
    return tuple(found)


def _called(reading: AngleReading) -> str:
    """Return the name of the thing of a reading at an angle: its own without the angle, in any notation."""
    name, angle = reading.thing or reading.name, reading.angle
    if angle is None or angle.first is not None:
        return without_angle(name)
    if noted := ANGLE_WITHOUT_LIGHT.search(name):
        return _joined(name[: noted.start()], name[noted.end() :])
    numbered = _numbered(name)
    if numbered is None or abs(signed(numbered[2])) != abs(angle.second or 0.0):
        return name
    word = numbered[1].strip(_JOINTS)
    return "" if _NO_SAMPLE.fullmatch(word) else word if numbered[3] else name


def _numbered(name: str) -> re.Match[str] | None:
    """Match a name and its number, with degrees or not, which may precede the name, too."""
    plain = _MEASURED.sub("", name.strip())
    last = _NUMBERED.fullmatch(plain)
    before = None if last is not None and last[3] else _DEGREES_BEFORE.fullmatch(plain)
    if before is None:
        return last
    return _NUMBERED.fullmatch(f"{_joined(before[1].strip(_JOINTS), before[3].strip(_JOINTS))} {before[2]}°")


def _otherwise(one: AngleReading, other: AngleReading) -> bool:
    """Return whether two readings differ in more than their angle, the data mode included."""
    parts = (*one.measurement.differing(other.measurement), *one.measurement.noted(other.measurement))
    return any((part in MUST_AGREE and part != "geometry") or part == "data mode" for part in parts)


def _differs(one: AngleReading, other: AngleReading, part: str) -> bool:
    parts = (*one.measurement.differing(other.measurement), *one.measurement.noted(other.measurement))
    return part != "geometry" and part in parts


def without_angle(name: str) -> str:
    """Return a name less the notation of an angle and what joins them.

    >>> without_angle("Mystic 45as-15"), without_angle("r45as110_Silver"), without_angle("Texas 15")
    ('Mystic', 'Silver', 'Texas 15')
    >>> without_angle("Mystic 45as15 R%"), without_angle("45as15 R%"), without_angle("%R 45as15")
    ('Mystic', '', '')
    """
    found = ANGLE_NOTATION.search(name)
    if found is None:
        return name
    rest = _joined(name[: found.start()], _MEASURED.sub("", name[found.end() :]))
    return "" if _MEASURED.fullmatch(f" {rest}") else rest


def _joined(*parts: str) -> str:
    """Return the parts of a name around an angle, without separators."""
    rest = re.sub(r"\(\s*\)|\[\s*\]", " ", " ".join(parts))
    return re.sub(r"\s+", " ", rest).strip(_JOINTS)


def flop_index(lightness: Mapping[float, float]) -> float | None:
    """Compute the flop index from L* at aspecular angles of 15, 45 and 110 degrees under D65 for 10 degrees.

    2.69 (L*15 - L*110)^1.11 / L*45^0.86, 0 if L* does not fall (named after D. H. Alman 1987). None if one of the three
    is missing, or L*45 is 0.

    >>> round(flop_index({15.0: 90.0, 45.0: 50.0, 110.0: 30.0}), 3)
    8.758
    """
    near, face, far = (lightness.get(angle) for angle in FLOP_ANGLES)
    if near is None or face is None or far is None or not face > 0.0:
        return None
    return 2.69 * max(near - far, 0.0) ** 1.11 / face**0.86


def flop_weights(wavelengths_nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, "3 L"]:
    """Compute weights from radiance factors to XYZ under `FLOP_CONDITIONS`, Y of the perfect diffuser being 1."""
    light, eye = FLOP_CONDITIONS
    return observer(eye).weights(illuminant(light), wavelengths_nm)


def common(sides: Sequence[Sequence[Geometry]]) -> tuple[Geometry, ...]:
    """Return the angles common to all sides, in the order of the first."""
    return tuple(one for one in sides[0] if all(any(one.matches(other) for other in side) for side in sides[1:]))


def without_light(names: Sequence[str], details: Sequence[Mapping[str, str]]) -> dict[int, Unlit]:
    """Find readings at apparently aspecular angles without the angle of the light, by index.

    Parameters
    ----------
    names, details : of readings whose geometry is no multi-angle one. Evidence is: two names or more such as "as15",
        with degrees of usual angles, or that are only usual angles; numbers after one word that include those of the
        flop index; after any words if all names have them, with two of the common ones each; rows of one name that
        differ in a column of angles, or of numbers that include those of the flop index.

    >>> sorted(without_light(["Sky as15", "as45", "Card"], [{}] * 3)), without_light(["1", "2"], [{}] * 2)
    ([0, 1], {})
    """
    return dict(sorted((_by_columns(names, details) | _by_names(names)).items()))


def are_angles(label: str, cells: Sequence[str]) -> bool:
    """Return whether a column is of angles, by its heading, or by degrees or "as" in each cell.

    A column of directions counts if its cells are multiples of 5 degrees.

    >>> are_angles("Angle", ["15"]), are_angles("Channel", ["15°", "as25"]), are_angles("Channel", ["15"])
    (True, True, False)
    """
    if _ANGLE_COLUMN.fullmatch(label.strip()):
        return True
    if _DIRECTION_COLUMN.fullmatch(label.strip()):
        return all(angle is not None and angle % 5.0 == 0.0 for angle in map(_angle_in, cells))
    noted = (ANGLE_NOTATION, ANGLE_WITHOUT_LIGHT, _DEGREES)
    return all(any(one.fullmatch(text) for one in noted) for text in cells) and not re.search(_NO_ANGLE, label, re.I)


def geometry_of_columns(columns: Mapping[str, str]) -> str | None:
    """Return the multi-angle geometry stated by two columns beside a reading: the light's angle and the aspecular one.

    >>> geometry_of_columns({"Light angle": "45°", "Aspecular": "-15"}), geometry_of_columns({"Light": "D65"})
    ('45as-15', None)
    """
    stated = []
    for pattern in (_LIGHT_COLUMN, _ASPECULAR_COLUMN):
        angles = {value for head, value in columns.items() if pattern.fullmatch(head.strip())}
        number = _NUMBERED.fullmatch(angles.pop().strip()) if len(angles) == 1 else None
        if number is None or number[1]:
            return None
        stated.append(signed(number[2]))
    return f"{stated[0]:g}as{stated[1]:g}" if stated[0] >= 0.0 else None


def _by_names(names: Sequence[str]) -> dict[int, Unlit]:
    """Find the readings whose names are angles; see `without_light`."""
    found: dict[int, Unlit] = {}
    noted = [ANGLE_WITHOUT_LIGHT.search(name) for name in names]
    told = {at: signed(one[1] or one[2]) for at, one in enumerate(noted) if one}
    angles = set(told.values())
    # Samples called AS 1, AS 2, ... are numbered.
    if len(angles) > 1 and (all(one % 5.0 == 0.0 for one in angles) or _mostly_usual(angles)):
        found |= {at: Unlit(names[at], one, True) for at, one in told.items()}
    groups: dict[tuple[str, bool], dict[int, float]] = {}
    for at, name in enumerate(names):
        if one := _numbered(name):
            word = one[1].strip(_JOINTS).casefold()
            # Right behind a word, a hyphen joins them.
            angle = abs(signed(one[2])) if one[1][-1:].isalnum() else signed(one[2])
            said = bool(one[3]) or _AN_ANGLE.search(word) is not None
            groups.setdefault(("" if _NO_SAMPLE.fullmatch(word) else word, said), {})[at] = angle
    groups = {
        key: group
        for key, group in groups.items()
        if len(set(group.values())) > 1 and _mostly_usual(set(group.values()))
    }
    alone = sum(map(len, groups.values())) == len(names)
    common_alone = alone and all(
        any(len(common.intersection(group.values())) > 1 for common in _COMMON) for group in groups.values()
    )
    for (word, degrees), group in groups.items():
        of_word = common_alone or _tell_flop(set(group.values()))
        if degrees or (of_word if word else alone):
            found |= {at: Unlit(names[at], angle, degrees) for at, angle in group.items() if at not in found}
    return found


def _by_columns(names: Sequence[str], details: Sequence[Mapping[str, str]]) -> dict[int, Unlit]:
    """Find the readings that differ in a column of angles; see `without_light`."""
    found: dict[int, Unlit] = {}
    for label in dict.fromkeys(label for one in details for label in one):
        cells = {at: text for at, one in enumerate(details) if (text := one.get(label, "").strip())}
        # Instruments read at a few angles, and tables have columns of many thousands of other numbers.
        each = set(cells.values())
        said = are_angles(label, sorted(each))
        if not said and len(each) > _MANY:
            continue
        angle_of = {text: angle for text in each if (angle := _angle_in(text, words=said)) is not None}
        # Blocks of one paint are numbered, and so are its rows.
        together = said and ("aspecular" in label.casefold() or _tell_flop(set(angle_of.values())))
        rows: dict[str, list[int]] = {}
        for at, text in cells.items():
            if text in angle_of:
                rows.setdefault("" if together else names[at], []).append(at)
        for row in rows.values():
            angles = {angle_of[cells[at]] for at in row}
            if (said and len(angles) > 1) or _tell_flop(angles):
                found |= {
                    at: Unlit(f"{names[at]} ({label} {cells[at]})", angle_of[cells[at]], True)
                    for at in row
                    if at not in found
                }
    return found


def _angle_in(text: str, words: bool = False) -> float | None:
    """Return the angle of a cell, such as "15", "-15°" or "as15", optionally after `words`; else None."""
    if noted := ANGLE_WITHOUT_LIGHT.fullmatch(text):
        return signed(noted[1] or noted[2])
    number = _NUMBERED.fullmatch(text)
    return None if number is None or (number[1] and not words) else signed(number[2])


def _tell_flop(angles: set[float]) -> bool:
    return set(FLOP_ANGLES) <= angles and _mostly_usual(angles)


def _mostly_usual(angles: set[float]) -> bool:
    return len(angles & _USUAL) >= _MOSTLY * len(angles)
