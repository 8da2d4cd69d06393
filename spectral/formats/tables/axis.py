"""The unit of a table's axis, and the wavelength in nm of each of its values: lengths, frequencies, energies."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from ..shared.languages import spelt
from ..shared.text import lowered, power_of_ten

# c in m/s, h in J s, e in C: exact by the definition of the SI (BIPM, 2019); and c in nm per ps, which is nm times THz,
# and h c / e in nm times eV.
_C, _H, _E = 299_792_458.0, 6.62607015e-34, 1.602176634e-19
_NM_THZ = _C * 1e-3
_NM_EV = _H * _C / _E * 1e9


class AxisUnit(NamedTuple):
    """A unit of wavelengths, or of what is in inverse proportion to them.

    Parameters
    ----------
    name : as it is written.
    nm : nanometres per unit; of a reciprocal one, nanometres times units.
    reciprocal : whether a wavelength is `nm` divided by a value.
    """

    name: str
    nm: float
    reciprocal: bool = False

    def wavelengths_nm(self, values: Float[np.ndarray, "L"]) -> Float[np.ndarray, "L"]:
        """Wavelengths of values on the axis.

        Raises
        ------
        InputError
            A frequency or an energy that is not above 0.
        """
        if not self.reciprocal:
            return values * self.nm
        if values.size and not values.min() > 0.0:
            raise InputError(
                "no frequency or energy of light", field=self.name, found=f"{values.min():g}", expected="above 0"
            )
        return self.nm / values

    @property
    def is_slow(self) -> bool:
        """True if it counts waves that are not of light: hertz, and their thousands, millions and billions."""
        return self.reciprocal and self.nm > _NM_THZ and "hz" in self.name.lower()

    @property
    def formula(self) -> str:
        """Formula that makes wavelengths of its values, for a note."""
        return f"nm = {self.nm:.10g} / {self.name}" if self.reciprocal else f"nm = {self.nm:g} {self.name}"


NANOMETRE = AxisUnit("nm", 1.0)

_POWER = r"(?:(?:1e|10 ?(?:\^|\*\*)? ?)\+?(?P<power>\d{1,2}) ?\*? ?)?"
_BEFORE, _BEHIND = r"(?<![A-Za-zÅåµμ/])", r"(?![A-Za-z])(?!\s?(?:\^|\*\*)?[-⁻−])"
_PREFIXES = {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9, "t": 1e12, "p": 1e15}
_INVERSE, _ALONE = r" ?(?:\^|\*\*)? ?[\[({]? ?[-⁻−] ?[1¹]", r"(?![A-Za-z])"
_FREQUENCY = re.compile(rf"{_BEFORE}{_POWER}(?P<prefix>[kMGTP]?)Hz{_BEHIND}", re.I)
_ENERGY = re.compile(rf"{_BEFORE}(?P<prefix>[mk]?)eV{_BEHIND}|(?P<word>electron ?volts?)", re.I)
_ANGULAR = re.compile(
    rf"{_BEFORE}{_POWER}rad(?:ians?)? ?"
    r"(?:(?:/|per) ?(?P<over>[fpn]?)s(?:ec\w*)?|[·.* ]?(?P<times>[fpn]?)s ?(?:\^|\*\*)?[-⁻−][1¹])",
    re.I,
)
_WAVENUMBER = re.compile(r"wave.?numbers?|cm ?(?:\^|\*\*)? ?\(?[-⁻−] ?[1¹]|(?<!\d)1 ?/ ?cm|kaysers?", re.I)
# Waves in a length, such as um-1 and 1/nm; of a power, they are its density over wavelengths.
_IN_A_LENGTH = re.compile(
    rf"(?<![A-Za-z])(?P<over>1 ?/ ?)?(?P<length>nm|[µμu]m|mm|m)(?(over){_ALONE}|{_INVERSE})|"
    r"(?-i:(?<![A-Za-z])kK(?![A-Za-z]))",
    re.I,
)
_OF_POWER = re.compile(r"(?<![A-Za-z])[mkµμunp]?W(?![A-Za-z])|radian|radia[tn]|power|photon|flux|quanta", re.I)
# A quantity over its unit, as ISO 80000 writes headings.
_OVER_UNIT = re.compile(
    r"^\W*(λ|lambda|wave ?length|wellenl\w+|ν|nu|f|freq\w*|(?-i:E)|h ?ν|hv|(?:photon\w* ?)?energ\w+|ω|omega|wellenzahl|"
    r"wave ?number) ?/ ?",
    re.I,
)
_LENGTHS_NM = {"nm": 1.0, "um": 1e3, "mm": 1e6, "m": 1e9}
_MICROMETRE = re.compile(r"[µμ]m|(?<![A-Za-z])um(?![A-Za-z])|microns?\b|micromet", re.I)
_ANGSTROM = re.compile(r"[åÅ]|angstr|ångstr|[\[(]\s?(?-i:A)\s?[\])]", re.I)
# Metres and parts of them, in brackets; behind a power of ten, in which they are counted.
_METRES = re.compile(
    r"(?:[\[(] ?|(?P<power>10 ?(?:\^|\*\*) ?\(?[-−]|1e[-−])(?P<places>\d{1,2})\)? ?[·*×]? ?)"
    r"(?-i:(?P<prefix>[pcm]?)m)(?= ?[\])]|\W*$)",
    re.I,
)
_METRES_NM = {"": 1e9, "c": 1e7, "m": 1e6, "p": 1e-3}
# Units before which a power of ten may stand.
_UNITS = r"nanomet|micron|angstr|(?:nm|[µμu]m|[åÅ]|[kMGTP]?Hz|m?eV|cm)(?![a-z])"
_STEP = re.compile(r"step|interval|increment|band|slit|resol|fwhm|\bpas\b|schritt|abstand", re.I)
_NANOMETRE = re.compile(r"(?<![A-Za-z/])nm(?![A-Za-z])|nanomet", re.I)
_NO_LENGTH = re.compile(
    r"^\W*(?:photon[ _]?|angular[ _]?|optical[ _]?)?(?:frequenc(?:y|ies)|freq|frequenz|fr[eé]quence|energ(?:y|ies|ie)|"
    r"omega|ω|ν|hν|hv|nu)\b",
    re.I,
)
_NO_WAVELENGTHS = re.compile(
    r"\W*(?:temp(?:erature|eratur)?|depth|thickness|dicke|distance|abstand|voltage|position|concentration|angles?|winkel|"
    r"(?:ccd|sensor|detector|x)?[ _]*[\[(]?(?:pixels?|px|pix)|channels?|chan|kan[aä]le?|canal(?:es|i)?|canaux|bins?|"
    r"(?:data|daten|mess)?[ _]*(?:points?|punkte?)|elements?|(?:photo)?diodes?|rows?|counter|index|idx|indices|"
    r"bands?(?!.*(?:nm|[µμu]m|mic))|(?:wave(?:length)?|wellenl[aä]ngen?|lambda|λ)[ _-]*(?:index|idx|step)|"
    r"times?|zeit|temps|seconds?|sec|ms|frames?|scans?|fwhm|(?:band|line)[ _-]*width|slit(?:[ _-]*width)?|diameter|"
    r"(?:(?:particle|grain)[ _]*)?size|(?:spectral[ _]*)?resolution|raman(?:[ _]*shift)?|m/z|period|kelvin|"
    r"t ?(?=[\[(](?-i:K|s|ms|°C)[\])])|2[ _]*(?:theta|θ))"
    r"[ _.]*(?:no|nr|num(?:ber)?|index|idx|#)?\W*(?:[\[(][^\[\]()]{0,20}[\])])?\W*",
    re.I,
)
# Steps that differ by less than the first share of their mean are equal, but for digits that were left out; by more
# than the second, they are not. So many values are enough to tell.
_EVEN, _UNEVEN, _FEWEST_EVEN = 0.05, 0.1, 6
#: Light that instruments read.
LIGHT_NM = (300.0, 1200.0)
# Cells of numbers, of which wide tables have many thousands, need no further look.
_LETTER = re.compile(r"[^\W\d_]")
_LENGTH_WORD = rf"wave.?len|^wave$|^wl\b|λ|lambda|{spelt('wavelength')}"
# Lines above a table that may speak of its axis.
_AXIS_LINE = (
    rf"wave|{spelt('wavelength')}|λ|lambda|freq|energ|ω|omega|\baxis\b|abscissa|"
    r"x[ _-]?(?:units?|axis|label|data|values?)|"
    r"(?:first|1st) column|^\W*(?:[kMGTP]?Hz|m?eV|cm-1|nm|um|µm)\W*$"
)


def axis_unit(words: str) -> AxisUnit | None:
    """Return the unit of an axis that words state, None where they state none; a length goes before all others.

    >>> axis_unit("frequency (THz)").formula, axis_unit("Energy [eV]").formula
    ('nm = 299792.458 / THz', 'nm = 1239.841984 / eV')
    """
    words = _OVER_UNIT.sub(r"\1 ", words[:2000])
    if (match := _IN_A_LENGTH.search(words)) and not _OF_POWER.search(words):
        length = (match["length"] or "").lower().replace("µ", "u").replace("μ", "u")
        return AxisUnit(match[0].strip(), _LENGTHS_NM[length] if length else 1e4, True)
    if _NANOMETRE.search(words):
        return NANOMETRE
    for pattern, length in ((_MICROMETRE, ("µm", 1e3)), (_ANGSTROM, ("Å", 0.1))):
        if pattern.search(words):
            return AxisUnit(*length)
    if match := _ANGULAR.search(words):
        scale = {"": 1.0, "n": 1e9, "p": 1e12, "f": 1e15}[(match["over"] or match["times"] or "").lower()]
        return _reciprocal(match[0], 2.0 * math.pi * _NM_THZ * 1e12 / scale, match["power"])
    if match := _FREQUENCY.search(words):
        return _reciprocal(match[0], _NM_THZ * 1e12 / _PREFIXES[match["prefix"].lower()], match["power"])
    if match := _ENERGY.search(words):
        scale = {"": 1.0, "m": 1e-3, "k": 1e3}[(match["prefix"] or "").lower()]
        return _reciprocal(match[0], _NM_EV / scale, None)
    if _WAVENUMBER.search(words):
        return AxisUnit("cm-1", 1e7, True)
    if match := _METRES.search(lowered(words)):
        nm = _METRES_NM[match["prefix"]] / 10.0 ** int(match["places"] or 0)
        return AxisUnit(match[0].strip(" [()]"), nm)
    return None


def _reciprocal(name: str, nm: float, power: str | None) -> AxisUnit:
    name = name.strip()
    return AxisUnit(f"({name})" if power or "/" in name else name, nm / 10.0 ** int(power or 0), True)


def scaled(
    values: Float[np.ndarray, "L"], unit: AxisUnit, heading: str, field: str
) -> tuple[Float[np.ndarray, "L"], str]:
    """Return the values of an axis whose heading has a power of ten, such as "nm x10", in its unit, and what was done
    for a note, "" where nothing was: multiplied or divided, whichever makes light of them; field : where it stands.

    Raises
    ------
    InputError
        They are light as they stand, and the power of ten is not their step; or neither way.
    """
    own = lowered(heading[:2000])
    for pattern in (_FREQUENCY, _ANGULAR, _METRES):
        own = pattern.sub("", own)
    found = None if _STEP.search(own) else power_of_ten(own, _UNITS)
    if found is None or not values.size:
        return values, ""
    ways = {"multiplied": values * 10.0**found.power, "divided": values / 10.0**found.power}
    fitting = [way for way, tried in ways.items() if _are_seen(tried, unit)]
    if _are_seen(values, unit):
        # "Wavelength (10 nm)" may speak of their step.
        if not found.power or (found.of_unit and np.allclose(np.abs(np.diff(values)), 10.0**found.power)):
            return values, ""
    elif len(fitting) == 1:
        return ways[fitting[0]], f"{fitting[0]} by {10**found.power}"
    raise InputError(
        "a power of ten at the axis that its values do not bear out",
        field=field,
        found=f"{values[0]:g} ... {values[-1]:g} below {heading.strip()!r}",
        expected="wavelengths of light, as they stand or by that power of ten",
        hint="write the wavelengths themselves and their unit: Wavelength (nm)",
    )


def _are_seen(values: Float[np.ndarray, "L"], unit: AxisUnit) -> bool:
    """Return whether values of an axis are wavelengths that reach into the visible."""
    if unit.reciprocal and not values.min() > 0.0:
        return False
    nm = unit.wavelengths_nm(values)
    return bool(nm.min() >= 100.0 and nm.min() <= 700.0 and nm.max() >= 420.0)


def is_reciprocal_header(cell: str) -> bool:
    """Return whether a header says that its column holds frequencies, energies or wavenumbers."""
    if not _LETTER.search(cell):
        return False
    unit = axis_unit(cell)
    return unit.reciprocal if unit else bool(_NO_LENGTH.search(cell))


def refuse_even_reciprocals(values: Float[np.ndarray, "L"], field: str) -> None:
    """Refuse an axis without a word that is uneven as it stands, and even as what it is the reciprocal of: wavelengths
    in equal steps that were written as frequencies, energies or wavenumbers; field : where it stands.

    Raises
    ------
    InputError
        They are; for they may be wavelengths in nm all the same.
    """
    if values.size < _FEWEST_EVEN or not values.min() > 0.0 or _unevenness(values) < _UNEVEN:
        return
    for unit in (AxisUnit("THz", _NM_THZ, True), AxisUnit("eV", _NM_EV, True), AxisUnit("cm-1", 1e7, True)):
        nm = unit.wavelengths_nm(values)
        if nm.min() >= LIGHT_NM[0] and nm.max() <= LIGHT_NM[1] and _unevenness(nm) <= _EVEN:
            raise InputError(
                f"wavelengths, or {unit.name}?",
                field=field,
                found=f"{values[0]:g}, {values[1]:g} ... {values[-1]:g}: as {unit.name} {nm[0]:.5g} to {nm[-1]:.5g} nm "
                "in equal steps",
                expected="an axis whose heading says what it is",
                hint=f"write the unit into the heading of the axis: {unit.name}, or nm",
            )


def refuse_angstroms(values: Float[np.ndarray, "L"], field: str) -> None:
    """Refuse an axis without a unit whose values are of light as Å, and of none that anybody sees as nm; field : where
    it stands.

    Raises
    ------
    InputError
        They are; for infrared in nm may be meant all the same.
    """
    lowest, highest = (10.0 * end for end in LIGHT_NM)
    if values.size and values.min() >= lowest and values.max() <= highest:
        raise InputError(
            "wavelengths in nm, or in Å?",
            field=field,
            found=f"{values[0]:g}, {values[1 % values.size]:g} ... {values[-1]:g}: as Å {values[0] / 10.0:g} to "
            f"{values[-1] / 10.0:g} nm",
            expected="an axis whose heading gives its unit",
            hint="write the unit into the heading of the axis: Å, or nm",
        )


def _unevenness(values: Float[np.ndarray, "L"]) -> float:
    """Return the most that a step differs from the mean step, as a share of it."""
    steps = np.diff(values)
    mean = float(steps.mean())
    return float(np.abs(steps / mean - 1.0).max()) if mean else math.inf


def is_no_axis(heading: str) -> bool:
    """Return whether a heading calls an axis something else than wavelengths, frequencies or energies."""
    return _NO_WAVELENGTHS.fullmatch(heading.strip()) is not None


def check_axis(heading: str) -> None:
    """Refuse an axis that its heading calls places on a sensor, times, or other lengths.

    Raises
    ------
    InputError
        The heading is a word such as "pixel".
    """
    if is_no_axis(heading):
        raise InputError(
            "an axis that is not of wavelengths",
            field=heading.strip(),
            expected="wavelengths in nm, or a unit such as THz, eV, cm-1 or rad/s in the heading",
            hint="export wavelengths in place of pixels; or call the column Wavelength (nm) where it is that",
        )


def stated_unit(heading: str, lines: Sequence[str]) -> tuple[AxisUnit | None, bool]:
    """Return the unit of an axis by its heading and the unit below, else by lines above the table, and whether by a
    line.

    A heading that speaks of wavelengths, or of frequencies, is believed as far as it goes. Slow frequencies in lines,
    such as a chopper's in Hz, are not of light.

    Raises
    ------
    InputError
        The heading calls it a frequency or an energy, and nothing gives its unit.
    """
    unit = axis_unit(heading)
    if unit is not None:
        return unit, False
    length, no_length = bool(re.search(_LENGTH_WORD, heading, re.I)), bool(_NO_LENGTH.search(heading))
    stated = (axis_unit(line) for line in lines if re.search(_AXIS_LINE, line, re.I))
    found = [unit for unit in stated if unit and not unit.is_slow]
    fitting = [unit for unit in found if not (length and unit.reciprocal) and (unit.reciprocal or not no_length)]
    fitting.sort(key=lambda unit: unit.reciprocal)
    if not fitting and no_length:
        raise InputError(
            "an axis of frequencies or energies without a unit",
            field=heading.strip(),
            expected="wavelengths in nm, or a unit such as THz, eV, cm-1 or rad/s in the heading",
            hint="write the unit into the heading, as in frequency (THz)",
        )
    return (fitting[0], True) if fitting else (None, False)
