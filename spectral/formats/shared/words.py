"""Vocabulary of measured files: quantity, unit, illuminant, observer, measurement condition."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from ...observers import ANGLES
from ...spectrum import Quantity
from ..registry import StatedColour

Unit = Literal["percent", "fraction"]
Meaning = Quantity | Literal["sensitivity"]

_RADIANCE_FACTOR = re.compile(r"radiance[ _-]*factor|strahldichtefaktor", re.I)
_REFLECTANCE = re.compile(
    r"r[eé]flect(?!or)|r[eé]flexi|riflett|rifless|refl[e]t[âa]n|\brefl\b|\d+as-?\d+|\bas-?\d{2,3}\b|r[eé]mission|albedo|"
    r"%\s*R\b|\bR\s*(?:[\[(]?\s?%|[\[(]\s?(?:0\W{1,4}1\b|1?\s?[\])]|-\s?[\])]|frac|dec))|\bR$|\bR(?:SCI|SCE)\b|\bSC[IE]\b",
    re.I,
)
_TRANSMITTANCE = re.compile(
    r"tran?sm|\btrans\b|%\s*T\b|\bT\s*(?:[\[(]?\s?%|[\[(]\s?(?:0\W{1,4}1\b|1?\s?[\])]|-\s?[\])]|frac|dec))|\bT$|durchlicht",
    re.I,
)
_EMISSION = re.compile(
    r"irradian|radian(?:ce|cy|cia|za)(?![ _-]*coeff)|[ée]clairement|"
    r"radiant[ _]*(?:flux|power|energy|exi|intens|emitt)|emissi(?:on|ve)\b|\bspd\b|"
    r"spectral[ _]*power|power[ _]*distribution|"
    r"(?<![a-z])luminance|illuminance|bestrahlung|strahldichte|"
    r"(?<![A-Za-z])[kmµμunp]?W\s*(?:/|\*|·|\.|\s)?\s*(?:\(?\s*(?:c?m\s*(?:\^|\*\*)?-?[2²]|sr|nm|[µu]m)|m⁻²|cm⁻²)|"
    r"(?<![a-z])(?:kilo|milli|micro|nano|pico|[kmµμunp])?watts?\s*(?:/|\*|·|\.|\s|per\b)\s*"
    r"\(?\s*(?:c?m\s*(?:\^|\*\*)?-?[2²]|sr|nm|[µu]m|(?:square |nano|micro|centi)?met(?:er|re)|ste?radian)|"
    r"cd\s?/\s?m|(?-i:\bLv\b|\bLUM\b)|\bCS-?[12]000A?\b|\bPR-?[67]\d\d\b|"
    r"\bCCT\b|\blux\b|\[lx\]",
    re.I,
)
_ABSORBANCE = re.compile(
    r"absorb|(?:^|[\s,;|])abs\.?(?:$|\s*[\[(])|\bA\.?U\.?$|log\s*\(?\s*1\s*/\s*[RT]|\bK/S\b|F\(R\)|"
    r"(?:optical|reflection|reflectance|transmission|visual)[ _]+density|^(?:OD|density)\d?\W*$",
    re.I,
)
# An absolute white, and a mode that may be so: "Abs" there is no absorbance.
_ABSOLUTE = re.compile(
    r"(?<![a-z])((?:(?:white|calibration|measuring|instrument|reference) ?){0,2}(?:"
    r"(?:white|base|calibration|(?:white )?reference|backing|backer|point|norm(?:ali[sz]ation)?|intent|colou?rimetry|"
    r"coordinates)(?: (?:mode|type))?[ _]{0,2}[:=;,|]|white[ _-]?base|calibration mode)\W{0,4})abs\b\.?",
    re.I,
)
_PERHAPS_ABSOLUTE = re.compile(r"(?:(?:measurement|measuring|instrument) )?(?:mode|scale|type)\W{1,4}abs\.?", re.I)
_DENSITY = re.compile(
    r"(?<![a-z])(?:(?:optical|lens|lenticular|macular(?: pigment)?|ocular|filter|nd|reflection|transmission|visual|"
    r"relative|spectral|status) ?densit(?:y|ies)|densities|den(?= )|absorbances?|absorptances?)(?![a-z])",
    re.I,
)
# Functions of a reflectance or a transmittance, beside the words for these.
_DERIVED = re.compile(
    r"deriv[ae]t|ableitung|d[eé]riv[eé]e|\bd%?[RT]\s*/\s*d|diff[e]ren(?:ce|z|tial)|(?:[Δ∆]|\bdelta)\s?(?:r[eé]fl|trans)|"
    r"\bsqrt|√|square root|\bsquared?\b|\bloss(?:es)?\b|"
    r"\bd[Bb]\b|decibel|\b(?:log(?:_?10)?|ln)\b|\b(?:1|100)\s*/\s*%?[RT]\b|continuum[ -]?removed|"
    r"(?<!\w)(?:1\s?/\s?sr|sr\s?(?:\^|\*\*)?[-−⁻][1¹]|per ste?radian)(?!\w)",
    re.I,
)
_A_LETTER = re.compile(r"(?<![A-Za-z])d?[RT](?![A-Za-z])")
_ONE_MINUS = re.compile(r"\W*(?:1|100)\s?%?\s*[-−–]\s*%?(?:[RT]|r[eé]fl\w*|trans\w*)\W*(?:[\[(].*)?", re.I)
_NUMBERED_LETTER = re.compile(r"\W*(?!(?:1|100)\b)\d+\s*[-−–]\s*%?[RT]\b.*", re.I)
_SENSITIVITY = re.compile(
    r"colou?r[ _-]*matching|\bcmfs?\b|cone[ _]*fundamental|sensitivit|quantum[ _]*efficiency|\b[EI]QE\b|responsivit|"
    r"spectral[ _]*response|(?:^|[\s,;|])[xyz](?:[ _-]?bar\b|\u0304|\u0305)|[\u0233]",
    re.I,
)
# Headings that only say so as a whole, where nothing else says what was measured.
_POWER = re.compile(
    r"(?:(?:spectral|relative|rel\.?|normali[sz]ed|norm\.?|radiant|optical|total|lamp|light|luminous)[ _]*){0,3}"
    r"(?:power|intensit(?:y|ies)|energy|flux|output|radiometric|[mµμunp]?W|lum|luminous)\W{0,2}(?:[\[(][^\[\]()]{0,30}[\])])?",
    re.I,
)
# Headings that say no more than that a detector gave more or less.
_ANY_POWER = re.compile(
    r"(?:(?:relative|rel\.?|normali[sz]ed|norm\.?|total)[ _]*){0,3}(?:power|intensit(?:y|ies)|energy|flux|output)"
    r"\W{0,2}(?:[\[(][^\[\]()W]{0,30}[\])])?",
    re.I,
)
# A letter that stands for a quantity in a heading; "T%" and "%R" keep theirs.
_LETTER = re.compile(r"(?<![%\w:=]\s)(?<![%\w:=])\b[RT]\s*$")
_SETS = {
    frozenset({"n", "k"}): "index",
    frozenset({"n"}): "index",
    frozenset({"eta", "k"}): "index",
    frozenset({"k", "s"}): "absorbance",
    frozenset({"x", "y", "z"}): "sensitivity",
    frozenset({"l", "m", "s"}): "sensitivity",
    frozenset({"r", "g", "b"}): "colours",
    frozenset({"red", "green", "blue"}): "colours",
}
# Channels of a camera, or samples: nothing else has all three colours of its own.
_CHANNELS = re.compile(r"(?:r|g|b|gr|gb|g1|g2|ir|nir|w|red|green|blue|green ?[12rb]|clear)", re.I)
_COUNTS = re.compile(
    r"\bcounts?\b|\bcts\b|\bADU\b|z[äa]hl(?:er|rate|wert)|\bcoups?\b|\bcuentas?\b|\bconteggi|"
    r"\bdigital numbers?\b|(?-i:(?<![A-Za-z])DNs?(?![A-Za-z]))(?! ?\d)",
    re.I,
)
# Lines above a table that say so of what is in it.
_COUNTED_LINE = re.compile(
    r"(?:^|\b(?:units?|axis|mode|signal|type|intensity|calibration|measurement|values?|quantity)\W{0,3}[:=;,\t]\s*)"
    r"[\"'(\[]?(?:raw(?: (?:data|signal|intensit\w+))?|scope(?: mode)?|(?:raw )?(?:counts?|DN|ADU|digital numbers?))"
    r"[\"')\]]?$",
    re.I | re.M,
)
_PHOTONS = re.compile(r"photon|quanta\b|[mµμun]mol\b|einstein", re.I)
# Watts per hertz or electronvolt, in one unit: "W/m2/nm, 50 Hz" is none.
_PER_FREQUENCY = re.compile(
    r"(?:/|(?<![a-z])per )[^,;)\]n]*?(?<![a-z0-9])"
    r"(?:[kMGTP]?Hz|m?eV|cm ?(?:\^|\*\*)?[-\u2212\u207b][1\u00b9])(?![a-z])|"
    r"(?<![a-z])(?:[kMGTP]?Hz|m?eV) ?(?:\^|\*\*)? ?\(?[-\u2212\u207b] ?[1\u00b9]",
    re.I,
)
# Lines that say so strongly that two of them on different things leave the question open.
_STRONG_EMISSION = re.compile(
    r"irradian|(?<![a-z])radiance(?![ _-]*factor)|emissi(?:on|ve)\b|\bspd\b|spectral[ _]*power|power[ _]*distribution|"
    r"W\s?/?\s?\(?(?:m|cm)\s?(?:\^|\*\*)?-?[2²]",
    re.I,
)
_OBSERVER_FILE = re.compile(r"xyz|linss|lms|cmf|colou?r.?match", re.I)
_INDEX = re.compile(r"refractive|extinction|\.(?:eta|k)$|\bior\b", re.I)
# What lights are called, where nothing says what was measured.
_LIGHT = re.compile(
    r"illumi|\billum\b|\bHMI\b|\bCFL\b|\blamps?\b|\bleds?\b|daylight(?! fluo)|tungsten|xenon|halogen|sunlight|"
    r"skylight|incandescent|"
    r"(?<![A-Za-z0-9])D(?:50|55|65|75|93)(?![0-9])|^FL\d{1,2}$",
    re.I,
)
# What lights are called, and paints as well.
_PERHAPS_LIGHT = re.compile(
    r"(?:CIE )?(?:FL? ?\d{1,2}|HP ?\d|(?:cool|warm|soft|bright|neutral)[ -]?white|sun|sky|fluorescent|daylight|sodium|"
    r"mercury)\.?\d{0,2}",
    re.I,
)
# Names that are a light's as a whole; lamps and letters are those of samples, too.
_LIGHT_NAME = (
    r"D ?(?:50|55|65|75|93)|ID ?(?:50|65)|FL ?\d{1,2}(?:\.\d{1,2})?|LED[- ](?:[BV]\d|BH1|RGB1)|"
    r"TL ?-?8(?:[345]|[34][015])|U ?(?:3[05]|40|50)|CWF|WWF|HMI|CFL"
)
_PREFIXES = r"(?:(?:CIE|std\.?|standard|ref(?:erence)?\.?|test|rel\.?|relative|norm(?:ali[sz]ed|\.)?|booth) ){0,3}"
_A_LIGHT = re.compile(
    rf"{_PREFIXES}(?:(?:illuminants?|illum\.?|light ?sources?|lamps?|lampen?|spd|lichtart|normlicht(?:art)?|leuchte)"
    rf"(?:\W{{0,3}}(?:{_LIGHT_NAME}|[ABCE]|F?\d{{1,2}}))?|"
    rf"(?:[EIS][ (]{{1,2}})?(?:{_LIGHT_NAME}|[ABCE] (?=[ilsp])|F ?\d{{1,2}} (?=[ilsp]))\)?"
    r"(?: ?(?:illuminant|light(?: source)?|lamp|source|spd|power|spectrum|norm(?:ali[sz]ed|\.)?|rel\.?|relative))?)",
    re.I,
)
_PERHAPS_A_LIGHT = re.compile(
    rf"(?-i:[ABCE])|(?:(?:{_PERHAPS_LIGHT.pattern}|lights?|sources?|tungsten|halogen|xenon|incandescent|leds?|horizon|booth)"
    r"(?: ?\d{1,2})?)",
    re.I,
)
_CONDITION_COLUMN = re.compile("illum|observer|obs$|light", re.I)
# Numbers that a sheet gives its samples, readings or rows; and words for a sample's lot, which are samples as well.
_NUMBERED = (
    r"(?:sample|specimen|row|lot|batch|serial|order|job|part|item|article|product|panel|measurement|reading|scan|run|"
    r"operator|instrument|device|customer|proben?|charge|chargen|serien|auftrags?)"
)
_IDENTIFIER = re.compile(
    rf"(?:{_NUMBERED}[ _.-]*)?(?:ids?|no\.?|nos\.?|nr\.?|num(?:ber)?\.?|nummer|identifier|[ug]?uid|bar ?code|#)", re.I
)
_PERHAPS_IDENTIFIER = re.compile(
    rf"{_NUMBERED}|los|replicates?|repeat|position|pos\.?|line|step|counter|code|key|year|month|day|[nki]", re.I
)
# "grey 50%" is the name of a sample.
_PERCENT = re.compile(
    r"(?<![\d.,])(?<!\d\s)%|\b0\W{1,5}100\s?%|percent|\bpct\b|_pct|prozent|pour ?cent|"
    r"(?:r[eé]?fl\w*|remission|trans\w*|factor|scale|units?|\b[RT]|^)[^\w%]{0,4}"
    r"(?:0 ?(?:-|–|to|\.\.+|…) ?100\b(?! ?(?:nm|mm|°|deg))|(?:(?<!\w)[x×*]|times) ?100\b)", re.I)  # fmt: skip
# Scales that are neither to 1 nor to 100, which no numbers tell: a range of codes, a factor, thousandths.
_OTHER_SCALE = re.compile(
    r"‰|per ?mill?e?\b|promille|\bpp[mb]\b|\b\d\d? ?-?bits?\b|"
    r"\b0 ?(?:-|–|to|\.\.+|…) ?(?:255|1000|1023|4095|10000|65535)\b(?! ?(?:nm|mm|°|deg))|"
    r"(?:(?<!\d)[x×*]|times|scaled?(?: by)?|multiplied by|divided by|(?<![A-Z0-9])/) ?(?:10(?:00|000)?|255|65535)"
    r"(?!\d| ?(?:nm|mm|°|deg|\^|\*\*)|[⁻¹²³⁴])|"
    r"(?<![\d.])1e[-−+]?0?[134]\b|(?<!\d)10 ?(?:\^|\*\*) ?\(?[-−]?[134]\b|(?<!\d)10⁻?[¹³⁴](?!\d)",
    re.I,
)
_FRACTION = re.compile(
    r"\b0(?:\.0)?\s*(?:\.\.+|-|–|to)\s*1(?:\.0)?\b|fraction|decimal|\b_?dec\b|\[-\]|unitless|dimensionless", re.I
)

_ILLUMINANT = (
    r"D\s?(?:50|55|65|75|93)|F\s?L?\s?\d{1,2}|FL\d{1,2}|LED-[BV]\w+|ID(?:50|65)|TL[ -]?8[345]|CWF|WWF|U(?:30|40|50)|"
    r"horizon|(?-i:[ABCE])"
)
_NAMED_ILLUMINANT = re.compile(
    rf"(?:illumin\w*|lichtart|source|light|ill)(?:s|\W?\d(?=\W))?\W{{0,3}}(?:name\W{{0,3}})?(?:CIE\s*)?({_ILLUMINANT})\b",
    re.I,
)
_PLAIN_ILLUMINANT = re.compile(r"(?<![A-Za-z0-9])(D\s?(?:50|55|65|75|93)|FL?\s?\d{1,2}|TL[ -]?8[345]|CWF)(?![0-9])")
_WITH_ANGLE = re.compile(rf"(?<![A-Za-z0-9])({_ILLUMINANT})\s*[/,_ -]\s*(?:2|10)\s*(?:°|deg|º|$|[)\]])", re.I)
_CALLED_ILLUMINANT = (
    _NAMED_ILLUMINANT,
    _WITH_ANGLE,
    re.compile(r"(?<![A-Za-z0-9])(D\s?(?:50|55|65|75|93)|FL?\s?\d{1,2}|TL[ -]?8[345]|CWF)/(?:2|10)(?![\d.])"),
)
# A light named behind another one; a letter alone only in a list of nothing else.
_AND = r"(?:[,;/&+]|\b(?:and|or|und|et)\b)"
_FURTHER_ILLUMINANT = re.compile(
    rf"\s*{_AND}\s*(?:CIE\s*)?(?:illuminant\s*)?((?!(?:CIE )?[ABCE]\b){_ILLUMINANT})(?![A-Za-z0-9])|"
    rf"\s*{_AND}?\s*(?:CIE\s*)?(?:illuminant\s*)?({_ILLUMINANT})(?=\s*(?:{_AND}|$)|\s+(?:{_ILLUMINANT})\b)",
    re.I,
)
_OBSERVER = re.compile(
    r"(?:viewing angle|field of view)\D{0,8}(2|10)\b|"
    r"(?<![\d.,])(2|10)(?:\.0+)?\s*(?:°|º|deg|_?degree)|observer\w*\W{0,4}(?:angle\W{0,4})?(?:CIE\s*)?(2|10|1931|1964)\b|"
    r"CIE\s*_?(1931|1964)|(?:D\d\d|[AC]|FL?\d{1,2})\s*[/_-]\s*(2|10)\b",
    re.I,
)
_CONDITION = re.compile(r"(?<![A-Za-z0-9])(M[0-3])(?![0-9A-Za-z])")


def _one_line(words: str) -> str:
    """Words with single spaces, no longer than any header: what patterns are tried on stays small."""
    return " ".join(words[:8000].split())


def quantity_in(words: str) -> Quantity | Literal["absorbance", "index"] | None:
    """Find the quantity that words name, None if they name none; absorbance and refractive indices are told, to be
    refused.
    """
    words = _ABSOLUTE.sub(r"\1", _one_line(words))
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


def quantity_in_lines(
    words: str,
) -> tuple[Quantity | Literal["absorbance", "perhaps absorbance", "index"] | None, str]:
    """Find the quantity that the lines above a table name, and the line; None and "" where none does, or two say two
    things.

    A letter alone at the end of a line is a part of a name, and an instrument that says how much light there was
    (lux, CCT) may have measured a surface in it; a heading counts for more than such lines. "Mode: Abs" among lines of
    a surface may be of an absolute white.
    """
    found: dict[str, tuple[Quantity | Literal["absorbance", "index"], str]] = {}
    lines = [_one_line(line) for line in words.splitlines()[:400]]
    open_ones = [line for line in lines if _PERHAPS_ABSOLUTE.fullmatch(line)]
    for line in (line for line in lines if line not in open_ones):
        named = quantity_in(line) or ("emission" if names_power(line) else None)
        if named in ("reflectance", "transmittance") and names_derived(line):
            continue
        by_letter = named in ("reflectance", "transmittance") and quantity_in(_LETTER.sub("", line)) is None
        if named is not None and not by_letter:
            found.setdefault(named, (named, line))
    for refused in ("absorbance", "index"):
        if refused in found:
            return found[refused]
    surfaces = [name for name in found if name != "emission"]
    if open_ones and not any(unit_in(line) for _, line in found.values()):
        return "perhaps absorbance" if surfaces else "absorbance", open_ones[0]
    if surfaces and (len(surfaces) > 1 or any(_STRONG_EMISSION.search(line) for line in lines)):
        return None, ""
    return found[surfaces[0]] if surfaces else found.get("emission", (None, ""))


def names_derived(heading: str, others: Sequence[str] = ()) -> bool:
    """Return whether a heading is that of a function of a reflectance or a transmittance, such as "1-R", "T (dB)" or
    "derivative of reflectance"; beside "2-R" of the `others`, "1-R" is that of sample 1.
    """
    heading = _one_line(heading)
    if _ONE_MINUS.fullmatch(heading):
        return not any(map(_NUMBERED_LETTER.fullmatch, others))
    named = _A_LETTER.search(heading) or _REFLECTANCE.search(heading) or _TRANSMITTANCE.search(heading)
    return bool(named and _DERIVED.search(heading)) and not _EMISSION.search(heading)


def measured(named: str | None) -> Quantity | None:
    """Return the quantity that `quantity_in` told, None where it told none or one that is no spectrum of a colour."""
    return {name: name for name in get_args(Quantity)}.get(named)


def names_sensitivity(heading: str) -> bool:
    """Return whether a heading is that of an eye's or a sensor's sensitivity; elsewhere it may be an instrument's
    setting.
    """
    return bool(_SENSITIVITY.search(_one_line(heading)))


def names_raw(heading: str) -> Literal["counts", "photons"] | None:
    """Find the raw quantity that a heading names, counted and not measured as power: an instrument's counts, or
    photons.
    """
    heading = _one_line(heading)
    return "photons" if _PHOTONS.search(heading) else "counts" if _COUNTS.search(heading) else None


def names_power_per_frequency(words: str) -> bool:
    """Return whether words name power per hertz, electronvolt or wavenumber, such as "W/m2/Hz"."""
    return bool(_PER_FREQUENCY.search(_one_line(words)))


def counts_in_lines(words: str) -> str | None:
    """Return the line above a table that says that its values are counted, such as "Units: DN"; None where none
    does."""
    found = (line.strip() for line in words.splitlines()[:400] if len(line) < 400)
    return next((line for line in found if _COUNTED_LINE.search(line)), None)


def quantity_of_set(headings: Sequence[str], file: str) -> str | None:
    """Find the quantity that headings name together, None if none: n and k an "index", K and S "absorbance", an
    observer "sensitivity".

    "colours" is red, green and blue, which may be samples or the channels of a camera. Three columns without headings
    are an observer's where the name of the `file` says so.
    """
    plain = [re.sub(r"\W*[\[(].*|[_ -]?bar$", "", _one_line(heading).casefold()).strip() for heading in headings]
    if len(plain) == 3 and not any(plain) and _OBSERVER_FILE.search(file):
        return "sensitivity"
    capital = any(heading.startswith("N") for heading in headings)  # a sample; the index is n
    if {"r", "g", "b"} <= {word[:1] for word in plain} and len(plain) < 7 and all(map(_CHANNELS.fullmatch, plain)):
        return "colours"
    return _SETS.get(frozenset(plain)) if len(set(plain)) == len(plain) and not capital else None


def names_power(heading: str) -> bool:
    """Return whether a heading as a whole is a word for light that is given off, such as "Relative power" or "W"."""
    return bool(_POWER.fullmatch(_one_line(heading)))


def names_any_power(heading: str) -> bool:
    """Return whether a heading as a whole is a word such as "Intensity", which reflected light has, too."""
    return bool(_ANY_POWER.fullmatch(_one_line(heading)))


def names_density(name: str) -> bool:
    """Return whether a name is that of optical densities or absorbances, such as "macular density" or "den_lens"."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", _one_line(name)).replace("_", " ")
    return bool(_DENSITY.search(words))


def names_perhaps_light(name: str) -> bool:
    """Return whether a name is as likely that of a light as of a sample, such as "F11" or "cool white"."""
    return bool(_PERHAPS_LIGHT.fullmatch(_one_line(name).replace("_", " ")))


def names_light(words: str) -> bool:
    """Return whether a name is that of a light, such as "D65", "LED 4000 K" or "Tungsten"."""
    return bool(_LIGHT.search(_one_line(words).replace("_", " ")))


def names_only_light(heading: str) -> Literal["light", "perhaps"] | None:
    """Find whether a heading is as a whole that of a light, such as "D65" or "illuminant 2", or may be, as "A" or
    "F11", which samples are called, too.
    """
    heading = _one_line(heading).replace("_", " ")
    without_unit = re.sub(r" ?[\[(][^\[\]()]{0,20}[\])]$", "", heading)
    if _A_LIGHT.fullmatch(heading) or _A_LIGHT.fullmatch(without_unit):
        return "light"
    return "perhaps" if _PERHAPS_A_LIGHT.fullmatch(heading) else None


def names_identifier(heading: str) -> Literal["identifier", "perhaps"] | None:
    """Find whether a heading is that of identifiers, such as "id" or "lot no.", or may be, as "lot" and "batch", which
    are samples beside a standard.
    """
    heading = _one_line(heading)
    if _IDENTIFIER.fullmatch(heading):
        return "identifier"
    return "perhaps" if _PERHAPS_IDENTIFIER.fullmatch(heading) else None


def names_condition(heading: str) -> bool:
    """Return whether a heading is that of the illuminant or the observer that colours are for."""
    return bool(_CONDITION_COLUMN.search(heading))


def unit_in(words: str) -> Unit | None:
    """Return whether words say percent or fractions of 1, None if they do not."""
    words = _one_line(words)
    if _PERCENT.search(words):
        return "percent"
    return "fraction" if _FRACTION.search(words) else None


def other_scale_in(words: str) -> str | None:
    """Return the scale that words name where it is neither percent nor fractions of 1, such as "x1000" and "0-255".

    >>> other_scale_in("Reflectance x1000"), other_scale_in("Reflectance (0-1)"), other_scale_in("R D65/10")
    ('x1000', None, None)
    """
    found = _OTHER_SCALE.search(_one_line(words))
    return found[0].strip() if found else None


def illuminant_in(words: str) -> str | None:
    """Name of the illuminant in words such as "Illumination=D50", "D65/10°" or "A", as `illuminant` knows it."""
    words = _one_line(words).strip("\"'")
    exact = re.fullmatch(rf"(?:CIE\s*)?(?:(?:std|standard)\.?\s*)?(?:illuminant\s*)?({_ILLUMINANT})", words, re.I)
    found = exact or _NAMED_ILLUMINANT.search(words) or _WITH_ANGLE.search(words) or _PLAIN_ILLUMINANT.search(words)
    return None if found is None else _illuminant(found[1])


def _illuminant(name: str) -> str:
    return re.sub(r"^F(?=\d)", "FL", re.sub(r"\s", "", name).upper())


def illuminants_in(lines: str) -> tuple[str, ...]:
    """Return all illuminants that lines name, each once; lights that only stand in a line count where none is called
    one, and with it where they follow it.

    >>> illuminants_in("Illuminant: D65"), illuminants_in("Illuminants: D65, A"), illuminants_in("D65/10 A/10")
    (('D65',), ('D65', 'A'), ('D65', 'A'))
    """
    called: list[str] = []
    plain: list[str] = []
    for line in map(_one_line, lines.splitlines()):
        matches = sorted((one for each in _CALLED_ILLUMINANT for one in each.finditer(line)), key=re.Match.start)
        strong = [_and_further(match, line) for match in matches]
        weak = [_and_further(match, line) for match in _PLAIN_ILLUMINANT.finditer(line)]
        named = {name for names in strong for name in names}
        called += [name for names in [*strong, *(names for names in weak if named & set(names))] for name in names]
        plain += [name for names in weak for name in names]
    return tuple(dict.fromkeys(called or plain))


def _and_further(found: re.Match[str], line: str) -> list[str]:
    """Return the illuminant that was found and those that are listed behind it."""
    names = [_illuminant(found[1])]
    while further := _FURTHER_ILLUMINANT.match(line, found.end()):
        names.append(_illuminant(further[1] or further[2]))
        found = further
    return names


def observer_in(words: str) -> str | None:
    """Short name of the standard observer in words such as "ObserverAngle=2", "10°" or "CIE 1931"."""
    words = _one_line(words).strip("\"'")
    if words in ANGLES:
        return ANGLES[words]
    found = _OBSERVER.search(words)
    return None if found is None else _observer(found)


def _observer(found: re.Match[str]) -> str:
    return ANGLES[next(group for group in found.groups() if group)]


def observers_in(lines: str) -> tuple[str, ...]:
    """Return all standard observers that lines name, each once; an angle alone counts where none is called one."""
    of_lines = [list(_OBSERVER.finditer(_one_line(line))) for line in lines.splitlines()]
    called = [matches for matches in of_lines if any(match[2] is None for match in matches)]
    return tuple(dict.fromkeys(_observer(match) for matches in called or of_lines for match in matches))


def condition_in(words: str) -> str | None:
    """Measurement condition of ISO 13655, "M0" to "M3"."""
    found = _CONDITION.search(_one_line(words))
    return found[1] if found else None


_COLOUR_COLUMN = re.compile(
    r"(?:tristimulus(?: values?)? )?(?:(?P<space>XYZ|CIE[ _]?XYZ|LAB|CIE[ _]?LAB|CIE)[ _.:-]+)?"
    r"(?P<axis>X|Y|Z|L|a|b) ?\*?(?P<rest>$|[ (\[/,_].*|(?<=\*)[-\u2212]?\d.*)",
    re.I,
)
# A reading and its axis, such as "-15° L*", "45as15 a*" and "D65/10° X"; a letter alone needs an angle or a light.
_AXIS_LAST = re.compile(
    r"(?P<before>.{1,60}?)(?:[ _,;:/|)\]-]+|(?<=[°º]))(?:CIE ?)?(?P<axis>L|a|b|(?-i:[XYZ]))(?P<star>(?<![XYZ]) ?\*)?",
    re.I,
)
_READ_SO = re.compile(
    rf"(?:{_ILLUMINANT})(?:\s*[/,_ -]\s*(?:2|10))?\s*(?:°|º|deg)?|(?:r?\d+)?as(?:p(?:ec\w*)?)?[ _]*[-\u2212]?\d+|"
    r"[-\u2212]?\d+ ?(?:°|º|deg)?(?: ?as(?:p(?:ec\w*)?)?)?|SC[IE]",
    re.I,
)
_ONLY_LIGHT = re.compile(rf"(?:{_ILLUMINANT})(?:\s*[/,_ -]\s*(?:2|10)\s*(?:°|º|deg)?)?", re.I)
# Differences (not the geometry d/8), limits and other spaces with the same letters: none is a colour of CIELAB.
_NO_COLOUR = re.compile(
    r"[Δ∆δ]|(?<![a-z])(?:d(?! ?[/:])|delta|diff\w*|dev\w*|tol\w*|limits?|std\W?dev\w*|sd|sigma|min\w*|max\w*|hunter|"
    r"ok|din ?99)(?![a-z0-9])",
    re.I,
)


def _colour_heading(header: str) -> tuple[str, str, str] | None:
    """Return the axis of a heading of colours, the space it names and the words beside it; None of any other."""
    line = _one_line(header)
    last = _AXIS_LAST.fullmatch(line)
    # "A/10° L*" is L* under illuminant A, and no a*.
    is_read_so = last is not None and _READ_SO.fullmatch(last["before"].strip(" ()[]")) is not None
    if not is_read_so and (match := _COLOUR_COLUMN.match(line)) is not None:
        axis, space, beside = match["axis"], (match["space"] or "").upper(), match["rest"]
    elif last is not None and (is_read_so or last["star"]):
        axis, space, beside = last["axis"], "XYZ" if last["axis"] in "XYZ" else "LAB", last["before"]
    else:
        return None
    return (
        None if _NO_COLOUR.search(beside) else (axis, space, re.sub(r"^at\b", "", beside.strip(" ()[],;:/_")).strip())
    )


def colour_axis(header: str) -> tuple[str, int] | None:
    """("XYZ", 0..2) or ("Lab", 0..2) of a column such as XYZ_X, "L*", "LAB_B", "a*(10°/D65)" or "-15° L*", None of any
    other.
    """
    found = _colour_heading(header)
    if found is None:
        return None
    letter, space, _ = found
    axis = letter.upper()
    if axis in "XYZ" and "LAB" not in space:
        # Lower-case x, y, z without a space before them are chromaticity coordinates.
        return ("XYZ", "XYZ".index(axis)) if space or letter.isupper() else None
    if axis in "LAB" and "XYZ" not in space:
        starred = "*" in header or "LAB" in space or "CIE" in space
        return ("Lab", "LAB".index(axis)) if starred or letter in ("L", "a", "b") else None
    return None


def beside_colour_axis(header: str) -> str:
    """Return the words beside the axis in the heading of a colour, such as "SCI" in "L*(SCI)" and "15°" in "15° L*"."""
    found = _colour_heading(header)
    return found[2] if found else ""


def stated_colours(
    cells: Mapping[str, float], illuminant: str | None = None, observer: str | None = None
) -> tuple[StatedColour, ...]:
    """Tristimulus values among cells by header; an illuminant and observer in a header go before those given."""
    found: dict[tuple[str, str | None, str | None], dict[int, float]] = {}
    for header, value in cells.items():
        axis = colour_axis(header)
        if axis is None or not np.isfinite(value):
            continue
        own, beside = header.partition("(")[2].rstrip(" )]") or header, beside_colour_axis(header)
        light = (
            illuminant_in(own) if "(" in header else illuminant_in(beside) if _ONLY_LIGHT.fullmatch(beside) else None
        )
        found.setdefault((axis[0], light, observer_in(own)), {}).setdefault(axis[1], float(value))
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
    """Find hints at quantities in the name of a file, a sample or a variable; several, or none. A paint may be called
    after a lamp: `decisions` weighs it with the others.

    >>> meant_by("LED panel.txt") == {"emission"}, meant_by("blue filter 2") == {"transmittance"}, meant_by("run 7")
    (True, True, frozenset())
    """
    words = " ".join(re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", name[:400]).split())
    found: set[Meaning] = set()
    named = quantity_in(words) if len(words) > 2 else None
    if named in ("reflectance", "transmittance", "radiance factor", "emission"):
        found.add(named)
    if names_light(words) or names_perhaps_light(words):
        found.add("emission")
    if _SURFACE.search(words):
        found.add("reflectance")
    if _CLEAR.search(words):
        found.add("transmittance")
    if _SENSOR.search(words):
        found.add("sensitivity")
    return frozenset(found)
