"""Readings of a display in CxF3 (ISO 17972-1): objects with device RGB and the measured XYZ."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.formats.cxf import NAMESPACE
from ...spectral.formats.cxf_specification import Specification, specification
from ...spectral.formats.shared.xml import Vocabulary, number, read_xml

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


@dataclass(frozen=True, eq=False)
class CxfReadings:
    """Codes and XYZ of a file. full_scale, observer : as stated; None if they are not."""

    codes: Float[np.ndarray, "N 3"]
    xyz: Float[np.ndarray, "N 3"]
    full_scale: float | None
    observer: str | None
    notes: tuple[str, ...]


def read_cxf(path: Path) -> CxfReadings:
    """Return every object that has ColorRGB among its DeviceColorValues and ColorCIEXYZ among its ColorValues.

    Raises
    ------
    InputError : not CxF3; no such object; objects that reflect or transmit; codes on several scales, or XYZ of several
        observers.
    """
    root = read_xml(path)
    known = Vocabulary(root, NAMESPACE)
    told = {
        one.get("Id", ""): specification(one, known) for one in root.iter() if known.name(one) == "ColorSpecification"
    }
    codes, xyz, ranges, observers, without = [], [], set(), set(), 0
    for item in (one for one in root.iter() if known.name(one) == "Object"):
        rgb, seen = (
            _value(item, known, "DeviceColorValues", "ColorRGB"),
            _value(item, known, "ColorValues", "ColorCIEXYZ"),
        )
        if rgb is None or seen is None:
            without += 1
            continue
        name = item.get("Name") or item.get("Id") or "an object"
        codes.append([number(known.text(rgb, channel), f"{name}, {channel}") for channel in "RGB"])
        xyz.append([number(known.text(seen, part), f"{name}, {part}") for part in "XYZ"])
        ranges.add(known.text(rgb, "MaxRange"))
        how = told.get(seen.get("ColorSpecification", ""), Specification())
        if how.quantity in ("reflectance", "transmittance"):
            raise InputError(
                "readings of something else than a display",
                field=f"{name}, MeasurementType",
                found=how.details.get("measurement") or how.quantity,
                expected="emission",
                hint="name the file that was measured on the screen",
            )
        observers.add(how.observer)
    if not codes:
        raise InputError(
            "no readings of a display",
            field="ObjectCollection",
            found=f"{without} objects, none with both ColorRGB and ColorCIEXYZ",
            expected="objects with device RGB and XYZ",
            hint="export the codes with the readings, or as .ti3 or CSV",
        )
    for field, several in (("MaxRange", ranges), ("Observer", observers)):
        if len(several) > 1:
            found = ", ".join(sorted(str(one or "none") for one in several))
            raise InputError(
                "readings that are not alike", field=field, found=found, expected="one", hint="split the file"
            )
    stated = next(iter(ranges))
    notes = (f"{without} objects without both RGB and XYZ are left out",) if without else ()
    full_scale = number(stated, "MaxRange") if stated else None
    return CxfReadings(np.array(codes), np.array(xyz), full_scale, next(iter(observers)), notes)


def _value(item: Element, known: Vocabulary, group: str, kind: str) -> Element | None:
    for values in known.children(item, group):
        for value in known.children(values, kind):
            return value
    return None
