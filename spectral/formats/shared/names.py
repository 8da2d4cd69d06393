"""What the name of a file, of a sample or of a variable hints at, where nothing says what was measured.

A name is a hint and no more: a paint may be called after a lamp. `signs` weighs it with the others.
"""

from __future__ import annotations

import re
from typing import Literal

from ...spectrum import Quantity
from .words import names_light, names_perhaps_light, quantity_in

Meaning = Quantity | Literal["sensitivity"]

_SURFACE = re.compile(
    r"colou?r ?checker|colou?r ?chart|munsell|macbeth|pantone|(?<![a-z])(?:ncs|ral|bcra|swatch(?:es)?|paints?|"
    r"pigments?|patch(?:es)?|tiles?|chips?|fabrics?|textiles?|cloth(?:es)?|woods?|papers?|leather|skins?|lea(?:f|ves)|soils?|"
    r"vegetation|minerals?|rocks?|ceramics?|inks?|dyes?|albedo|natural objects?)(?![a-z])",
    re.I,
)
_CLEAR = re.compile(
    r"(?<![a-z])(?:filters?|glass(?:es)?|lens(?:es)?|gels?|windows?|schott|hoya|wratten|roscolux|goggles?|visor)(?![a-z])",
    re.I,
)
_SENSOR = re.compile(
    r"sensitivit|responsivit|(?<![a-z])(?:cmfs?|qe|cameras?|sensors?|cones?|lms|observers?|photopic|scotopic|v ?lambda|"
    r"luminosity|fundamentals?|[xyz] ?bar|ccd|photodiodes?|detectors?)(?![a-z])|colou?r.?match",
    re.I,
)


def meant_by(name: str) -> frozenset[Meaning]:
    """What a name hints at; several things, or nothing.

    >>> meant_by("LED panel.txt") == {"emission"}, meant_by("blue filter 2") == {"transmittance"}, meant_by("run 7")
    (True, True, frozenset())
    """
    words = " ".join(re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", name[:400]).split())
    found: set[Meaning] = set()
    told = quantity_in(words) if len(words) > 2 else None
    if told in ("reflectance", "transmittance", "radiance factor", "emission"):
        found.add(told)
    if names_light(words) or names_perhaps_light(words):
        found.add("emission")
    if _SURFACE.search(words):
        found.add("reflectance")
    if _CLEAR.search(words):
        found.add("transmittance")
    if _SENSOR.search(words):
        found.add("sensitivity")
    return frozenset(found)
