"""Metadata of a CxF3 file beside its spectra: tristimulus values, and everything else as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...runtime.errors import InputError
from .cxf_specification import Specification
from .registry import StatedColour
from .shared.entry_rules import Gathering
from .shared.xml import Vocabulary, element_words, kept, number

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


#: Parts of a specification by which a colour is known to be of one spectrum and not of another beside it.
TELLING = ("condition", "geometry", "filter", "polarisation", "backing")


@dataclass(frozen=True, eq=False)
class Stated:
    """Tristimulus values of an object: what they are, their own name, their specification, and all of it as text."""

    colour: StatedColour
    kind: str
    name: str
    specification: Specification
    text: str


def shared_out(
    stated: Sequence[Stated],
    spectra: Sequence[Element],
    specification: Sequence[Specification | None],
    name: str,
    gathered: Gathering,
) -> list[tuple[tuple[StatedColour, ...], dict[str, str]]]:
    """Return the colours of an object by the spectrum that each is of, and as text by kind those that are of none.

    A colour is of the spectra that have its specification; else of those that agree with it in the most parts of
    theirs, and contradict it in none, such as the same light of the device; of these, of the one of its own name.
    Only where nothing tells are there several, which a note says.
    """
    colours: list[list[StatedColour]] = [[] for _ in spectra]
    other: dict[str, str] = {}
    for one in stated:
        agreement = [_agreement(one.specification, each) for each in specification]
        best = max(agreement, default=-1)
        of = [at for at, parts in enumerate(agreement) if parts == best] if best >= 0 else []
        of = [at for at in of if one.name and spectra[at].get("Name") == one.name] or of
        if not of:
            gathered.note(f"{one.kind} is of another measurement than the spectra of its object, kept as text", name)
            other[one.kind] = one.text
        elif len(of) > 1:
            gathered.note(f"{one.kind} does not say which spectrum of its object it is of: beside each", name)
        for at in of:
            colours[at].append(one.colour)
    return [(tuple(found), other) for found in colours]


def _agreement(one: Specification, other: Specification | None) -> int:
    """Count the parts that two specifications share, -1 where they contradict each other; most where they are one."""
    if other is one:
        return len(TELLING) + 1
    if other is None:
        return -1
    both = [part for part in TELLING if one.details.get(part) and other.details.get(part)]
    same = [part for part in both if one.details[part] == other.details[part]]
    return len(same) if len(same) == len(both) else -1


def stated_values(
    values: list[Element],
    name: str,
    specifications: Mapping[str, Specification | None],
    known: Vocabulary,
    gathered: Gathering,
) -> tuple[list[Stated], dict[str, str]]:
    """Collect the values that an object states beside its spectra: tristimulus values, and `values` of other kinds as
    text by kind.
    """
    colours: list[Stated] = []
    other: dict[str, str] = {}
    for value in values:
        kind = known.name(value) or ""
        specification = specifications.get(value.get("ColorSpecification", ""))
        colour = None
        if specification is None:
            gathered.note(f"{kind} refers to no ColorSpecification of the file and is kept as text", name)
        else:
            try:
                colour = _colour(kind, value, specification, known, name)
            except InputError as reason:
                gathered.note(f"{kind} is not used: {reason.problem}", name)
        if colour is None or specification is None:
            other[kind] = element_words(value)
        else:
            colours.append(Stated(colour, kind, value.get("Name", ""), specification, element_words(value)))
    return colours, kept(other)


def _colour(
    kind: str, value: Element, specification: Specification, known: Vocabulary, name: str
) -> StatedColour | None:
    """XYZ or Lab of a value that is one or turns into one without further data."""
    axes = {
        "ColorCIEXYZ": "XYZ", "ColorEmissiveCIEXYZ": "XYZ", "ColorCIExyY": "xyY", "ColorEmissiveCIExyY": "xyY",
        "ColorCIELab": "LAB", "ColorCIELCh": "LCH",
    }.get(kind)  # fmt: skip
    if axes is None:
        return None
    a, b, c = (number(known.text(value, axis), f"{name}: {kind}") for axis in axes)
    if axes == "xyY":
        if not b > 0:
            raise InputError("no chromaticity", field=name, found=f"y = {b:g}", expected="y > 0")
        a, b, c = a * c / b, c, (1.0 - a - b) * c / b
    elif axes == "LCH":
        b, c = b * np.cos(np.radians(c)), b * np.sin(np.radians(c))
    if not np.isfinite([a, b, c]).all():
        raise InputError("not a finite number", field=name, found=f"{a} {b} {c}")
    space = "Lab" if axes in ("LAB", "LCH") else "XYZ"
    return StatedColour(space, np.array([a, b, c], dtype=np.float64), specification.illuminant, specification.observer)


def object_details(
    item: Element,
    value: Element,
    specification: Specification,
    known: Vocabulary,
    angle: tuple[str, str] | None = None,
) -> dict[str, str]:
    """Collect the details of one spectrum from the object, from the value and from its specification; `angle` :
    notation and angles of a multi-angle geometry.
    """
    details = dict(specification.details)
    label = value.get("Name", "")
    if angle is not None:
        details["geometry"] = f"{angle[0]}: {angle[1]}"
    said = {"kind": "ObjectType", "id": "Id", "GUID": "GUID"}
    details |= {ours: item.get(theirs, "") for ours, theirs in said.items()}
    details |= {"spectrum": label, "measured": value.get("MeasureDate", "")}
    details |= {"created": known.text(item, "CreationDate"), "comment": known.text(item, "Comment")}
    for group in known.children(item, "TagCollection"):
        details |= _tags(group, known, f"tag {group.get('Name', '')}".strip())
    for name in ("PhysicalAttributes", "DeviceColorValues", "ColorDifferenceValues"):
        if (element := known.child(item, name)) is not None:
            details[name] = element_words(element)
    glosses = list(known.children(known.child(item, "PhysicalAttributes"), "Gloss"))
    details["gloss"] = "; ".join(_gloss(one) for one in glosses)
    return kept(details)


def _gloss(element: Element) -> str:
    """Gloss units and how they were measured, such as "87.5 (60°)"."""
    units, method = (element.text or "").strip(), element.get("Method", "").strip()
    return f"{units} ({method})" if method else units


def _tags(group: Element, known: Vocabulary, prefix: str) -> dict[str, str]:
    return {f"{prefix}: {tag.get('Name', '')}": tag.get("Value", "") for tag in known.children(group, "Tag")}


def file_details(root: Element, known: Vocabulary) -> dict[str, str]:
    """FileInformation, and CustomResources as one line of text each."""
    details: dict[str, str] = {}
    for group in known.children(root, "FileInformation"):
        names = {"Creator": "creator", "CreationDate": "created", "Description": "description", "Comment": "comment"}
        details |= {ours: text for theirs, ours in names.items() if (text := known.text(group, theirs))}
        details |= _tags(group, known, "tag")
    for group in known.children(root, "CustomResources"):
        for place, element in enumerate(group, 1):
            name = element.tag.rpartition("}")[2]
            details[f"custom {place}: {name}"] = element_words(element)
    return kept(details)
