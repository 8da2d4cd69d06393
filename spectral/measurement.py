"""Conditions of a measurement: quantity, geometry, specular component, M condition, filter, polarisation, backing.

They determine whether two readings are comparable. They are parsed from the words of a file, by label: those of CxF3
and CGATS.17, and of headers of instruments' text. Geometries are compared by their numbers, 0:45 as 45:0 (light and
detector may be exchanged, by Helmholtz reciprocity), sphere geometries with their specular component (CIE 015:2018, 5).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, NamedTuple, get_args

from ..runtime.errors import visible
from .spectrum import Quantity

#: Differences of conditions that a person may ask to compare across.
AllowedDifference = Literal["geometry", "condition"]
ALLOWED_DIFFERENCES: tuple[AllowedDifference, ...] = get_args(AllowedDifference)
#: Parts of a measurement that must be alike, and what allows them not to be; None: nothing does.
MUST_AGREE: dict[str, AllowedDifference | None] = {
    "quantity": None,
    "geometry": "geometry",
    "specular component": "geometry",
    "measurement condition": "condition",
    "filter": "condition",
    "polarisation": "condition",
    "backing": "condition",
    "white base": "condition",
    "film": "condition",
}
#: Parts that a note is made of where they are not alike.
NOTED = ("configuration", "material", "calibration standard", "aperture", "instrument", "data mode")
#: Degrees within which two angles are one.
ALIKE_DEGREES = 0.5

# Labels by which a part is known, as whole labels in lower case with single spaces.
_LABELS: tuple[tuple[str, re.Pattern[str]], ...] = (
    ("source", re.compile(r"measurement source|meas(?:urement)? ?parameters?|bieri info \d")),
    ("specular component", re.compile(r".*\bspecular\b.*|sc[ie] ?/? ?sc[ie]|gloss trap|spin ?/? ?spex")),
    ("geometry", re.compile(r".*geometr(?:y|i[ea])|(?:std|bat)? ?viewing|measur(?:ing|ement) mode")),
    ("polarisation", re.compile(r".*\bpolari[sz]ation(?: filter)?|pol(?:ari[sz]ing)? ?filter|polari[sz]er")),
    ("measurement condition", re.compile(
        r"(?:measurement |meas |m )?conditions?|m ?standard|(?:device )?illumination(?: mode| condition)?|iso 13655")),
    ("filter", re.compile(r"(?:instrument |device |measurement |physical |uv )?filter(?: status| type| name)?|uv|uv mode|uv setting")),  # noqa: E501
    ("uv cut", re.compile(r"uv (?:cut(?: ?off)?|exclusion|block(?:ing)?|sperre)(?: filter)?")),
    ("backing", re.compile(
        r"(?:sample )?(?:backing|background)|(?:sample )?underlay|unterlage|(?:mess)?hintergrund|support")),
    ("white base", re.compile(r"white ?base")),
    ("material", re.compile(r"material|substrate|medium")),
    ("calibration standard", re.compile(r"calibration(?: standard)?")),
    ("aperture", re.compile(
        r"(?:measuring |viewing |target )?(?:aperture|area|spot|mask)(?: size)?|(?:area|field) of view|blende")),
    ("instrument", re.compile(r"(?:target )?instrument(?:ation)?|device model")),
    # Readings as another instrument would give them.
    ("data mode", re.compile(r".*\bdata ?mode")),
    # Words that may be anything, and of which some say what was measured.
    ("gloss", re.compile(r"gloss(?: component| mode)?|glanz(?:einschluss|komponente|modus)?|brilliance")),
    ("anything", re.compile(r"units?|(?:mess)?mod(?:e|us)|mask/gloss|options?|settings?")),
    # Sentences, in which a part stands with its label.
    ("comment", re.compile(r"(?:object |user )?(?:comments?|remarks?|notes?|bemerkung(?:en)?|kommentare?|remarques?)")),
)  # fmt: skip
# Elements of the parts in CxF3.
_CXF = {
    "geometry": "GeometryChoice",
    "condition": "DeviceIllumination",
    "filter": "DeviceFilter",
    "polarisation": "DevicePolarization",
    "backing": "Backing",
    "calibration": "CalibrationStandard",
    "aperture": "Aperture",
    "instrument": "Device",
    "measurement": "MeasurementType",
}
_INSIDE = re.compile(r"([A-Za-z_ ]+?)\s*[=:]\s*([^\s,;]+)")
_IN_SOURCE = {
    "whitebase": "white base",
    "filter": "filter",
    "measurementcondition": "measurement condition",
    "condition": "measurement condition",
    "polarization": "polarisation",
    "geometry": "geometry",
    "backing": "backing",
}
_NUMBER = r"\d+(?:\.\d+)?"
_SIGNED = rf"(?:-|_|minus ?|\u2212)?\s*{_NUMBER}"
_NOTATION = re.compile(
    rf"(?<![A-Za-z0-9.])(?:r?({_NUMBER})\s*°?\s*[:/]?\s*)?r?as\s*({_SIGNED})(?:\s*°?\s*az\s*({_SIGNED}))?(?![A-Za-z0-9])",
    re.I,
)
#: An angle in a name: unlike in a field of geometries, that of the light has to be there.
ANGLE_NOTATION = re.compile(
    rf"(?<![A-Za-z0-9.])r?({_NUMBER})\s*°?\s*[:/]?\s*as\s*({_SIGNED})(?:\s*°?\s*az\s*({_SIGNED}))?(?![A-Za-z0-9])",
    re.I,
)
#: An aspecular angle in a name that does not have that of the light, before or behind the word.
ANGLE_WITHOUT_LIGHT = re.compile(
    rf"(?<![A-Za-z0-9.])(?:r?as(?:p(?:ec(?:ular)?)?)?\.?\s*({_SIGNED})|((?:-|\u2212)?{_NUMBER})\s*°?\s*as(?:p(?:ec(?:ular)?)?)?)(?![A-Za-z0-9])",
    re.I,
)
_LISTED = re.compile(rf"light (-?{_NUMBER}), aspecular (-?{_NUMBER})(?:, azimuth (-?{_NUMBER}))?(?=;|$)")
_SPHERE = re.compile(
    r"(?<![a-z])d[ie]?\s*°?\s*[:/]\s*(\d+)|(?<![\d.])(\d+)\s*°?\s*[:/]\s*d[ie]?(?![a-z])|(?<![a-z])d(?:[ie])?([08])(?!\d)|diffuse\s*[:/]\s*(\d+)",
    re.I,
)
_IS_SPHERE = re.compile(r"sphere|kugel|specular_(?:in|ex)cluded|\bSC[IE]\b|ulbricht|(?<![a-z])diffuse", re.I)
_ANGLES = re.compile(rf"(?<![\d.])({_NUMBER})\s*°?\s*[acx]?\s*[:/-]\s*({_NUMBER})(?![\d.])", re.I)
_INCLUDED = re.compile(
    r"specular[ _]?(?:component )?incl|"
    r"\bSCI\b|\bSPINC?\b|\bRSIN\b|^[A-Z]{1,3}/I$|(?<![a-z])di\s*[:/]|[:/]\s*di(?![a-z])",
    re.I,
)
_EXCLUDED = re.compile(
    r"specular[ _]?(?:component )?excl|"
    r"\bSCE\b|\bSPEXC?\b|\bRSEX\b|^[A-Z]{1,3}/E$|(?<![a-z])de\s*[:/]|[:/]\s*de(?![a-z])",
    re.I,
)
_YES = re.compile(r"incl|^(?:yes|true|on|1|in|i|ein|ja|mit|with|crossed|pol\w*)\b|closed", re.I)
_NO = re.compile(
    r"excl|^(?:no|none|false|off|0|out|e|ex|aus|nein|ohne|without|unpolari[sz]ed|not)\b|\bnone\b|open", re.I
)
# No filter at all, one that polarises among them; "Filter_None" of CxF3 is of ultraviolet alone.
_NO_FILTER = re.compile(r"no(?:ne)?|off|without|ohne|keine?r?", re.I)
_CUT = re.compile(r"cut|\b[34]\d0\s*nm", re.I)
_LETTER = re.compile(r"(?<![A-Za-z0-9])M([0-3])(?![0-9A-Za-z])")
_UNKNOWN = re.compile(r"(?:|-+|\?|n/?a|unknown|not (?:stated|known)|unspecified|unbekannt)", re.I)
_FILM = re.compile(r"\b(?:film|foil|transparen\w+|translucent|slide|dia|folie)\b", re.I)
_BACKINGS = {
    "white": r"white|wei(?:ss|ß)|blanc",
    "black": r"black|schwarz|noir",
    "self": r"self|own|stack\w*|pile",
    "substrate": r"substrate",
}

_COLOUR = "|".join(_BACKINGS[name] for name in ("white", "black"))
_BACKING_IN_NAME = re.compile(
    rf"\b(?:over|on|above|auf|ueber|über|sur) ({_COLOUR})\b|\b({_COLOUR}) (?:backing|background|underlay)\b", re.I
)
_UV_IN_NAME = re.compile(r"\bUV ?(?:(incl\w*|on|in|with)|excl\w*|cut|off|ex|without)\b", re.I)
_SPECULAR_IN_NAME = re.compile(r"\b(?:specular|gloss)(?: component)? (?:(incl)|excl)", re.I)
_POLARISED_IN_NAME = re.compile(r"\b(?:(?P<no>(?:un|non) ?)|cross(?:ed)? )?polari[sz](?:ed|ers?)\b", re.I)
# Digits beside it would be of a chip's notation or a date.
_GEOMETRY_IN_NAME = re.compile(
    r"(?<![\w./:])(?:45°?[acx]?[:/]0°?|0°?[:/]45°?[acx]?|d[ie]?[:/]\s?8°?|8°?[:/]d[ie]?)(?![\w./:])", re.I
)
# In the name of a file neither a slash nor a colon stands between them.
_GEOMETRY_IN_FILE_NAME = re.compile(
    r"(?<![A-Za-z0-9])(?<!\d[-_ ])(?:45[-_ ]0|0[-_ ]45|d[-_ ]?8|8[-_ ]?d)(?![A-Za-z0-9])(?![-_ ]\d)", re.I
)

_KINDS = ("directional", "sphere", "multi-angle")


class Geometry(NamedTuple):
    """Angles of light and detector in degrees, as far as they are stated.

    kind : "directional" (45:0), "sphere" (d:8), "multi-angle" (45as15) or other words of the file. first, second : of
    directional geometries the larger and the smaller angle; of a sphere that of its one direction; of multi-angle ones
    the light's and the aspecular one. azimuth : of the detector about the mirror direction: 0 in the plane of incidence
    beyond it, 180 in it towards the light, the default.
    """

    kind: str
    first: float | None = None
    second: float | None = None
    azimuth: float = 180.0

    @property
    def notation(self) -> str:
        """Notation of a multi-angle geometry, such as "45as-15"; the kind of others."""
        if self.kind != "multi-angle" or self.second is None:
            return self.kind
        turned = "" if self.azimuth == 180.0 else f"az{self.azimuth:g}"
        return f"{'' if self.first is None else f'{self.first:g}'}as{self.second:g}{turned}"

    @property
    def is_known(self) -> bool:
        """True for known kinds."""
        return self.kind in _KINDS

    def matches(self, other: Geometry) -> bool:
        """Return whether both are equal within `ALIKE_DEGREES`; an angle that is not stated matches any."""
        if self.kind != other.kind:
            return False
        angles = ((self.first, other.first), (self.second, other.second), (self.azimuth, other.azimuth))
        return all(one is None or two is None or abs(one - two) <= ALIKE_DEGREES for one, two in angles)


#: Label of the name of its file among the details of a reading.
FILE_NAME = "file name"
_CONDITION_IN_NAME = re.compile(r"(?<![A-Za-z0-9])M[0-3](?![0-9A-Za-z])")


class StatedPart(NamedTuple):
    """One part of a measurement: the compared value, the words of the file, and their field."""

    value: str | bool | Geometry
    words: str
    field: str

    def matches(self, other: StatedPart) -> bool:
        """Return whether both agree."""
        if isinstance(self.value, Geometry) and isinstance(other.value, Geometry):
            return self.value.matches(other.value)
        return self.value == other.value


@dataclass(frozen=True)
class Measurement:
    """Parts of a measurement by their names in `MUST_AGREE` and `NOTED`; parts that are not stated are missing."""

    parts: Mapping[str, StatedPart] = field(default_factory=dict)

    @classmethod
    def of(cls, quantity: Quantity | None, details: Mapping[str, str], name: str = "") -> Measurement:
        """Parse the measurement from the details of a reading.

        Parameters
        ----------
        quantity : of its spectrum; None for a colour alone.
        details : as returned by readers; `format` among them identifies labels of CxF3, and `FILE_NAME` may state
            further parts.
        name : of the reading, which may state its specular component or its angle.
        """
        parts: dict[str, StatedPart] = {}
        for label, words in details.items():
            if isinstance(words, str):
                for part, said in _parts(label, words, details.get("format") == "CxF3"):
                    parts.setdefault(part, said)
        for part, said in _in_name(name):
            stated = parts.get(part)
            # Words such as "multi-angle" leave the angle to the name.
            if stated is None or (isinstance(stated.value, Geometry) and not stated.value.is_known):
                parts[part] = said
        for part, said in _in_file_name(details.get(FILE_NAME, "")):
            parts.setdefault(part, said)
        if "polarisation" not in parts and (m := parts.get("measurement condition")) and m.value == "M3":
            parts["polarisation"] = StatedPart(True, m.words, m.field)
        if "polarisation" not in parts and (no := parts.get("filter")) and _NO_FILTER.fullmatch(no.words):
            parts["polarisation"] = StatedPart(False, no.words, no.field)
        kind = quantity or _quantity_of(details)
        if kind in ("reflectance", "radiance factor", "transmittance"):
            # A reflectance above 1 is held as a radiance factor: both are what a surface sends back.
            value = "transmittance" if kind == "transmittance" else "reflectance"
            stated = details.get("measurement", "")
            parts["quantity"] = StatedPart(value, stated or kind, "MeasurementType" if stated else "quantity")
        return cls(parts)

    @property
    def geometry(self) -> Geometry | None:
        """Geometry, None if it is not stated."""
        said = self.parts.get("geometry")
        return said.value if said is not None and isinstance(said.value, Geometry) else None

    @property
    def words(self) -> dict[str, str]:
        """All stated parts, in words."""
        return {part: said.words for part, said in self.parts.items()}

    def differing(self, other: Measurement) -> tuple[str, ...]:
        """Return the parts of `MUST_AGREE` that both state differently."""
        return tuple(part for part in MUST_AGREE if self._differs(other, part))

    def noted(self, other: Measurement) -> tuple[str, ...]:
        """Return the parts of `NOTED` that both state differently."""
        return tuple(part for part in NOTED if self._differs(other, part))

    def silent(self, other: Measurement) -> tuple[str, ...]:
        """Return the parts of `MUST_AGREE` that only the other states."""
        return tuple(part for part in MUST_AGREE if part in other.parts and part not in self.parts and part != "film")

    def _differs(self, other: Measurement, part: str) -> bool:
        one, two = self.parts.get(part), other.parts.get(part)
        return one is not None and two is not None and not one.matches(two)


class Side(NamedTuple):
    """One side of a comparison: its name, its file, and its measurement."""

    name: str
    source: str
    measurement: Measurement


def why_not_comparable(one: Side, other: Side, across: Collection[AllowedDifference]) -> str:
    """Return the reason why two readings are not comparable, over several lines; "" if they are."""
    parts = [part for part in one.measurement.differing(other.measurement) if MUST_AGREE[part] not in across]
    if not parts:
        return ""
    ask = list(dict.fromkeys(MUST_AGREE[part] for part in parts))
    hint = "measure both alike"
    if None not in ask:
        hint += f", or compare them all the same with --across {','.join(str(word) for word in ask)}"
    lines = [f"{one.name} of {one.source} and {other.name} of {other.source} were not measured alike"]
    lines += [f"  found: {_difference(one, other, part)}" for part in parts]
    lines += [f"  expected: one {' and one '.join(parts)} on both sides", f"  try: {hint}"]
    return visible("\n".join(lines), lines=True)


def _difference(one: Side, other: Side, part: str) -> str:
    """Describe a part that differs: both sides' words, each with its field and file."""
    first, second = (side.measurement.parts[part] for side in (one, other))
    ends = [f"{said.field} {said.words!r} in {side.source}" for said, side in ((first, one), (second, other))]
    return f"{part}: {ends[0]}, {ends[1]}"


def crossed(one: Side, other: Side) -> tuple[str, ...]:
    """Describe measurement differences of a comparison that was made nevertheless."""
    return tuple(
        f"Compared across unlike conditions, as asked: {_difference(one, other, part)}."
        for part in one.measurement.differing(other.measurement)
    )


def remarks(one: Side, other: Side) -> tuple[str, ...]:
    """Describe parts that only one side states, and differences of instruments and settings."""
    found = []
    for silent, told in ((one, other), (other, one)):
        if parts := silent.measurement.silent(told.measurement):
            stated = ", ".join(f"{part} ({told.measurement.parts[part].words})" for part in parts)
            found.append(
                f"{silent.name} of {silent.source} does not state what {told.name} of {told.source} does: {stated}."
            )
    for part in one.measurement.noted(other.measurement):
        found.append(f"Not alike, and compared: {_difference(one, other, part)}.")
    return tuple(found)


def geometry_in(words: str) -> Geometry | None:
    """Parse a geometry in words, such as "45/0", "d:8 SCI" or "45as-15"; None if they state several angles.

    >>> geometry_in("0°:45°a") == geometry_in("45/0"), geometry_in("45as-15").second
    (True, -15.0)
    """
    text = " ".join(words.split())
    listed = _LISTED.findall(text)
    if len(listed) == 1:
        return _several(*listed[0])
    if len(listed) > 1:
        return None
    if found := _NOTATION.search(text):
        return _several(found[1] or "", found[2], found[3] or "")
    if found := _SPHERE.search(text):
        return Geometry("sphere", float(next(group for group in found.groups() if group)))
    if (found := _ANGLES.search(text)) and not _IS_SPHERE.search(text):
        one, two = float(found[1]), float(found[2])
        return Geometry("directional", max(one, two), min(one, two))
    return Geometry("sphere") if _IS_SPHERE.search(text) else Geometry(text.casefold())


def at_an_angle(name: str) -> bool:
    """Return whether a name belongs to a reading at an aspecular angle, whose reflectance may be far above 1."""
    return bool(ANGLE_NOTATION.search(name) or ANGLE_WITHOUT_LIGHT.search(name))


def _several(light: str, aspecular: str, azimuth: str) -> Geometry:
    one, two = (float(light) if light else None), signed(aspecular)
    turned = signed(azimuth) % 360.0 if azimuth else 180.0
    # In the plane beyond the mirror direction: a negative angle from it.
    return Geometry("multi-angle", one, -two) if turned == 0.0 else Geometry("multi-angle", one, two, turned)


def signed(text: str) -> float:
    """Parse the number of an angle, with its sign in the usual notations: "-15", "_15", "minus 15"."""
    digits = re.sub(r"^(?:-|_|minus ?|\u2212)\s*", "-", text.strip(), flags=re.I)
    return float(digits)


def is_condition(label: str, perhaps: bool = False) -> bool:
    """Return whether a label of a file denotes a part of a measurement; perhaps : or possibly does, as "mode"."""
    return _part(label) not in ((None,) if perhaps else (None, "gloss", "anything", "comment"))


def conditions_in(words: str) -> dict[str, str]:
    """Find the parts of a measurement in a heading or a line about the values, in its words, by label.

    >>> conditions_in("Reflectance % (45/0), UV cut")
    {'filter': 'UV cut', 'geometry': '45/0'}
    """
    return {part: said.words for part, said in _in_name(words)}


def _part(label: str) -> str | None:
    # The label of a tag of CxF3 stands behind that of its collection.
    label = label.rpartition(": ")[2] if label.startswith("tag") else label
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", label)
    # Without accents: "géométrie".
    apart = "".join(sign for sign in unicodedata.normalize("NFKD", apart) if not unicodedata.combining(sign))
    plain = " ".join(re.sub(r"[^a-z0-9/]+", " ", apart.casefold()).split())
    return next((name for name, pattern in _LABELS if pattern.fullmatch(plain)), None)


@lru_cache(maxsize=4096)
def _parts(label: str, words: str, is_cxf: bool) -> tuple[tuple[str, StatedPart], ...]:
    """Parse the parts stated by a labelled detail."""
    text = " ".join(words.split()).strip("\"' ")
    part = _part(label)
    if part != "geometry" and ANGLE_NOTATION.fullmatch(text):
        # Nothing but an angle is written so, whatever its heading ("Angle", "Condition") is.
        return tuple(_geometry(text, label))
    if part is None or _UNKNOWN.fullmatch(text):
        return ()
    if part == "measurement condition" and not is_cxf and not _LETTER.search(text):
        # A condition may be anything, such as that of the sample.
        return ()
    where = _CXF.get(label, label) if is_cxf else label
    if part == "uv cut":
        cut = bool(_YES.search(text) or _CUT.search(text)), bool(_NO.search(text))
        cut = None if cut[0] == cut[1] else cut[0]
        return () if cut is None else (("filter", StatedPart("uv excluded" if cut else "none", text, where)),)
    if part == "comment":
        pieces = (re.split(r"\s*[:=]\s*", piece, maxsplit=1) for piece in re.split(r"\s*[;\n]\s*|[,.]\s+", text))
        stated = [piece for piece in pieces if len(piece) == 2 and is_condition(piece[0])]
        return tuple(told for name, value in stated for told in _parts(name, value, False))
    if part in ("gloss", "anything"):
        return _in_free_words(text, where, gloss=part == "gloss")
    if part == "source":
        inside = ((_IN_SOURCE.get(re.sub(r"[ _]", "", key.casefold())), value) for key, value in _INSIDE.findall(text))
        return tuple(told for name, value in inside if name for told in _told(name, value, where))
    found = _told(part, text, where)
    if part == "geometry" and "geometr" not in label.casefold():
        # A mode may be anything; a geometry has angles, or a sphere.
        found = [one for one in found if not isinstance(one[1].value, Geometry) or one[1].value.is_known]
    return tuple(found)


def _in_free_words(text: str, where: str, gloss: bool) -> tuple[tuple[str, StatedPart], ...]:
    """Parse a specular component or an M condition from words that state nothing else.

    gloss : a number is one of gloss units.
    """
    if re.fullmatch(r"M[0-3]", text):
        return (("measurement condition", StatedPart(text, text, where)),)
    included, excluded = bool(_INCLUDED.search(text)), bool(_EXCLUDED.search(text))
    if gloss and included == excluded and not re.search(r"\d", text):
        included, excluded = bool(_YES.search(text)), bool(_NO.search(text))
    if included == excluded:
        return ()
    return (("specular component", StatedPart("included" if included else "excluded", text, where)),)


def _told(part: str, text: str, where: str) -> list[tuple[str, StatedPart]]:
    if _UNKNOWN.fullmatch(text):
        return []

    def said(value: str | bool | Geometry) -> StatedPart:
        return StatedPart(value, text, where)

    if part == "specular component":
        included = bool(_YES.search(text) or _INCLUDED.search(text))
        excluded = bool(_NO.search(text) or _EXCLUDED.search(text))
        # Both, or neither, say nothing of the one reading.
        return [(part, said("included" if included else "excluded"))] if included != excluded else []
    if part in ("filter", "measurement condition", "geometry") and (letters := set(_LETTER.findall(text))):
        return [("measurement condition", said(f"M{letters.pop()}"))] if len(letters) == 1 else []
    if part == "geometry":
        return _geometry(text, where)
    if part == "filter":
        return _uv(text, where) if re.fullmatch(r"uv(?:[ _-]?(?:mode|setting))?", where, re.I) else _filter(text, where)
    if part == "polarisation":
        return [(part, said(not _NO.search(text)))]
    if part == "backing":
        named = [name for name, pattern in _BACKINGS.items() if re.search(rf"\b(?:{pattern})", text, re.I)]
        return [(part, said(named[0] if len(named) == 1 else text.casefold()))]
    if part == "material":
        return [(part, said(text.casefold())), ("film", said(bool(_FILM.search(text))))]
    return [(part, said(text.casefold()))]


def _geometry(text: str, where: str) -> list[tuple[str, StatedPart]]:
    found: list[tuple[str, StatedPart]] = []
    if _INCLUDED.search(text) and not _EXCLUDED.search(text):
        found.append(("specular component", StatedPart("included", text, where)))
    elif _EXCLUDED.search(text) and not _INCLUDED.search(text):
        found.append(("specular component", StatedPart("excluded", text, where)))
    geometry = geometry_in(text)
    if geometry is not None:
        found.append(("geometry", StatedPart(geometry, text, where)))
        if geometry.kind == "directional" and (how := _configuration(text)):
            found.append(("configuration", StatedPart(how, text, where)))
    return found


def _configuration(text: str) -> str:
    if re.search(r"annular|ring|circumferential|\d\s*°?\s*[ac]\s*(?:[:/]|$|\s)", text, re.I):
        return "annular"
    return "uniplanar" if re.search(r"uniplanar|\d\s*°?\s*x\s*(?:[:/]|$|\s)|directional", text, re.I) else ""


def _filter(text: str, where: str) -> list[tuple[str, StatedPart]]:
    if re.match(r"(?:x-?)?pol(?:ar\w*)?\b", text, re.I):
        return [("polarisation", StatedPart(True, text, where))]
    if re.search(r"uv\W?_?(?:cut|excl|filter|block|out|-?400|-?420)|excl|^UV$|cut|without uv", text, re.I):
        value = "uv excluded"
    elif _NO.search(text) or re.search(r"uv\W?_?(?:incl|in\b)|^incl|full|100", text, re.I):
        value = "none"
    else:
        value = re.sub(r"^filter[_ ]?", "", text.casefold())
    return [("filter", StatedPart(value, text, where))]


def _uv(text: str, where: str) -> list[tuple[str, StatedPart]]:
    """Parse whether the light contained ultraviolet, from a label such as "UV"."""
    share = re.fullmatch(r"(\d+(?:\.\d+)?)\s*%?", text)
    without = float(share[1]) == 0.0 if share else bool(_NO.search(text))
    with_it = float(share[1]) in (1.0, 100.0) if share else bool(_YES.search(text))
    if without != with_it:
        return [("filter", StatedPart("uv excluded" if without else "none", text, where))]
    return _filter(text, where)


def _in_name(name: str) -> list[tuple[str, StatedPart]]:
    """Parse the name of a reading: SCI or SCE as separate words, an angle in its notation."""
    found: list[tuple[str, StatedPart]] = []
    words = re.sub(r"[_\W]+", " ", name)
    stated = {word.upper() for word in re.findall(r"(?<![A-Z])(?:SCI|SCE|SPINC?|SPEXC?|RSIN|RSEX)(?![A-Za-z])", words)}
    if len(stated) == 1:
        word = stated.pop()
        value = "included" if word.startswith(("SCI", "SPIN", "RSIN")) else "excluded"
        found.append(("specular component", StatedPart(value, word, "the name")))
    elif not stated and (gloss := _SPECULAR_IN_NAME.search(words)):
        found.append(("specular component", StatedPart("included" if gloss[1] else "excluded", gloss[0], "the name")))
    if ultraviolet := _UV_IN_NAME.search(words):
        found.append(("filter", StatedPart("none" if ultraviolet[1] else "uv excluded", ultraviolet[0], "the name")))
    if lies := _BACKING_IN_NAME.search(words):
        named = (lies[1] or lies[2]).casefold()
        found.append(
            ("backing", StatedPart(next(n for n, p in _BACKINGS.items() if re.match(p, named)), lies[0], "the name"))
        )
    if polarised := _POLARISED_IN_NAME.search(words):
        found.append(("polarisation", StatedPart(not polarised["no"], polarised[0], "the name")))
    if angles := _GEOMETRY_IN_NAME.search(name):
        found += [told for told in _geometry(angles[0], "the name") if told[0] != "configuration"]
    angles = list(ANGLE_NOTATION.finditer(name))
    if len(angles) == 1:
        geometry = geometry_in(angles[0][0])
        if geometry is not None:
            found.append(("geometry", StatedPart(geometry, angles[0][0].strip(), "the name")))
    return found


def _in_file_name(name: str) -> list[tuple[str, StatedPart]]:
    """Parse the name of a file: as `_in_name`, and M0 to M3, 45-0 and d8 as separate words."""
    found = _in_name(name)
    if len(conditions := set(_CONDITION_IN_NAME.findall(name))) == 1:
        (word,) = conditions
        found.append(("measurement condition", StatedPart(word, word, "")))
    if len(pairs := set(_GEOMETRY_IN_FILE_NAME.findall(name))) == 1:
        found += _geometry(":".join(re.findall(r"\d+|d", pairs.pop().lower())), "")
    return [(part, said._replace(field="the name of the file")) for part, said in found]


def _quantity_of(details: Mapping[str, str]) -> str | None:
    words = details.get("measurement", "")
    return "transmittance" if "Transmittance" in words else "reflectance" if "Reflectance" in words else None
