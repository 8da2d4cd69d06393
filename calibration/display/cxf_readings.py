"""Readings of a display in CxF3 (ISO 17972-1): objects with device RGB and the XYZ that were measured of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...runtime.errors import InputError
from ...spectral.formats.cxf import NAMESPACE
from ...spectral.formats.shared.xml import Vocabulary, number, read_xml
from .readings import Readings

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def read_cxf(path: Path, scale: float | None, observer: str) -> Readings:
    """Return every object that has ColorRGB among its DeviceColorValues and ColorCIEXYZ among its ColorValues, in
    cd/m2.

    scale : the full scale of codes, where the file does not give it as MaxRange; where neither does, 255,
    which the schema has for that.

    Raises
    ------
    InputError : not CxF3; no such object; objects with XYZ relative to a diffuser are told by their numbers alone.
    """
    root = read_xml(path)
    known = Vocabulary(root, NAMESPACE)
    codes, xyz, ranges, without = [], [], set(), 0
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
    if not codes:
        raise InputError(
            "no readings of a display",
            field="ObjectCollection",
            found=f"{without} objects, none with both ColorRGB and ColorCIEXYZ",
            expected="objects with device RGB and XYZ",
            hint="export the codes with the readings, or as .ti3 or CSV",
        )
    if len(ranges) > 1:
        raise InputError("codes on several scales", field="MaxRange", found=", ".join(sorted(ranges)), expected="one")
    stated = next(iter(ranges))
    full = number(stated, "MaxRange") if stated else scale or 255.0
    notes = [f"codes are parts of {full:g}"]
    if without:
        notes.append(f"{without} objects without both RGB and XYZ are left out")
    return Readings(np.array(codes) / full, np.array(xyz), str(path), observer=observer, notes=tuple(notes))


def _value(item: Element, known: Vocabulary, group: str, kind: str) -> Element | None:
    for values in known.children(item, group):
        for value in known.children(values, kind):
            return value
    return None
