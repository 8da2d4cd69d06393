"""ColorSpecification of CxF3, for the values that refer to it: wavelengths, quantity, conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..spectrum import Quantity
from .shared.xml import Vocabulary, element_words

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_QUANTITIES: dict[str, Quantity] = {
    "Spectrum_Reflectance": "reflectance",
    "Colorimetric_Reflectance": "reflectance",
    "Spectrum_Transmittance": "transmittance",
    "Spectrum_TotalTransmittance": "transmittance",
    "Colorimetric_Transmittance": "transmittance",
    "Spectrum_Emissive": "emission",
    "Colorimetric_Emissive": "emission",
}
_OBSERVERS = {"2_Degree": "1931_2", "10_Degree": "1964_10"}
_SPHERES = {"Specular_Included": "di:8", "Specular_Excluded": "de:8"}


@dataclass(frozen=True)
class Specification:
    """One ColorSpecification.

    Attributes
    ----------
    start, increment : text of the WavelengthRange, None where there is none.
    quantity : of spectra that do not say it by their own name; None where this does not say it either.
    assumed : how `quantity` was inferred, where MeasurementType leaves it open; None otherwise.
    illuminant, observer : of tristimulus values, as `StatedColour` has them.
    angles : of a multi-angle geometry: notation and angles of each, in the order of the file.
    details : everything as text, under the names that all readers use where there is one.
    """

    start: str | None = None
    increment: str | None = None
    quantity: Quantity | None = None
    assumed: str | None = None
    illuminant: str | None = None
    observer: str | None = None
    angles: tuple[tuple[str, str], ...] | None = None
    details: Mapping[str, str] = field(default_factory=dict)


def specification(element: Element, known: Vocabulary) -> Specification:
    """Read one ColorSpecification; nothing in it is required here."""
    measured, colorimetry = known.child(element, "MeasurementSpec"), known.child(element, "TristimulusSpec")
    grid = known.child(measured, "WavelengthRange")
    geometry, angles = _geometry(known.child(measured, "GeometryChoice"), known)
    told = known.text(measured, "MeasurementType")
    quantity, assumed = _QUANTITIES.get(told), None
    if quantity is None:
        quantity, assumed = _by_geometry(known.child(measured, "GeometryChoice"), known, told)
    illuminant, observer = _conditions(colorimetry, known)
    device = known.child(measured, "Device")
    light = known.child(device, "DeviceIllumination")
    filtered = known.child(device, "DeviceFilter")
    details = {
        "specification": element.get("Id", ""),
        "measurement": told,
        "geometry": geometry,
        "condition": "" if light is None else _condition(light),
        "instrument": " ".join(
            text for name in ("Manufacturer", "Model", "SerialNumber") if (text := known.text(device, name))
        ),
        "instrument class": known.text(device, "DeviceClass"),
        "filter": "" if filtered is None else element_words(filtered),
        "polarisation": known.text(device, "DevicePolarization"),
        "calibration": known.text(measured, "CalibrationStandard"),
        "aperture": known.text(measured, "Aperture"),
        "backing": known.text(measured, "Backing"),
        "bandpass corrected": known.text(measured, "BandpassCorrected"),
        "luminance units": known.text(measured, "LuminanceUnitsType"),
        "illuminant": illuminant or "",
        "observer": observer or "",
        "method": known.text(colorimetry, "Method"),
    }
    own = known.child(colorimetry, "CustomIlluminant")
    if own is not None:
        details["custom illuminant"] = element_words(own)
    physical = known.child(element, "PhysicalAttributes")
    if physical is not None:
        details["specified sample"] = element_words(physical)
    return Specification(
        None if grid is None else grid.get("StartWL"),
        None if grid is None else grid.get("Increment"),
        quantity,
        assumed,
        illuminant,
        observer,
        angles,
        {name: text for name, text in details.items() if text},
    )


def _condition(light: Element) -> str:
    """Return the ISO 13655 letter first ("M1_Daylight" -> "M1 (M1_Daylight)"), custom ones in their own words."""
    told = (light.text or "").strip()
    custom = light.get("CustomType", "")
    letter = told.partition("_")[0]
    text = f"{letter} ({told})" if letter in ("M0", "M1", "M2", "M3") else told
    return f"{text}: {custom}" if custom else text


def _geometry(choice: Element | None, known: Vocabulary) -> tuple[str, tuple[tuple[str, str], ...] | None]:
    """Text such as "45:0 annular" or "di:8", and the notations and angles that a multi-angle specification lists."""
    for element in known.children(choice):
        name, text = known.name(element), (element.text or "").strip()
        if name == "SingleAngle":
            light, eye = (known.text(element, angle) for angle in ("IlluminationAngle", "MeasurementAngle"))
            how = known.text(element, "SingleAngleConfiguration").lower()
            return f"{_degrees(light)}:{_degrees(eye)} {how}".strip(), None
        if name == "SphereGeometry":
            told = text or " ".join(element_words(element).split())
            return (f"{_SPHERES[told]} ({told})" if told in _SPHERES else f"sphere, {told}"), None
        if name == "MultiAngle":
            angles: list[tuple[str, str]] = []
            for number, angle in enumerate(known.children(element, "BRDFAngle"), 1):
                light, away, turned = (known.text(angle, n) for n in ("IlluminationAngle", "Aspecular", "Azimuth"))
                line = f"light {_degrees(light)}, aspecular {_degrees(away)}"
                line += f", azimuth {_degrees(turned)}" if turned else ""
                angles.append((angle.get("Notation") or str(number), line))
            return "; ".join(f"{notation}: {line}" for notation, line in angles), tuple(angles)
        if name == "EmissiveMode":
            return f"emissive, {text}", None
        return text or element_words(element), None
    return "", None


def _degrees(text: str) -> str:
    try:
        return f"{float(text):g}"
    except ValueError:
        return text or "?"


def _by_geometry(choice: Element | None, known: Vocabulary, told: str) -> tuple[Quantity | None, str | None]:
    """Tell a custom measurement by what its geometry can only measure; a sphere measures two things."""
    name = next((known.name(element) for element in known.children(choice)), None)
    kinds: dict[str | None, Quantity] = {
        "SingleAngle": "reflectance",
        "MultiAngle": "reflectance",
        "EmissiveMode": "emission",
    }
    if name not in kinds:
        return None, None
    return kinds[name], f"MeasurementType {told or 'missing'} is taken as {kinds[name]}, after its geometry ({name})"


def _conditions(element: Element | None, known: Vocabulary) -> tuple[str | None, str | None]:
    """Illuminant and observer in our names where they are ours, else in the file's words."""
    light, own = known.child(element, "Illuminant"), known.child(element, "CustomIlluminant")
    illuminant = None
    if light is not None:
        illuminant = (light.text or "").strip()
        illuminant = light.get("Name", "custom") if illuminant in ("", "Custom") else illuminant
    elif own is not None:
        illuminant = own.get("Name", "custom")
    eye = known.child(element, "Observer")
    told = "" if eye is None else (eye.text or "").strip()
    if told == "Custom_CMF" and eye is not None:
        told = eye.get("Name", told)
    return illuminant, _OBSERVERS.get(told, told) or None
