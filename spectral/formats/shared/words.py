"""Vocabulary of measured files: quantity, unit, scale, names of lights and samples."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Literal, get_args

from ...spectrum import Quantity
from .languages import number_of_sample, spelt
from .text import one_line, power_of_ten

Unit = Literal["percent", "fraction"]
Meaning = Quantity | Literal["sensitivity"]

_RADIANCE_FACTOR = re.compile(
    r"(?:radiance|luminance)[ _-]*factor|(?:strahl|leucht)dichtefaktor|[輝亮]度[率因]|"
    r"fa[ct]+(?:eur|or|or[e]) d[ei] (?:radian|luminan)",
    re.I,
)
_REFLECTANCE = re.compile(
    rf"reflect(?!or)|{spelt('reflectance')}|\brefl\b|\d+as-?\d+|\bas-?\d{{2,3}}\b|albedo|"
    r"%\s*R\b|\bR\s*(?:[\[(]?\s?%|[\[(]\d+ ?°[\])]|[\[(]\s?(?:0\W{1,4}1\b|1?\s?[\])]|-\s?[\])]|frac|dec))|"
    r"\bR$|\bR(?:SCI|SCE)\b|\bSC[IE]\b",
    re.I,
)
_TRANSMITTANCE = re.compile(
    rf"tran?sm|{spelt('transmittance')}|\btrans\b|%\s*T\b|"
    r"\bT\s*(?:[\[(]?\s?%|[\[(]\d+ ?°[\])]|[\[(]\s?(?:0\W{1,4}1\b|1?\s?[\])]|-\s?[\])]|frac|dec))|\bT$",
    re.I,
)
# Light that a surface sends on, by a word for it in another language than English, or by its unit.
_RADIANCE = re.compile(rf"{spelt('radiance')}|(?-i:[\[(] ?[mµμ]?W ?(?:[/·*]|m[-−^]?[1-3]))", re.I)
# Words for light that a surface sends on: which quantity it is, the other words say.
_SENT_ON = re.compile(rf"(?<![a-z])(?:back)?(?:reflected|transmitted|remitted)(?![a-z])|{spelt('sent on')}", re.I)
_EMISSION = re.compile(
    rf"irradian|radian(?:ce|cy)(?![ _-]*coeff)|{spelt('radiance')}|"
    r"radiant[ _]*(?:flux|power|energy|exi|intens|emitt)|(?<!r)emissi(?:on|ve)\b|\bspd\b|"
    r"spectral[ _]*power|power[ _]*distribution|"
    r"(?<![a-z])luminance|illuminance|"
    r"(?<![A-Za-z])[kmµμunp]?W\s*(?:/|\*|·|\.|\s)?\s*(?:\(?\s*(?:c?m\s*(?:\^|\*\*)?-?[2²]|sr|nm|[µu]m)|m⁻²|cm⁻²)|"
    r"(?<![a-z])(?:kilo|milli|micro|nano|pico|[kmµμunp])?watts?\s*(?:/|\*|·|\.|\s|per\b)\s*"
    r"\(?\s*(?:c?m\s*(?:\^|\*\*)?-?[2²]|sr|nm|[µu]m|(?:square |nano|micro|centi)?met(?:er|re)|ste?radian)|"
    r"cd\s?/\s?m|(?-i:\bLv\b|\bLUM\b)|\bCS-?[12]000A?\b|\bPR-?[67]\d\d\b|"
    r"\bCCT\b|\blux\b|\[lx\]",
    re.I,
)
_ABSORBANCE = re.compile(
    rf"{spelt('absorbance')}|absorb|(?:^|[\s,;|])abs\.?(?:$|\s*[\[(])|\bA\.?U\.?$|log\s*\(?\s*1\s*/\s*[RT]|\bK/S\b|F\(R\)|"
    r"(?:optical|reflection|reflectance|transmission|visual)[ _]+density|^(?:OD|density)\d?\W*$",
    re.I,
)
_ARBITRARY = re.compile(r"\bA\.?U\.?\W*$", re.I)
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
_DERIVED = (
    rf"deriv[ae]t|{spelt('derivative', 'difference')}|\bd%?[RT]\s*/\s*d|difference|differential|"
    r"(?:[Δ∆]|\bdelta)\s?(?:r[eé]fl|trans)|"
    r"\bsqrt|√|square root|\bsquared?\b|\bloss(?:es)?\b|"
    r"\b%?[RT] ?\+ ?%?[RT]\b|\bd[Bb]\b(?!\*)|decibel|\b(?:log(?:_?10)?|ln)\b|\b(?:1|100)\s*/\s*%?[RT]\b|"
    r"continuum[ -]?removed|\bexp ?\(|(?:cumulative|integrated|weighted)[ _](?:spectral )?(?:refl|trans)|"
    r"(?:reflectance|transmittance|\b[RT])[ _](?:changes?|contrast|correction|gain|gradient|slope|index|noise|range|"
    r"drift)\b|"
    r"(?<!\w)(?:1\s?/\s?sr|sr\s?(?:\^|\*\*)?[-−⁻][1¹]|per ste?radian)(?!\w)"
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
    rf"\bcounts?\b|\bcts\b|\bADU\b|{spelt('counts')}|"
    r"\bdigital numbers?\b|(?-i:(?<![A-Za-z])DNs?(?![A-Za-z]))(?! ?\d)|"
    # A detector's voltage or current; one letter may be a name.
    r"[\[(] ?(?:(?-i:[munpµμ][VA])|volts?|amp(?:s|eres?)) ?[\])]|"
    r"(?:reflect|transmi|reflexion|remission|radian)\w*[ _-]?signal\b",
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
    r"irradian|(?<![a-z])radiance(?![ _-]*factor)|(?<!r)emissi(?:on|ve)\b|\bspd\b|spectral[ _]*power|"
    r"power[ _]*distribution|W\s?/?\s?\(?(?:m|cm)\s?(?:\^|\*\*)?-?[2²]",
    re.I,
)
_OBSERVER_FILE = re.compile(r"xyz|linss|lms|cmf|colou?r.?match", re.I)
_INDEX = re.compile(r"refractive|extinction|\.(?:eta|k)$|\bior\b", re.I)
# Names of lights, if nothing says what was measured.
_LIGHT = re.compile(
    r"illumi|\billum\b|\bHMI\b|\bCFL\b|\blamps?\b|\bleds?\b|daylight(?! fluo)|tungsten|xenon|halogen|sunlight|"
    r"skylight|incandescent|"
    r"(?<![A-Za-z0-9])D(?:50|55|65|75|93)(?![0-9])|^FL\d{1,2}$",
    re.I,
)
# Names of lights that paints have as well.
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
# Numbers that a sheet gives its samples, readings or rows; and words for a sample's lot, which are samples as well.
_NUMBERED = (
    r"(?:sample|specimen|row|lot|batch|serial|order|job|part|item|article|product|panel|measurement|reading|scan|run|"
    rf"operator|instrument|device|customer|charge|chargen|serien|auftrags?|{spelt('sample', alone=False)})"
)
_IDENTIFIER = re.compile(
    rf"(?:{_NUMBERED}[ _.-]*)?(?:ids?|no\.?|nos\.?|nr\.?|num(?:ber)?\.?|nummer|identifier|[ug]?uid|bar ?code|#)|"
    rf"{number_of_sample()}",
    re.I,
)
_PERHAPS_IDENTIFIER = re.compile(
    rf"{_NUMBERED}|los|replicates?|repeat|position|pos\.?|line|step|counter|code|key|year|month|day|[nki]", re.I
)
# "grey 50%" is the name of a sample.
_PERCENT = re.compile(
    rf"(?<![\d.,])(?<!\d\s)%|\b0\W{{1,5}}100\s?%|percent|{spelt('percent')}|\bpct\b|_pct|"
    r"(?:r[eé]?fl\w*|remission|trans\w*|factor|scale|units?|\b[RT]|^)[^\w%]{0,4}"
    r"0 ?(?:-|–|to|\.\.+|…) ?100\b(?! ?(?:nm|mm|°|deg))",
    re.I,
)
# Words beside which a hundred, by which all is multiplied, makes percent; and what a power of ten may stand before.
_HAS_SCALE = re.compile(rf"{_REFLECTANCE.pattern}|{_TRANSMITTANCE.pattern}|\b[RT]\b|factor|scale|units?", re.I)
_SCALED = r"(?:(?<=[x×*·])|(?<=[x×*·] ))[RT](?![A-Za-z])|r[eé]?fl|trans|%[\])]|% ?[RT](?![A-Za-z])"
# Scales that are neither to 1 nor to 100, which no numbers tell: a range of codes, a factor, thousandths.
_OTHER_SCALE = re.compile(
    r"‰|per ?mill?e?\b|promille|\bpp[mb]\b|\b\d\d? ?-?bits?\b|"
    r"\b0 ?(?:-|–|to|\.\.+|…) ?(?:10|255|1000|1023|4095|10000|65535)\b(?! ?(?:nm|mm|°|deg))|"
    r"(?<!\d)(?:(?<!\w)[x×*/]|times|scaled?(?: by)?|multiplied by|divided by) ?(?:255|65535)(?!\d| ?(?:nm|mm|°|deg))",
    re.I,
)
_FRACTION = re.compile(
    r"\b0(?:\.0)?\s*(?:\.\.+|-|–|to)\s*1(?:\.0)?\b|fraction|decimal|\b_?dec\b|\[-\]|unitless|dimensionless", re.I
)

# Spectra that are no measurement: scatter, derivatives, percentiles. Whole words at the end of a heading, since "std
# white" is the name of a sample.
SCATTER = re.compile(
    r"(?:.*[\s_(,;%-])?(?:st(?:an)?d[. _]*dev\w*|std|standard deviation|stdev\w*|r?\.?s\.?d\.?|sigma|uncert\w*|"
    r"err(?:ors?)?|varian(?:ce|z|za)|σ|s\.e\.?(?:m\.?)?|sem|c\.?v\.?|unc\.?|±|(?:95 ?% ?)?ci|snr|rms[ed]?|"
    r"coeff?(?:icient|\.)?(?: of)? ?var(?:iation|\.)?|repeatability|reproducibility|precision|accuracy|"
    rf"skew(?:ness)?|kurtosis|iqr|{spelt('scatter')}\.?|"
    rf"(?:(?:1st|2nd|first|second|[12]\.) )?(?:deriv(?:ative|\.)?(?: ?\d)?|{spelt('derivative')})|"
    r"residuals?|(?:per[csz]ent[iy]{1,2}e?l|centile|[qk][uvw]an?r?t[iy]{1,2}e?l|перцентил|процентил|квантил|"
    r"квартил|百分位|パーセンタイル)\w*[\W_]*\d{0,2})\W*(?:[\[(].*)?|.*±.*|"
    r"u(?: ?[\[(]\w{0,12}(?: ?= ?\d)?[\])]|_\w{1,12})",
    re.I,
)
# Headings of numbers about a row or its reading, and no spectrum.
_OF_ROWS = re.compile(
    r"(?:(?:re)?marks?|weights?|gains?|offsets?|averages|thickness|saturat\w+|comments?|notes?|flags?|status|state|"
    r"quality|qa|qc|valid(?:ity)?|warnings?|date|(?:(?:integration|exposure|measurement|elapsed)[ _]*)?times?|"
    r"temp(?:\.|erature)?|t (?=\(°)|humidity|no\.|nr\.|(?:(?:rel(?:\.|ative)?|abs(?:\.|olute)?) ?)?diff(?:\.|erence)|"
    r"[Δ∆]\w*|d[lcheab]\*\w*|(?-i:dE)|de(?:94|00|2000|cmc|\*?ab)|delta (?:e|r|l)\b.*|"
    rf"{spelt('aside', 'difference')}\.?)"
    r"\W*(?:[\[(][^\[\]()]{0,30}[\])])?\W*",
    re.I,
)
# A sample over its reference: a number, unless it has a unit of its own.
_RATIO = r"ratio|quotient"
_SIDE = r"(?:std|standard|target|ref(?:erence)?|sample|smp|trial|batch|bat)\.?"
_APART = rf"{_SIDE} ?(?:[-−–]|minus|vs\.?) ?{_SIDE}"
_COUNTER = re.compile(r"#|index|pixel\w*|chan(?:nel)?\.? ?#?", re.I)
_MEAN = re.compile(rf"(?:.*[\W_])?(?:mean|average|avg|{spelt('mean')}|ø)\W*(?:[\[(].*)?", re.I)
# Standards, uncoated papers and the like, where no mean stands beside.
_PERHAPS_SCATTER = re.compile(
    r"(?:.*[\s_(,;%-])?(?:std|sd)\W*(?:[\[(].*)?|.*[\s_(,;-](?:ci|cv|unc|sem|err|snr|s\.e)\W*(?:[\[(].*)?", re.I
)
# Limits of what is accepted, and the spread of several readings.
_LIMIT = re.compile(
    r"(?:.*[\s_(,;])?(?:tol\.?|tol[eé]ran\w{1,4}|tolleranze?|"
    r"(?:upper|lower|control|warning|action|confidence)[ _](?:95 ?% ?)?(?:limits?|bounds?|ci)|"
    r"ci[ _](?:upper|lower|low|high)|[ul]cl|[ul]sl)\s*[-+±]?\W*(?:[\[(].*)?|range|spannweite",
    re.I,
)
# Statistics of what was read; a sample may be called so where no mean, no median and no two ends stand beside.
_STATISTIC = (
    rf"(?:.*[\s_(,;])?(?:(?P<end>min(?:\.|imum|imal)?|max(?:\.|imum|imal)?|{spelt('end')})|"
    rf"(?P<median>median|{spelt('median')})|"
    rf"(?P<sum>sum|count|(?:number|no\.?|n) of \w+|{spelt('sum')}))\W*(?:[\[(].*)?|(?P<alone>n|se)(?: ?= ?\d+)?|"
    r"(?:.*[\s_])?(?P<quantile>[pq] ?\d+)|"
    r"(?P<beside>(?:(?:upper|lower|hi(?:gh)?|low?)(?:[ _]?(?:tol\w*|spec\w*|values?))?|"
    rf"delta|deviation|{spelt('limit')})\.?\W*(?:[\[(].*)?)"
)
# Standards, with which samples are compared.
_STANDARD = (
    rf"(?:target|nominal|standard|std\.?|master|{spelt('standard')})(?: (?:values?|spectrum|mean))?\W*(?:[\[(].*)?"
)
# Patches are numbered P1 to P99, too, and lots Q1 to Q4.
_QUANTILES, _UPPER = (
    re.compile(r"p ?(?:0?5|10|25|50|75|90|95|98|99)|q ?[123]", re.I),
    re.compile(r"p ?[579]\d|q ?3", re.I),
)
# Quantity that a statistic is of: "SD R%", "Reflectance N", "Streuung der Reflexion".
_MEASURED_WORD = (
    rf"(?:\b(?:of|der|des|de|di|da|van|av|af) )?(?:(?:ir)?radiance|reflectance|transmittance|"
    rf"\w*{spelt('reflectance', 'transmittance', 'radiance')}\w*|(?<![^\W_])%?[RT]%?(?![^\W_]))\W*(?:[\[(].*)?"
)
_OF_WHAT = re.compile(r"\s+(?:of|over|from|in|for|n ?=)\s.*$", re.I)
_TITLE_OF_SCATTER = (
    r"(?:(?:spectral|relative|expanded|combined|reflectance|transmittance|measurement) )?(?:std\.?[ _]?dev\w*|stdev\w*|"
    r"standard ?deviations?|uncertaint(?:y|ies)|variance|tolerances?|(?:coefficients? of )variation|repeatability|"
    rf"reproducibility|{spelt('scatter')})\W*(?:[\[(].*)?"
)
#: Headings of a column that says which statistic each row is.
OF_STATISTICS = re.compile(r"stat|type|kind|value|function|measure|quantity", re.I)
_LONGEST_NAME = 200
_LETTERS = re.compile(r"[^\W\d_]{2}")


def quantity_in(words: str) -> Quantity | Literal["absorbance", "index"] | None:
    """Find the quantity that words name, None if they name none; absorbance and refractive indices are told, to be
    refused. Reflected radiance is no reflectance.
    """
    words = _ABSOLUTE.sub(r"\1", one_line(words))
    # Arbitrary units, where it is light.
    if _ABSORBANCE.search(_ARBITRARY.sub("", words) if _EMISSION.search(words) else words):
        return "absorbance"
    if _INDEX.search(words):
        return "index"
    if _RADIANCE_FACTOR.search(words):
        return "radiance factor"
    through, back = _TRANSMITTANCE.search(words), _REFLECTANCE.search(words)
    light = _SENT_ON.sub("", words)
    if light != words and not (_TRANSMITTANCE.search(light) or _REFLECTANCE.search(light)):
        if _EMISSION.search(light):
            return "emission"
        sent_on = _LETTERS.search(light) is not None
    else:
        sent_on = _RADIANCE.search(light) is not None
    if through or back:
        unclear = (sent_on and unit_in(words) is None) or (through and back)
        return None if unclear else "transmittance" if through else "reflectance"
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
    lines = [one_line(line) for line in words.splitlines()[:400]]
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
    heading = one_line(heading)
    if _ONE_MINUS.fullmatch(heading):
        return not any(map(_NUMBERED_LETTER.fullmatch, others))
    named = _A_LETTER.search(heading) or _REFLECTANCE.search(heading) or _TRANSMITTANCE.search(heading)
    return bool(named and re.search(_DERIVED, heading, re.I)) and not _EMISSION.search(heading)


def measured(named: str | None) -> Quantity | None:
    """Return the quantity that `quantity_in` told, None where it told none or one that is no spectrum of a colour."""
    return {name: name for name in get_args(Quantity)}.get(named)


def names_sensitivity(heading: str) -> bool:
    """Return whether a heading is that of an eye's or a sensor's sensitivity; elsewhere it may be an instrument's
    setting.
    """
    return bool(_SENSITIVITY.search(one_line(heading)))


def names_raw(heading: str) -> Literal["counts", "photons"] | None:
    """Find the raw quantity that a heading names, counted and not measured as power: an instrument's counts, or
    photons.
    """
    heading = one_line(heading)
    return "photons" if _PHOTONS.search(heading) else "counts" if _COUNTS.search(heading) else None


def names_power_per_frequency(words: str) -> bool:
    """Return whether words name power per hertz, electronvolt or wavenumber, such as "W/m2/Hz"."""
    return bool(_PER_FREQUENCY.search(one_line(words)))


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
    plain = [re.sub(r"\W*[\[(].*|[_ -]?bar$", "", one_line(heading).casefold()).strip() for heading in headings]
    if len(plain) == 3 and not any(plain) and _OBSERVER_FILE.search(file):
        return "sensitivity"
    capital = any(heading.startswith("N") for heading in headings)  # a sample; the index is n
    if {"r", "g", "b"} <= {word[:1] for word in plain} and len(plain) < 7 and all(map(_CHANNELS.fullmatch, plain)):
        return "colours"
    return _SETS.get(frozenset(plain)) if len(set(plain)) == len(plain) and not capital else None


def names_power(heading: str) -> bool:
    """Return whether a heading as a whole is a word for light that is given off, such as "Relative power" or "W"."""
    return bool(_POWER.fullmatch(one_line(heading)))


def names_any_power(heading: str) -> bool:
    """Return whether a heading as a whole is a word such as "Intensity", which reflected light has, too."""
    return bool(_ANY_POWER.fullmatch(one_line(heading)))


def names_density(name: str) -> bool:
    """Return whether a name is that of optical densities or absorbances, such as "macular density" or "den_lens"."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", one_line(name)).replace("_", " ")
    return bool(_DENSITY.search(words))


def names_perhaps_light(name: str) -> bool:
    """Return whether a name is as likely that of a light as of a sample, such as "F11" or "cool white"."""
    return bool(_PERHAPS_LIGHT.fullmatch(one_line(name).replace("_", " ")))


def names_light(words: str) -> bool:
    """Return whether a name is that of a light, such as "D65", "LED 4000 K" or "Tungsten"."""
    return bool(_LIGHT.search(one_line(words).replace("_", " ")))


def names_only_light(heading: str) -> Literal["light", "perhaps"] | None:
    """Find whether a heading is as a whole that of a light, such as "D65" or "illuminant 2", or may be, as "A" or
    "F11", which samples are called, too.
    """
    heading = one_line(heading).replace("_", " ")
    without_unit = re.sub(r" ?[\[(][^\[\]()]{0,20}[\])]$", "", heading)
    if _A_LIGHT.fullmatch(heading) or _A_LIGHT.fullmatch(without_unit):
        return "light"
    return "perhaps" if _PERHAPS_A_LIGHT.fullmatch(heading) else None


def names_identifier(heading: str) -> Literal["identifier", "perhaps"] | None:
    """Find whether a heading is that of identifiers, such as "id" or "lot no.", or may be, as "lot" and "batch", which
    are samples beside a standard.
    """
    heading = one_line(heading)
    if _IDENTIFIER.fullmatch(heading):
        return "identifier"
    return "perhaps" if _PERHAPS_IDENTIFIER.fullmatch(heading) else None


def is_aside(heading: str) -> bool:
    """Return whether a heading is that of counters, remarks or differences."""
    ways = _without_measured(heading)
    beside = any(pattern.fullmatch(way) for pattern in (_COUNTER, _OF_ROWS) for way in ways)
    return (beside and heading != "#") or re.fullmatch(f"{_RATIO}|{_APART}", heading, re.I) is not None


def names_ratio(heading: str) -> bool:
    """Return whether a heading is that of a sample over its reference, with its unit, such as "Ratio (%)"."""
    return re.match(rf"(?:{_RATIO})\b", heading, re.I) is not None and unit_in(heading) is not None


def names_statistic(words: str) -> bool:
    """Return whether words as a whole are those of a statistic, a mean among them."""
    return bool(SCATTER.fullmatch(words) or _MEAN.fullmatch(words) or re.fullmatch(_STATISTIC, words, re.I))


def is_of_rows(heading: str) -> bool:
    """Return whether a heading is that of scatter, counters or remarks."""
    return SCATTER.fullmatch(heading) is not None or is_aside(heading)


def names_scatter(words: str, means: bool = False) -> bool:
    """Return whether words say scatter or limits and nothing else; means : whether a mean stands beside, else "std" is
    the standard.
    """
    ways = _without_measured(words)
    perhaps = any(map(_PERHAPS_SCATTER.fullmatch, ways)) and not means
    return any(map(_LIMIT.fullmatch, ways)) or (any(map(SCATTER.fullmatch, ways)) and not perhaps)


@lru_cache(maxsize=1 << 14)  # names are asked for several kinds of words
def _without_measured(words: str) -> tuple[str, ...]:
    """Return a heading as it is, without what it is of, and without the quantity that is named in it."""
    words = words.strip()[:_LONGEST_NAME]
    return words, _OF_WHAT.sub("", words), re.sub(_MEASURED_WORD, "", words, flags=re.I).strip()


def names_scatter_in_lines(said: Iterable[str]) -> bool:
    """Return whether a cell or a line that is no key says that what it is about is a scatter."""
    lines = (line.strip() for words in said for line in words.splitlines()[:400])
    titles = (_OF_WHAT.sub("", line[:_LONGEST_NAME]) for line in lines if not line.endswith((":", "=")))
    return any(re.fullmatch(_TITLE_OF_SCATTER, title, re.I) for title in titles)


def statistics_among(names: Sequence[str], said: Sequence[Sequence[str]]) -> list[int]:
    """Places of the spectra that are a scatter, a limit, another statistic, a difference or a weight of others, by
    their names or by what is said of each; none where nothing else is left by name.

    said : cells that say what each is, and lines above its table.
    """
    called = _called_statistics(names, said) if len(names) > 1 else [False] * len(names)
    if all(called):
        called = [False] * len(names)
    return [at for at, said_of in enumerate(said) if called[at] or names_scatter_in_lines(said_of)]


def _called_statistics(names: Sequence[str], said: Sequence[Sequence[str]]) -> list[bool]:
    """Return of each spectrum whether its name, or what is said of it, is that of a statistic of others."""
    names = [name[:_LONGEST_NAME].strip() for name in names]
    of_all = set(said[0]).intersection(*said)
    said = [[each[:_LONGEST_NAME] for each in said_of if each not in of_all] for said_of in said]
    words = [[*_without_measured(name), *said_of] for name, said_of in zip(names, said, strict=True)]
    means = any(_MEAN.fullmatch(each) for words_of in words for each in words_of)
    found = [[match for each in words_of if (match := re.fullmatch(_STATISTIC, each, re.I))] for words_of in words]
    medians = any(match["median"] for matches in found for match in matches)
    ends = {match["end"].casefold() for matches in found for match in matches if match["end"]}
    kinds = {"end", "sum", "alone"} if means or medians or len(ends) > 1 else set()
    numbered = [match["quantile"] for matches in found for match in matches if match["quantile"]]
    known = all(_QUANTILES.fullmatch(each) and (medians or each[0] in "pP") for each in numbered)
    if kinds and known and any(map(_UPPER.fullmatch, numbered)):
        kinds |= {"quantile"}
    kinds |= {"median"} if means else set()
    kinds |= {"beside"} if any(map(names_standard, names)) else set()
    return [
        any(names_scatter(each, means) for each in (name, *said_of))
        or is_aside(name)
        or any(match.lastgroup in kinds for match in matches)
        for name, said_of, matches in zip(names, said, found, strict=True)
    ]


def names_standard(name: str) -> bool:
    """Return whether a name as a whole is that of what samples are compared with, such as "Target"."""
    return any(re.fullmatch(_STANDARD, words, re.I) for words in _without_measured(name))


def unit_in(words: str) -> Unit | None:
    """Return whether words say percent or fractions of 1, None if they do not."""
    words = one_line(words)
    if _PERCENT.search(words) or (_HAS_SCALE.search(words) and _power(words) == 2):
        return "percent"
    return "fraction" if _FRACTION.search(words) else None


def other_scale_in(words: str, power_alone: bool = False) -> str | None:
    """Return words that name a scale which is neither percent nor fractions of 1, such as "x1000" and "0-255".

    power_alone : whether no other sign than a power of ten counts, as in names.

    >>> other_scale_in("Reflectance 0-255"), other_scale_in("Reflectance (0-1)"), other_scale_in("R D65/10")
    ('0-255', None, None)
    """
    words = one_line(words)
    if not power_alone and (found := _OTHER_SCALE.search(words)):
        return found[0].strip()
    return words if _power(words) not in (None, 0, 2) else None


def _power(words: str) -> int | None:
    """Return the power of ten of a scale; what is divided by a hundred may have been percent, and is none of these."""
    found = power_of_ten(words, _SCALED)
    return found and (-1 if found.over and found.power == 2 else found.power)


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
