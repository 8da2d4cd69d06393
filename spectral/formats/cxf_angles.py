"""Angles of a multi-angle specification that the spectra of a CxF3 object were read at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...runtime.errors import InputError
from ..measurement import geometry_in
from .cxf_specification import Specification
from .shared.entry_rules import Gathering

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def check_angles(angles: Sequence[tuple[str, str]], field: str) -> None:
    """Raise `InputError` where angles are missing, stand twice, or are not those of their notation."""
    seen: list[tuple[str, str]] = []
    for notation, line in angles:
        if "?" in line:
            raise InputError(
                "an angle is missing",
                field=f"{field}: BRDFAngle {notation}",
                found=line,
                expected="IlluminationAngle and Aspecular, numbers in degrees",
            )
        here, named = geometry_in(line), geometry_in(notation)
        twice = next((other for other, told in seen if other == notation or _alike(told, line)), None)
        if twice is not None:
            raise InputError(
                "one angle stands twice",
                field=f"{field}: BRDFAngle",
                found=f"{twice} and {notation}" if twice != notation else f"{notation}, {line}",
                expected="each angle once",
            )
        if here is not None and named is not None and named.kind == "multi-angle" and not named.matches(here):
            raise InputError(
                "a notation and its angles are not the same",
                field=f"{field}: BRDFAngle {notation}",
                found=line,
                expected=f"the angles of {notation}",
            )
        seen.append((notation, line))


def _alike(one: str, other: str) -> bool:
    first, second = geometry_in(one), geometry_in(other)
    return first is not None and second is not None and first.matches(second)


def angles_of(
    spectra: Sequence[Element], specifications: Sequence[Specification | None], name: str, gathered: Gathering
) -> list[tuple[str, str] | InputError | None]:
    """Find notation and angles of each spectrum of an object; a refusal where its file does not tell; None of others.

    A specification of one angle tells it; of several, a spectrum's own Name does, and without names the order does,
    where there are as many spectra as angles.
    """
    found: list[tuple[str, str] | InputError | None] = []
    for value, told in zip(spectra, specifications, strict=True):
        if told is None or told.angles is None:
            found.append(None)
            continue
        try:
            check_angles(told.angles, name)
        except InputError as reason:
            found.append(reason)
            continue
        found.append(_angle(value, told, spectra, specifications, name, gathered))
    return found


def _angle(
    value: Element,
    told: Specification,
    spectra: Sequence[Element],
    specifications: Sequence[Specification | None],
    name: str,
    gathered: Gathering,
) -> tuple[str, str] | InputError:
    angles = told.angles or ()
    label = value.get("Name", "")
    by_name = _named(label, angles)
    if by_name is not None:
        return by_name
    if len(angles) == 1:
        return angles[0]
    same = [one for one, other in zip(spectra, specifications, strict=True) if other is told]
    if len(same) == len(angles) and not any(_named(one.get("Name", ""), angles) for one in same):
        gathered.note("no spectrum names its angle: they are taken in the order of the specification's angles", name)
        return angles[[one is value for one in same].index(True)]
    return InputError(
        "the file does not say at which angle this spectrum was read",
        field=f"{name}{f', {label}' if label else ''}",
        found=f"{len(same)} spectra of a specification of {len(angles)} angles",
        expected=f"a Name that is one of {', '.join(notation for notation, _ in angles)}",
    )


def _named(label: str, angles: Sequence[tuple[str, str]]) -> tuple[str, str] | None:
    exact = next((angle for angle in angles if label and angle[0] == label), None)
    if exact is not None or not label:
        return exact
    read = geometry_in(label)
    if read is None or read.kind != "multi-angle":
        return None
    return next((angle for angle in angles if (own := geometry_in(angle[1])) is not None and own.matches(read)), None)
