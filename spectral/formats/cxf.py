"""Reads CxF3 (ISO 17972-1), the colour exchange format: spectra of objects, and tristimulus values beside them.

A file lists Objects with ColorValues; each value names the ColorSpecification that says how it was measured and, for a
list of values at even steps, where the wavelengths start and how far they are apart. Reflectance and transmittance are
fractions, emission is spectral radiance in W/(sr m^2 nm). A CustomSpectrum gives each value its own wavelength, and
leaves it to MeasurementType what it measures.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...runtime.errors import InputError
from ..spectrum import Quantity
from .cxf_angles import angles_of
from .cxf_metadata import TELLING, Stated, file_details, object_details, shared_out, stated_values
from .cxf_specification import Specification, specification
from .import_options import NO_ANSWER, ImportOptions
from .registry import SpectralFile, StatedColour, names_its_file
from .shared.decisions import Divisor, divisor_by_format
from .shared.entry_rules import Gathering, in_visible
from .shared.text import shortened
from .shared.words import is_aside, statistics_among
from .shared.xml import Vocabulary, number, read_xml, root_name

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

NAME = "CxF3"
SUFFIXES = (".cxf",)
NAMESPACE = "http://colorexchangeformat.com/CxF3-core"

#: A person may say the scale of one file alone, against the format.
SCALED = True

_LISTS: dict[str, Quantity] = {
    "ReflectanceSpectrum": "reflectance",
    "TransmittanceSpectrum": "transmittance",
    "EmissiveSpectrum": "emission",
}
_SPECTRA = (*_LISTS, "CustomSpectrum")
# The schema's limit for a list of fractions; and for what it does not limit, points and the side of a mirror that
# instruments of several angles read, where radiance factors of a few are met, and readings in percent are above.
_LARGEST_FRACTION, _LARGEST_FACTOR = 3.0, 10.0


def recognises(path: Path, head: bytes) -> bool:
    """True for XML whose root is CxF, whatever its prefix and namespace."""
    name = root_name(head)
    return name in ("CxF", "CXF") or (name is not None and path.suffix.lower() in SUFFIXES)


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Return every spectrum of a file; objects whose spectrum cannot be used are in `rejected`.

    Parameters
    ----------
    answer : about this file alone, it may say that its values are percents, against the format.

    Raises
    ------
    InputError
        Not well-formed, not CxF3, or no object has a spectrum: the message lists what is there instead. Values that
        are no percents, where a person says so.
    """
    in_percent = answer.scale == "percent" and answer.against == "overruled"
    root, known, specifications, objects = _opened(path)
    gathered = Gathering(path, NAME)
    if known.note:
        gathered.note(known.note)
    measured = []
    for item in objects:
        values = [value for group in known.children(item, "ColorValues") for value in known.children(group)]
        spectra = [value for value in values if known.name(value) in _SPECTRA]
        if spectra:
            measured.append((item, values, spectra))
    names = _names([item for item, _, _ in measured], gathered)
    kinds = [[item.get("ObjectType", "")] for item, _, _ in measured]
    left_out = [at for at in statistics_among(names, kinds) if not is_aside(names[at])]
    if left_out:
        gathered.note(f"statistics of others are left out: {', '.join(names[at] for at in left_out[:6])}")
    percent = None
    read_ones: list[_Reading] = []
    for at, (name, (item, values, spectra)) in enumerate(zip(names, measured, strict=True)):
        if at in left_out:
            continue
        beside = [value for value in values if known.name(value) not in _SPECTRA]
        colours, other = stated_values(beside, name, specifications, known, gathered)
        own = [_named_by(value, specifications) for value in spectra]
        shares = shared_out(colours, spectra, own, name, gathered)
        angles = angles_of(spectra, own, name, gathered)
        labels = _labels(spectra, specifications, angles)
        for value, label, told, angle, (stated, left) in zip(spectra, labels, own, angles, shares, strict=True):
            called = f"{name}, {label}" if label else name
            try:
                if isinstance(angle, InputError):
                    raise angle
                if told is None:
                    raise _without_specification(value, specifications, called)
                if value.get("ColorSpecification") is None:
                    gathered.note("no ColorSpecification is named; the only one of the file was taken", called)
                grid, samples, quantity = _samples(value, told, known, called, gathered)
            except InputError as reason:
                gathered.rejected.append((called, reason))
                continue
            bounded = known.name(value) in _LISTS and told.angles is None
            most = _LARGEST_FRACTION if bounded else _LARGEST_FACTOR
            if quantity != "emission" and not in_percent and (samples >= most).any():
                percent = percent or _percent(called, f"{samples.max():g}")
                gathered.rejected.append((called, _percent(called, f"{samples.max():g}")))
                continue
            details = object_details(item, value, told, known, angle) | other | left
            if angle is not None:
                details["object"] = name
            if quantity == "emission":
                details["units"] = "W/(sr m^2 nm)"
            kind = quantity if bounded or quantity != "reflectance" else "radiance factor"
            read_ones.append(_Reading(called, grid, samples, quantity, kind, stated, details))
    scales = {} if percent else _scales(read_ones, answer)
    for one in read_ones:
        scale = scales.get(one.kind)
        gathered.add_of_format(
            one.name, one.grid, one.samples, one.quantity, scale, stated=one.stated, details=one.details
        )
    if percent is not None:
        # A dark sample in percent looks like a bright one in fractions: the others tell.
        fractions = [entry for entry in gathered.entries if entry.spectrum.quantity != "emission"]
        found = f"{percent.found} in {percent.field}"
        gathered.rejected += [(entry.name, _percent(entry.name, found)) for entry in fractions]
        gathered.entries = [entry for entry in gathered.entries if entry.spectrum.quantity == "emission"]
    if not gathered.entries and not gathered.rejected:
        raise _without_spectra(root, objects, known)
    return gathered.finish(file_details(root, known))


@names_its_file
def colours_without_spectra(path: Path) -> list[tuple[str, tuple[StatedColour, ...], dict[str, str]]]:
    """Read the XYZ and CIELAB that objects state, whether or not there are spectra, with their names and details.

    Colours that were measured under several conditions are an entry each, with the condition in its name.

    Raises
    ------
    InputError : not well-formed, or not CxF3.
    """
    _, known, specifications, objects = _opened(path)
    gathered = Gathering(path, NAME)
    found = []
    for item, name in zip(objects, _names(objects, gathered), strict=True):
        values = [value for group in known.children(item, "ColorValues") for value in known.children(group)]
        beside = [value for value in values if known.name(value) not in _SPECTRA]
        by_conditions: dict[tuple[str, ...], list[Stated]] = {}
        for one in stated_values(beside, name, specifications, known, gathered)[0]:
            key = tuple(one.specification.details.get(part, "") for part in TELLING)
            by_conditions.setdefault(key, []).append(one)
        for key, stated in by_conditions.items():
            others = [other for other in by_conditions if other != key]
            told = [word for place, word in enumerate(key) if word and any(other[place] != word for other in others)]
            called = ", ".join([name, *(word.partition(" ")[0] for word in told)])
            details = {**stated[0].specification.details, "format": NAME}
            found.append((called, tuple(one.colour for one in stated), details))
    return found


def _opened(path: Path) -> tuple[Element, Vocabulary, dict[str, Specification | None], list[Element]]:
    """Return the root, its vocabulary, specifications by Id, and the objects."""
    root = read_xml(path)
    known = Vocabulary(root, NAMESPACE)
    if known.name(root) != "CxF" or "gretagmacbeth" in known.root_uri.lower():
        raise InputError(
            "not a CxF3 file",
            field="root element",
            found=root.tag[:120],
            expected=f"CxF in namespace {NAMESPACE}",
            hint="versions 1 and 2 of CxF are other formats: export as CxF3",
        )
    resources = list(known.children(root, "Resources"))
    specifications = _specifications(resources, known)
    objects = [
        item
        for resource in resources
        for collection in known.children(resource, "ObjectCollection")
        for item in known.children(collection, "Object")
    ]
    return root, known, specifications, objects


class _Reading(NamedTuple):
    """One spectrum as the file has it; `kind`: what bounds its values, a radiance factor at an angle."""

    name: str
    grid: np.ndarray
    samples: np.ndarray
    quantity: Quantity
    kind: str
    stated: tuple[StatedColour, ...]
    details: dict[str, str]


def _scales(readings: Sequence[_Reading], answer: ImportOptions) -> dict[str, Divisor]:
    """Find the divisor of readings of each kind: 1 by the format, unless a person says so of this file alone.

    Raises
    ------
    InputError
        Nothing is as dark or as bright as the format says; or the person's answer does not fit the values.
    """
    found: dict[str, Divisor] = {}
    for kind in dict.fromkeys(one.kind for one in readings if one.kind != "emission"):
        alike = [one for one in readings if one.kind == kind]
        seen = np.concatenate([one.samples[in_visible(one.grid)] for one in alike])
        if scale := divisor_by_format(seen, kind, NAME, answer):
            found[kind] = scale
    return found


def _percent(field: str, found: str) -> InputError:
    return InputError(
        "the file looks like percent",
        field=field,
        found=found,
        expected=f"fractions; CxF3 has 100 % = 1.0, and lists of less than {_LARGEST_FRACTION:g} throughout",
        hint="divide by 100, or import this file alone with --scale percent",
    )


def _names(objects: list[Element], gathered: Gathering) -> list[str]:
    """Names of objects; those that share one are told apart by ObjectType, else by Id. Without a name the Id is it."""
    names = [item.get("Name") or item.get("Id") or f"object {place}" for place, item in enumerate(objects, 1)]
    alike: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        alike.setdefault(name, []).append(place)
    for name, places in alike.items():
        if len(places) == 1:
            continue
        for attribute in ("ObjectType", "Id"):
            labels = [objects[place].get(attribute, "") for place in places]
            if len(set(labels)) == len(labels):
                gathered.note(f"objects that share a name are told apart by {attribute}", name)
                for place, label in zip(places, labels, strict=True):
                    names[place] = f"{name} ({label})"
                break
    return names


def _specifications(resources: list[Element], known: Vocabulary) -> dict[str, Specification | None]:
    """Return the colour specifications by Id; None where two share one."""
    found: dict[str, Specification | None] = {}
    for resource in resources:
        for collection in known.children(resource, "ColorSpecificationCollection"):
            for element in known.children(collection, "ColorSpecification"):
                name = element.get("Id", "")
                found[name] = None if name in found else specification(element, known)
    return found


def _named_by(value: Element, known: Mapping[str, Specification | None]) -> Specification | None:
    """Return the specification that a value names, the only one where it names none; None where there is no telling."""
    wanted = value.get("ColorSpecification")
    return known.get(wanted) if wanted is not None else next(iter(known.values())) if len(known) == 1 else None


def _without_specification(value: Element, known: Mapping[str, Specification | None], field: str) -> InputError:
    """Return the refusal of a value that names no specification, none of the file, or one of two."""
    wanted = value.get("ColorSpecification")
    expected = ", ".join(list(known)[:8]) or "a specification, but the file has none"
    if wanted is None:
        return InputError("the spectrum names no ColorSpecification", field=field, expected=expected)
    if wanted not in known:
        return InputError(
            f"ColorSpecification {wanted!r} is not in the file",
            field=field,
            found=f"a reference to {wanted!r}",
            expected=expected,
            hint="export the specifications together with the objects; upper and lower case differ",
        )
    return InputError("two ColorSpecifications share an Id", field=field, found=wanted)


def _samples(
    value: Element, told: Specification, known: Vocabulary, field: str, gathered: Gathering
) -> tuple[np.ndarray, np.ndarray, Quantity]:
    """Wavelengths, values and quantity of one spectrum."""
    kind = known.name(value) or ""
    listed = _LISTS.get(kind)
    quantity = listed or told.quantity
    if quantity is None:
        raise InputError(
            "the file does not say what this spectrum measures",
            field=field,
            found=f"MeasurementType {told.details.get('measurement', 'missing')}",
            expected="Spectrum_Reflectance, Spectrum_Transmittance or Spectrum_Emissive",
        )
    if listed and not told.assumed and told.quantity not in (None, listed):
        gathered.note(f"its MeasurementType is {told.details.get('measurement')}; what counts is its {kind}", field)
    if listed:
        samples = np.array([number(text, field) for text in (value.text or "").split()])
        grid = _even_grid(value, told, len(samples), field, gathered)
    else:
        if told.assumed:
            gathered.note(told.assumed)
        points = list(known.children(value, "SpectralPoint"))
        grid = np.array([number(point.get("WL", ""), field) for point in points])
        samples = np.array([number((point.text or "").strip(), field) for point in points])
        grid, samples = gathered.ascending(field, grid, samples)
    return grid, samples, quantity


def _even_grid(value: Element, told: Specification, count: int, field: str, gathered: Gathering) -> np.ndarray:
    """Wavelengths of a list: the start that it gives itself counts before that of its specification."""
    start, step = value.get("StartWL", told.start), value.get("Increment", told.increment)
    if start is None or step is None:
        lacking = "StartWL" if start is None else "Increment"
        raise InputError(
            f"no wavelengths: {lacking} is missing",
            field=field,
            found=f"{count} values",
            expected='a WavelengthRange such as StartWL="380" Increment="10" in its ColorSpecification',
        )
    first, apart = (number(text, field) for text in (start, step))
    if told.start is not None and value.get("StartWL") is not None:
        other = number(told.start, field)
        if other != first:
            gathered.note(
                f"starts at {first:g} nm, as it says itself, not at {other:g} nm, as its specification", field
            )
    if not (np.isfinite([first, apart]).all() and apart > 0):
        raise InputError("no even steps", field=field, found=f"{start} by {step}", expected="nm, above 0")
    return first + apart * np.arange(count)


def _labels(
    spectra: list[Element],
    specifications: Mapping[str, Specification | None],
    angles: Sequence[tuple[str, str] | InputError | None],
) -> list[str]:
    """Find what tells the spectra of an object apart: angles, else their names, conditions, specifications or kinds."""
    if len(spectra) < 2:
        return [""] * len(spectra)

    def condition(value: Element) -> str:
        told = specifications.get(value.get("ColorSpecification", ""))
        return "" if told is None else told.details.get("condition", "").partition(" ")[0]

    ways = (
        [angle[0] if isinstance(angle, tuple) else "" for angle in angles],
        [value.get("Name", "") for value in spectra],
        [condition(value) for value in spectra],
        [value.get("ColorSpecification", "") for value in spectra],
        [value.tag.rpartition("}")[2] for value in spectra],
    )
    for labels in ways:
        if all(labels) and len(set(labels)) == len(labels):
            return labels
    return [f"spectrum {place}" for place in range(1, len(spectra) + 1)]


def _without_spectra(root: Element, objects: list[Element], known: Vocabulary) -> InputError:
    """Return the refusal of a file without spectra, which says what its objects have instead."""
    if not objects:
        there = list(dict.fromkeys(known.name(part) or "" for part in known.children(root)))
        return InputError(
            "no spectra: the file has no objects",
            field="Resources",
            found=f"{shortened(', '.join(there[:6])) or 'nothing'} in the file",
            expected="Resources with an ObjectCollection, and spectra in its objects",
            hint="export it again, with the colours and their spectral values",
        )
    kinds: Counter[str] = Counter()
    for item in objects:
        values = [
            known.name(value) or ""
            for group in known.children(item, "ColorValues", "DeviceColorValues")
            for value in known.children(group)
        ]
        kinds[" and ".join(sorted(set(values))) or "no colour values"] += 1
    names = ", ".join(repr(shortened(item.get("Name") or item.get("Id") or "")) for item in objects[:6])
    told = "; ".join(f"{times} with {kind}" for kind, times in kinds.most_common(6))
    private = any("Private" in kind for kind in kinds)
    bare = set(kinds) == {"no colour values"}
    return InputError(
        "no spectra: the objects have no values" if bare else "no spectra: the objects have other values only",
        field="ObjectCollection",
        found=f"{len(objects)} objects ({told}): {names}{', ...' if len(objects) > 6 else ''}",
        expected="one ReflectanceSpectrum, TransmittanceSpectrum, EmissiveSpectrum or CustomSpectrum at least",
        hint="its spectra are encrypted: ask the owner for open ones" if private else "export with spectral values",
    )
