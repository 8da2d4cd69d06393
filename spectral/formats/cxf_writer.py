"""Writes CxF3 that is valid against its core schema (CxF3_Core.xsd), numbers as exact as float64."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ..wavelengths import is_uniform
from .cxf import NAMESPACE
from .registry import SpectralEntry

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# Limits of the schema for a list: its first wavelength, its steps, and the open ranges of its values.
_STARTS, _STEPS = (360, 400), (1, 2, 5, 10, 20)
_FRACTIONS = (-0.1, 3.0)
_ILLUMINANTS = (
    "A", "B", "C", "D50", "D55", "D60", "D65", "D75", "E", "F2", "F3", "F7", "F9", "F10", "F11", "F12",
)  # fmt: skip
_OBSERVERS = {"1931_2": "2_Degree", "1964_10": "10_Degree"}
_KINDS = {
    "reflectance": ("ReflectanceSpectrum", "Spectrum_Reflectance"),
    "radiance factor": ("ReflectanceSpectrum", "Spectrum_Reflectance"),
    "transmittance": ("TransmittanceSpectrum", "Spectrum_Transmittance"),
    "emission": ("EmissiveSpectrum", "Spectrum_Emissive"),
}
_LIGHTS = {"M0": "M0_Incandescent", "M1": "M1_Daylight", "M2": "M2_UVExcluded", "M3": "M3_Polarized"}
_SINGLE_ANGLE = re.compile(r"(\d+(?:\.\d+)?)\s*([acx]?)\s*[:/]\s*(\d+(?:\.\d+)?)\s*([acx]?)\b(.*)", re.I)
_DATE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|[+-]\d\d:\d\d)?")
# Details that stand in elements of their own; all others become tags.
_PLACED = (
    "geometry", "condition", "instrument", "calibration", "aperture", "backing", "comment", "measured", "kind",
    "specification", "measurement",
)  # fmt: skip


def write_cxf(
    path: str | Path,
    entries: Sequence[SpectralEntry],
    about: Mapping[str, str] | None = None,
    tags: Sequence[Mapping[str, str]] = (),
    created: datetime | None = None,
) -> None:
    """Write spectra, with the tristimulus values and details of each, as one file.

    Even steps that the schema allows become a list, all other wavelengths a CustomSpectrum, whose specification says
    what it measures. What XML cannot hold (control characters) becomes U+FFFD.

    Parameters
    ----------
    about : "creator", "description" and "comment" of the file; everything else becomes its tags.
    tags : of each entry, written as a TagCollection named "provenance".
    created : of the file and of objects that state no date; now by default.

    Raises
    ------
    InputError
        Nothing to write, a spectrum that is no single one, or a folder that cannot be written to.
    """
    from xml.etree import ElementTree

    if not entries:
        raise InputError("nothing to write", file=path, expected="one spectrum or more")
    now = (created or datetime.now(UTC)).strftime("%Y-%m-%dT%H:%M:%SZ")
    root = ElementTree.Element(f"{{{NAMESPACE}}}CxF")
    _file_information(root, dict(about or {}), now)
    resources = _add(root, "Resources")
    objects = _add(resources, "ObjectCollection")
    specifications = _Specifications()
    for place, entry in enumerate(entries):
        _object(objects, entry, place, tags[place] if place < len(tags) else {}, specifications, now, path)
    resources.append(specifications.collection)
    ElementTree.register_namespace("cc", NAMESPACE)
    ElementTree.indent(root)
    with written_whole(path) as beside:
        ElementTree.ElementTree(root).write(beside, encoding="UTF-8", xml_declaration=True)


def _add(parent: Element, name: str, text: str | None = None, **attributes: str) -> Element:
    from xml.etree.ElementTree import SubElement

    element = SubElement(parent, f"{{{NAMESPACE}}}{name}", {key: _clean(value) for key, value in attributes.items()})
    if text is not None:
        element.text = _clean(text)
    return element


def _clean(text: str) -> str:
    """Without the characters that XML 1.0 has no way to write."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)


def _file_information(root: Element, about: dict[str, str], now: str) -> None:
    information = _add(root, "FileInformation")
    _add(information, "Creator", about.pop("creator", "Metamer"))
    _add(information, "CreationDate", now)
    for name in ("description", "comment"):
        if name in about:
            _add(information, name.capitalize(), about.pop(name))
    for name, value in about.items():
        _add(information, "Tag", Name=name, Value=value)


def _object(
    objects: Element,
    entry: SpectralEntry,
    place: int,
    tags: Mapping[str, str],
    specifications: _Specifications,
    now: str,
    path: str | Path,
) -> None:
    details, spectrum = dict(entry.details), entry.spectrum
    if spectrum.samples.ndim != 1:
        raise InputError("not one spectrum", file=path, field=entry.name, found=f"shape {spectrum.samples.shape}")
    item = _add(objects, "Object", ObjectType=details.get("kind", "Standard"), Name=entry.name, Id=f"object{place + 1}")
    _add(item, "CreationDate", now)
    if "comment" in details:
        _add(item, "Comment", details["comment"])
    values = _add(item, "ColorValues")
    listed = _as_list(entry)
    specified = specifications.of(entry, listed)
    dated = {"MeasureDate": details["measured"]} if _DATE.fullmatch(details.get("measured", "")) else {}
    if listed:
        element = _add(values, _KINDS[spectrum.quantity][0], " ".join(map(repr, spectrum.samples.tolist())), **dated)
        element.set("StartWL", str(listed[0]))
    else:
        element = _add(values, "CustomSpectrum", **dated)
        for nm, value in zip(spectrum.wavelengths_nm.tolist(), spectrum.samples.tolist(), strict=True):
            _add(element, "SpectralPoint", repr(value), WL=repr(nm))
    element.set("ColorSpecification", specified)
    for colour in entry.stated:
        lab = colour.space == "Lab"
        name = "ColorCIELab" if lab else "ColorEmissiveCIEXYZ" if spectrum.quantity == "emission" else "ColorCIEXYZ"
        stated = _add(values, name)
        stated.set("ColorSpecification", specifications.of(entry, listed, colour.illuminant, colour.observer))
        for axis, value in zip("LAB" if lab else "XYZ", colour.values.tolist(), strict=True):
            _add(stated, axis, repr(value))
    for name, group in (("provenance", tags), ("details", {k: v for k, v in details.items() if k not in _PLACED})):
        if group:
            collection = _add(item, "TagCollection", Name=name)
            for key, value in group.items():
                _add(collection, "Tag", Name=key, Value=value)


def _as_list(entry: SpectralEntry) -> tuple[int, int] | None:
    """First wavelength and step of a list as the schema allows it; None where the spectrum is none."""
    grid, values = entry.spectrum.wavelengths_nm, entry.spectrum.samples
    if grid.size < 2 or not is_uniform(grid):
        return None
    start, step = round(float(grid[0])), round(float(grid[1] - grid[0]))
    even = np.array_equal(grid, start + step * np.arange(grid.size))
    low, high = (0.0, np.inf) if entry.spectrum.quantity == "emission" else _FRACTIONS
    allowed = _STARTS[0] <= start <= _STARTS[1] and step in _STEPS and (values > low).all() and (values < high).all()
    return (start, step) if even and allowed else None


class _Specifications:
    """The ColorSpecifications of a file: one for all values that were measured and computed alike."""

    def __init__(self) -> None:
        from xml.etree.ElementTree import Element

        self.collection = Element(f"{{{NAMESPACE}}}ColorSpecificationCollection")
        self._known: dict[tuple, str] = {}

    def of(
        self,
        entry: SpectralEntry,
        listed: tuple[int, int] | None,
        illuminant: str | None = None,
        observer: str | None = None,
    ) -> str:
        """Return the Id of the specification of a value, which is written where it is the first of its kind."""
        details = entry.details
        said = ("geometry", "condition", "instrument", "calibration", "aperture", "backing", "bandpass corrected")
        key = (entry.spectrum.quantity, listed, illuminant, observer, *(details.get(name, "") for name in said))
        if key in self._known:
            return self._known[key]
        name = self._known[key] = f"specification{len(self._known) + 1}"
        specification = _add(self.collection, "ColorSpecification", Id=name)
        if illuminant is not None and observer is not None:
            _tristimulus(_add(specification, "TristimulusSpec"), illuminant, observer, details.get("method", ""))
        measured = _add(specification, "MeasurementSpec")
        _add(measured, "MeasurementType", _KINDS[entry.spectrum.quantity][1])
        _geometry(_add(measured, "GeometryChoice"), details.get("geometry", ""), entry.spectrum.quantity == "emission")
        if listed:
            _add(measured, "WavelengthRange", StartWL=str(listed[0]), Increment=str(listed[1]))
        for key, element in (("calibration", "CalibrationStandard"), ("aperture", "Aperture"), ("backing", "Backing")):
            if key in details:
                _add(measured, element, details[key])
        light = _LIGHTS.get(details.get("condition", "")[:2])
        if light or "instrument" in details:
            device = _add(measured, "Device")
            if "instrument" in details:
                _add(device, "Model", details["instrument"])
            if light:
                _add(device, "DeviceIllumination", light)
        return name


def _tristimulus(element: Element, illuminant: str, observer: str, method: str) -> None:
    light = re.sub(r"^FL(?=\d)", "F", illuminant)
    if light in _ILLUMINANTS:
        _add(element, "Illuminant", light)
    else:
        _add(element, "Illuminant", "Custom", Name=illuminant)
    if observer in _OBSERVERS:
        _add(element, "Observer", _OBSERVERS[observer])
    else:
        _add(element, "Observer", "Custom_CMF", Name=observer)
    known = ("E308_Table5", "E308_Table6", "E308_1nm")
    _add(element, "Method", method if method in known else "unknown")


def _geometry(choice: Element, told: str, emits: bool) -> None:
    """The geometry in the schema's words where they say the same, else in the record's own."""
    angles = _SINGLE_ANGLE.match(told.strip())
    sphere = re.match(r"(?:8:)?d([ie])(?::8)?\b", told.strip())
    if emits:
        modes = re.search(r"EmissiveMode_(?:Diffuser|Reflected|Other)", told)
        _add(choice, "EmissiveMode", modes[0] if modes else "EmissiveMode_Other")
    elif sphere:
        _add(choice, "SphereGeometry", {"i": "Specular_Included", "e": "Specular_Excluded"}[sphere[1]])
    elif angles and (how := _configuration(angles)):
        single = _add(choice, "SingleAngle")
        _add(single, "SingleAngleConfiguration", how)
        _add(single, "IlluminationAngle", angles[1])
        _add(single, "MeasurementAngle", angles[3])
    else:
        _add(choice, "UnknownGeometry", told.strip() or "not stated")


def _configuration(angles: re.Match[str]) -> str | None:
    """Annular or Uniplanar, as words or as the CIE letters a, c and x; None where neither is said."""
    letters, rest = (angles[2] + angles[4]).lower(), angles[5].lower()
    if "annular" in rest or "circumferential" in rest or letters in ("a", "c"):
        return "Annular"
    return "Uniplanar" if "uniplanar" in rest or letters == "x" else None
