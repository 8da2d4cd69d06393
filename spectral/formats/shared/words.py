"""What the words of a measured file say: quantity, unit, illuminant, observer, measurement condition."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Literal, get_args

import numpy as np

from ...spectrum import Quantity
from ..reading import StatedColour

Unit = Literal["percent", "fraction"]

_RADIANCE_FACTOR = re.compile(r"radiance[ _-]*factor|strahldichtefaktor", re.I)
_REFLECTANCE = re.compile(
    r"reflect(?!or)|geometr|\d+as-?\d+|\bas-?\d{2,3}\b|r[eé]mission|albedo|%\s*R\b|\bR\s*[\[(]?%|\bR\d?$|\bR(?:SCI|SCE)\b|\bSC[IE]\b|\bpaint",
    re.I,
)
_TRANSMITTANCE = re.compile(r"transm|%\s*T\b|\bT\s*[\[(]?%|\bT$|durchlicht", re.I)
_EMISSION = re.compile(
    r"irradian|radian(?:ce|t|cy)|emissi(?:on|ve)\b|\bspd\b|spectral[ _]*power|power[ _]*distribution|"
    r"(?<![a-z])luminance|illuminance|bestrahlung|strahldichte|"
    r"[mµμunp]?W\s*(?:/|\*|·|\.|\s)?\s*(?:\(?\s*(?:c?m\s*(?:\^|\*\*)?-?[2²]|sr|nm|[µu]m)|m⁻²|cm⁻²)|counts?\b|photon|"
    r"\bCCT\b|\blux\b|\[lx\]",
    re.I,
)
_ABSORBANCE = re.compile(
    r"absorb|(?:^|[\s,;|])abs\.?(?:$|\s*[\[(])|\bA\.?U\.?$|log\s*\(?\s*1\s*/\s*[RT]|\bK/S\b|optical density|F\(R\)",
    re.I,
)
_INDEX = re.compile(r"refractive|extinction|\.(?:eta|k)$|\bior\b", re.I)
# What lights are called, where nothing says what was measured.
_LIGHT = re.compile(
    r"illumi|\blamps?\b|\bleds?\b|daylight(?! fluo)|tungsten|xenon|halogen|sunlight|skylight|incandescent|"
    r"(?<![A-Za-z0-9])D(?:50|55|65|75|93)(?![0-9])|^FL\d{1,2}$",
    re.I,
)
_PERCENT = re.compile(r"%|percent|\bpct\b|_pct|prozent|pour ?cent", re.I)
_FRACTION = re.compile(
    r"\b0(?:\.0)?\s*(?:\.\.+|-|–|to)\s*1(?:\.0)?\b|fraction|decimal|\b_?dec\b|\[-\]|unitless|dimensionless", re.I
)

_ILLUMINANT = r"D\s?(?:50|55|65|75|93)|F\s?L?\s?\d{1,2}|FL\d{1,2}|LED-[BV]\w+|ID(?:50|65)|(?-i:[ABCE])"
_NAMED_ILLUMINANT = re.compile(
    rf"(?:illumin\w*|source|light|ill)\W{{0,3}}(?:name\W{{0,3}})?(?:CIE\s*)?({_ILLUMINANT})\b", re.I
)
_PLAIN_ILLUMINANT = re.compile(r"(?<![A-Za-z0-9])(D\s?(?:50|55|65|75|93)|FL?\s?\d{1,2})(?![0-9])")
_WITH_ANGLE = re.compile(rf"(?<![A-Za-z0-9])({_ILLUMINANT})\s*[/,_ -]\s*(?:2|10)\s*(?:°|deg|º|$|[)\]])", re.I)
_OBSERVER = re.compile(
    r"(?:viewing angle|field of view)\D{0,8}(2|10)\b|"
    r"(?<![\d.,])(2|10)(?:\.0+)?\s*(?:°|º|deg|_?degree)|observer\w*\W{0,4}(?:angle\W{0,4})?(?:CIE\s*)?(2|10|1931|1964)\b|"
    r"CIE\s*_?(1931|1964)|(?:D\d\d|[AC]|FL?\d{1,2})\s*[/_-]\s*(2|10)\b",
    re.I,
)
_ANGLE = {"2": "1931_2", "1931": "1931_2", "10": "1964_10", "1964": "1964_10"}
_CONDITION = re.compile(r"(?<![A-Za-z0-9])(M[0-3])(?![0-9A-Za-z])")


def _one_line(words: str) -> str:
    """Words with single spaces, no longer than any header: what patterns are tried on stays small."""
    return " ".join(words[:8000].split())


def quantity_in(words: str) -> Quantity | Literal["absorbance", "index"] | None:
    """What words say is measured, None if they do not; absorbance and refractive indices are told, to be refused."""
    words = _one_line(words)
    if _ABSORBANCE.search(words):
        return "absorbance"
    if _INDEX.search(words):
        return "index"
    if _RADIANCE_FACTOR.search(words):
        return "radiance factor"
    through, back = _TRANSMITTANCE.search(words), _REFLECTANCE.search(words)
    if through or back:
        return None if through and back else "transmittance" if through else "reflectance"
    return "emission" if _EMISSION.search(words) else None


def measured(told: str | None) -> Quantity | None:
    """The quantity that `quantity_in` told, None where it told none or one that is no spectrum of a colour."""
    return {name: name for name in get_args(Quantity)}.get(told)


def names_light(words: str) -> bool:
    """Whether a name is that of a light, such as "D65", "LED 4000 K" or "Tungsten"."""
    return bool(_LIGHT.search(_one_line(words).replace("_", " ")))


def unit_in(words: str) -> Unit | None:
    """Whether words say percent or fractions of 1, None if they do not."""
    words = _one_line(words)
    if _PERCENT.search(words):
        return "percent"
    return "fraction" if _FRACTION.search(words) else None


def illuminant_in(words: str) -> str | None:
    """Name of the illuminant in words such as "Illumination=D50", "D65/10°" or "A", as `illuminant` knows it."""
    words = _one_line(words).strip("\"'")
    exact = re.fullmatch(rf"(?:CIE\s*)?(?:(?:std|standard)\.?\s*)?(?:illuminant\s*)?({_ILLUMINANT})", words, re.I)
    found = exact or _NAMED_ILLUMINANT.search(words) or _WITH_ANGLE.search(words) or _PLAIN_ILLUMINANT.search(words)
    if found is None:
        return None
    name = re.sub(r"\s", "", found[1]).upper()
    return re.sub(r"^F(?=\d)", "FL", name)


def observer_in(words: str) -> str | None:
    """Short name of the standard observer in words such as "ObserverAngle=2", "10°" or "CIE 1931"."""
    words = _one_line(words).strip("\"'")
    if words in _ANGLE:
        return _ANGLE[words]
    found = _OBSERVER.search(words)
    return _ANGLE[next(group for group in found.groups() if group)] if found else None


def condition_in(words: str) -> str | None:
    """Measurement condition of ISO 13655, "M0" to "M3"."""
    found = _CONDITION.search(_one_line(words))
    return found[1] if found else None


_COLOUR_COLUMN = re.compile(
    r"(?:tristimulus(?: values?)? )?(?:(?P<space>XYZ|CIE[ _]?XYZ|LAB|CIE[ _]?LAB|CIE)[ _.:-]+)?"
    r"(?P<axis>X|Y|Z|L|a|b) ?\*?(?P<rest>$|[ (\[/,_].*)",
    re.I,
)


def colour_axis(header: str) -> tuple[str, int] | None:
    """("XYZ", 0..2) or ("Lab", 0..2) of a column such as XYZ_X, "L*", "LAB_B" or "a*(10°/D65)", None of any other."""
    match = _COLOUR_COLUMN.match(_one_line(header))
    if match is None:
        return None
    axis, space = match["axis"].upper(), (match["space"] or "").upper()
    if axis in "XYZ" and "LAB" not in space:
        # Lower-case x, y, z without a space before them are chromaticity coordinates.
        return ("XYZ", "XYZ".index(axis)) if space or match["axis"].isupper() else None
    if axis in "LAB" and "XYZ" not in space:
        starred = "*" in header or "LAB" in space or "CIE" in space
        return ("Lab", "LAB".index(axis)) if starred or match["axis"] in ("L", "a", "b") else None
    return None


def stated_colours(
    cells: Mapping[str, float], illuminant: str | None = None, observer: str | None = None
) -> tuple[StatedColour, ...]:
    """Tristimulus values among cells by header; an illuminant and observer in a header go before those given."""
    found: dict[tuple[str, str | None, str | None], dict[int, float]] = {}
    for header, value in cells.items():
        axis = colour_axis(header)
        if axis is None or not np.isfinite(value):
            continue
        own = header.partition("(")[2].rstrip(" )]") or header
        key = (axis[0], illuminant_in(own) if "(" in header else None, observer_in(own))
        found.setdefault(key, {}).setdefault(axis[1], float(value))
    stated = []
    for (space, light, angle), values in found.items():
        if len(values) == 3:
            triple = np.array([values[index] for index in range(3)])
            stated.append(
                StatedColour(
                    "XYZ" if space == "XYZ" else "Lab",
                    triple,
                    light or illuminant,
                    angle or observer,
                )
            )
    return tuple(stated)
