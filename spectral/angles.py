"""Readings of one thing at several angles: which they are, and the flop index.

Multi-angle instruments light at one angle and read at several aspecular angles, measured from the mirror direction
towards the light. A file gives each angle as a spectrum of its own, which is no material: together they are one sample.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from .measurement import ANGLE_NOTATION, MUST, Geometry, Measurement

_One = TypeVar("_One")
#: Aspecular angles of the flop index, lit at 45 degrees, and the conditions that it is for.
FLOP_ANGLES, FLOP_CONDITIONS = (15.0, 45.0, 110.0), ("D65", "1964_10")


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
