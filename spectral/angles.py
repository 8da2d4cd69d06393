"""Readings of one thing at several angles: which they are, and the flop index.

Multi-angle instruments light at one angle and read at several aspecular angles, measured from the mirror direction
towards the light. A file gives each angle as a spectrum of its own, which is no material: together they are one sample.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from .measurement import ANGLE_NOTATION, ANGLE_WITHOUT_LIGHT, MUST, Geometry, Measurement, signed

_One = TypeVar("_One")
#: Aspecular angles of the flop index, lit at 45 degrees, and the conditions that it is for.
FLOP_ANGLES, FLOP_CONDITIONS = (15.0, 45.0, 110.0), ("D65", "1964_10")
# Aspecular angles of the instruments there are. Of fewer than three, names with numbers may be of numbered samples.
_USUAL = frozenset((-15.0, 15.0, 20.0, 25.0, 45.0, 60.0, 75.0, 80.0, 110.0))
_FEWEST = 3
# Digits at the end of a name, and whether they are degrees (of an angle, not of a temperature).
_NUMBERED = re.compile(r"(.*?)(?<![\d.])([-\u2212]?\d+(?:\.\d+)?)\s*(°|º|deg(?:rees?)?)?[)\]]?", re.I)
# Words before an angle that name no sample.
_NO_SAMPLE = re.compile(r"r|ρ|refl(?:ectance)?|at|(?:\w+[ _-])?(?:angle|winkel)", re.I)
_ANGLE_COLUMN = re.compile(r"(?!.*(?:hue|screen|raster|phase|contact))(?:.*(?:angle|winkel|aspecular)|geometr).*", re.I)


@dataclass(frozen=True, eq=False)
class Reading(Generic[_One]):
    """A reading of any kind with its name, the name of the thing it is of where a file has one, and its measurement."""

    item: _One
    name: str
    thing: str
    measurement: Measurement

    @property
    def angle(self) -> Geometry | None:
        """The angle of a multi-angle instrument; None of other geometries."""
        geometry = self.measurement.geometry
        return geometry if geometry is not None and geometry.kind == "multi-angle" else None


@dataclass(frozen=True, eq=False)
class Thing(Generic[_One]):
    """Readings of one thing, or one reading at no angle; `by_name` : told by names that differ in their angle alone."""

    name: str
    readings: tuple[Reading[_One], ...]
    by_name: bool = False

    @property
    def angles(self) -> tuple[Geometry, ...]:
        """The angles of its readings, each once, in their order."""
        found: list[Geometry] = []
        for one in self.readings:
            if one.angle is not None and not any(one.angle.matches(other) for other in found):
                found.append(one.angle)
        return tuple(found)


def things(readings: Iterable[Reading[_One]]) -> tuple[Thing[_One], ...]:
    """Gather readings at several angles by the thing that they are of; every other reading is a thing of its own.

    Readings are of one thing where their file says so, or where their names differ by the notation of an angle alone
    and the rest of their measurement agrees.
    """
    groups: dict[str, list[list[Reading[_One]]]] = {}
    order: list[list[Reading[_One]]] = []
    for one in readings:
        if one.angle is None:
            order.append([one])
            continue
        kinds = groups.setdefault(without_angle(one.thing or one.name), [])
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
        name = without_angle(first.thing or first.name)
        others = [kind for kind in groups[name] if kind is not group]
        parts = [part for part in (*MUST, "data mode") if any(_differs(first, kind[0], part) for kind in others)]
        label = ", ".join([name, *(first.measurement.parts[part].words for part in parts)])
        found.append(Thing(label, tuple(group), len({one.thing or one.name for one in group}) > 1))
    return tuple(found)


def _otherwise(one: Reading, other: Reading) -> bool:
    """Whether two readings differ in more than their angle; of another data mode, one is no repeat of the other."""
    parts = (*one.measurement.unlike(other.measurement), *one.measurement.noted(other.measurement))
    return any((part in MUST and part != "geometry") or part == "data mode" for part in parts)


def _differs(one: Reading, other: Reading, part: str) -> bool:
    parts = (*one.measurement.unlike(other.measurement), *one.measurement.noted(other.measurement))
    return part != "geometry" and part in parts


def without_angle(name: str) -> str:
    """A name less the notation of an angle and what joins them.

    >>> without_angle("Mystic 45as-15"), without_angle("r45as110_Silver"), without_angle("Texas 15")
    ('Mystic', 'Silver', 'Texas 15')
    """
    found = ANGLE_NOTATION.search(name)
    if found is None:
        return name
    rest = f"{name[: found.start()]} {name[found.end() :]}"
    return re.sub(r"\s+", " ", re.sub(r"\(\s*\)|\[\s*\]", " ", rest)).strip(" ,;:_-/@°|")


def flop_index(lightness: Mapping[float, float]) -> float | None:
    """Flop index from L* at aspecular angles of 15, 45 and 110 degrees under D65 for 10 degrees.

    2.69 (L*15 - L*110)^1.11 / L*45^0.86, 0 where L* does not fall (named after D. H. Alman 1987). None where one of the
    three is missing, or L*45 is 0.

    >>> round(flop_index({15.0: 90.0, 45.0: 50.0, 110.0: 30.0}), 3)
    8.758
    """
    near, face, far = (lightness.get(angle) for angle in FLOP_ANGLES)
    if near is None or face is None or far is None or not face > 0.0:
        return None
    return 2.69 * max(near - far, 0.0) ** 1.11 / face**0.86


def common(sides: Sequence[Sequence[Geometry]]) -> tuple[Geometry, ...]:
    """The angles that all sides have, in the order of the first."""
    return tuple(one for one in sides[0] if all(any(one.matches(other) for other in side) for side in sides[1:]))


def without_light(names: Sequence[str], details: Sequence[Mapping[str, str]]) -> dict[int, str]:
    """Readings that seem to be at aspecular angles and do not say that of the light: words for it, by their place.

    Parameters
    ----------
    names, details : of readings whose geometry is no angle of a multi-angle instrument. Signs are three names or more
    such as "as15", or with degrees of usual angles; names that are nothing but three usual angles or more, or one word
    with those of the flop index and usual ones; rows of one name that differ in a column of angles.

    >>> sorted(without_light(["Sky as15", "as45", "as110", "Card"], [{}] * 4)), without_light(["1", "2"], [{}] * 2)
    ([0, 1, 2], {})
    """
    found: dict[int, str] = {}
    noted = [ANGLE_WITHOUT_LIGHT.search(name) for name in names]
    told = {at: signed(one[1] or one[2]) for at, one in enumerate(noted) if one}
    # Angles are multiples of 5; samples called AS 1, AS 2, ... are numbered.
    if len(set(told.values())) >= _FEWEST and all(angle % 5.0 == 0.0 for angle in told.values()):
        found |= {at: names[at] for at in told}
    groups: dict[tuple[str, bool], dict[int, float]] = {}
    for at, name in enumerate(names):
        if one := _NUMBERED.fullmatch(name.strip()):
            word = one[1].strip(" _-@([=:").casefold()
            # Right behind a word, a hyphen joins them.
            angle = abs(signed(one[2])) if one[1][-1:].isalnum() else signed(one[2])
            groups.setdefault(("" if _NO_SAMPLE.fullmatch(word) else word, bool(one[3])), {})[at] = angle
    for (word, degrees), group in groups.items():
        angles = set(group.values())
        enough = len(angles) >= _FEWEST and (
            degrees or (set(FLOP_ANGLES) <= angles if word else len(group) == len(names))
        )
        if enough and angles <= _USUAL:
            found |= {at: names[at] for at in group}
    columns = dict.fromkeys(label for one in details for label in one if _ANGLE_COLUMN.fullmatch(label))
    for label in columns:
        rows: dict[str, dict[int, str]] = {}
        for at, (name, one) in enumerate(zip(names, details, strict=True)):
            if _NUMBERED.fullmatch(one.get(label, "").strip()):
                rows.setdefault("" if "aspecular" in label.casefold() else name, {})[at] = one[label]
        for row in rows.values():
            if len(set(row.values())) > 1:
                found |= {at: f"{names[at]} ({label} {value})" for at, value in row.items() if at not in found}
    return dict(sorted(found.items()))
