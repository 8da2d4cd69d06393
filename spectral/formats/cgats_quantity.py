"""Quantity that a CGATS table states, and whether the colours beside its spectra are of the same surface.

By the file's own words, the first that speaks:

1. MEAS_TYPE or MEASUREMENT_TYPE: emission, ambient and flash; reflective; transmissive.
2. DEVICE_CLASS: DISPLAY and EMISINPUT are emission, OUTPUT and INPUT reflectance.
3. a .ccss, or the keywords DISPLAY, TECHNOLOGY or LUMINANCE_XYZ_CDM2: emission.
4. the identifier: IT8.7/1 is a target of transmission, /2 to /5 of reflection; then names of fields (REFL_380).
5. "emission", "transmission", "reflection" and their like in the keywords of mode, type, unit and source, then in
   DESCRIPTOR, FILE_DESCRIPTOR and TARGET_TYPE, then in any other.
6. nothing: then signs that agree (`shared.decisions`), or the person who imports it. A display or a light in one of
   those three is a sign; so are geometry, condition and white base of an instrument that measures surfaces, amounts of
   ink, an illuminant that colours were computed for, colours beside the spectra that are those of surfaces, and values
   of a SPECT file above its norm. What was taken so and is at odds with the colours beside is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ...runtime.errors import InputError
from ..spectrum import Quantity
from .cgats_tables import CgatsTable
from .shared.decisions import Sign, signs_beside, signs_of_name
from .shared.resemblance import Luminances
from .shared.text import shortened
from .shared.words import measured, names_light, names_raw, quantity_in

_MEASURED: tuple[tuple[str, Quantity], ...] = (
    ("EMIS|AMBIENT|FLASH|DISPLAY|PROJECTOR", "emission"),
    ("TRANSM", "transmittance"),
    ("REFLECT|REMISS", "reflectance"),
)
_WORDS: tuple[tuple[re.Pattern[str], Quantity], ...] = (
    (re.compile(r"emissi(?:on|ve)|irradian|(?<!ir)radiance(?![ _-]*factor)", re.I), "emission"),
    (re.compile(r"transmi(?:ssi|tt[ae])", re.I), "transmittance"),
    (re.compile(r"reflect(?!or)|r[eé]flexi|r[eé]mission\b", re.I), "reflectance"),
)
# Targets of film and of photographic paper, and of four-colour printing.
_TARGET = re.compile(r"IT8\.7/([1-5])(?!\d)", re.I)
_TARGETS: dict[str, Quantity] = {"1": "transmittance", **dict.fromkeys("2345", "reflectance")}
_MODE = re.compile(r"MODE(?!L)|TYPE|UNIT|^MEAS")
_DESCRIPTIONS = ("DESCRIPTOR", "FILE_DESCRIPTOR", "TARGET_TYPE")
# Keywords on the origin of the file and the backing of the sample, which say nothing of the measurement.
_ELSEWHERE = ("ORIGINATOR", "MANUFACTURER", "CREATED", "SAMPLE_BACKING", *_DESCRIPTIONS)
_SCREEN = re.compile(r"\b(?:display|monitor|projector|ambient|flash)", re.I)
# Signs of an instrument for surfaces: a white that its readings relate to, and two angles.
_SURFACE_WORDS = re.compile(r"white ?base|\b45\D{0,8}0\b|\b0\D{0,3}45\b|\bd[ie]?[/:] ?[08]\b|sphere|\bSC[IE]\b", re.I)
_INKS = re.compile(r"(?:CMYK?|CMYKOG\w*|\d?CLR)_[CMYK1-9]\w*|DOT_\w+|CMYK\w*", re.I)
_STATE = 'say --as, or add a line MEAS_TYPE "EMISSION", "REFLECTIVE" or "TRANSMISSIVE" below the first one'
# ArgyllCMS calls its own files so, whatever they hold.
_BOILERPLATE = re.compile("power/reflectance", re.I)


class StatedQuantity(NamedTuple):
    """Quantity that a table states, and where; None where nothing does. `named_by`: words that name a light, and no
    more.
    """

    quantity: Quantity | None
    words: str = ""
    named_by: str = ""


def said_quantity(table: CgatsTable, named: Iterable[Quantity | None]) -> StatedQuantity:
    """Find the stated quantity by rules 1 to 6 of this module; `named` is that of the names of spectral fields.

    Raises
    ------
    InputError : words of one rank, or the identifier and words, say different things; or they say absorbance.
    """
    keywords = table.keywords
    for key in ("MEAS_TYPE", "MEASUREMENT_TYPE"):
        _check_named(key, keywords.get(key, ""), names_raw(keywords.get(key, "")))
        for pattern, quantity in _MEASURED:
            if re.search(pattern, keywords.get(key, ""), re.I):
                return StatedQuantity(quantity, f"the keyword {key}")
    device = keywords.get("DEVICE_CLASS", "").upper()
    if device in ("DISPLAY", "EMISINPUT") or table.identifier.upper().startswith("CCSS"):
        return StatedQuantity("emission", "its device class" if device else f"the identifier {table.identifier}")
    if device in ("OUTPUT", "INPUT"):
        return StatedQuantity("reflectance", f"DEVICE_CLASS {device}")
    if named_display := {"DISPLAY", "TECHNOLOGY", "LUMINANCE_XYZ_CDM2"} & set(keywords):
        return StatedQuantity("emission", f"the keyword {min(named_display)}")
    target = _TARGET.match(table.identifier)
    identified = _TARGETS[target[1]] if target else None
    said = _by_words(keywords)
    if identified and said and said != identified:
        raise _contradiction("identifier", f"{table.identifier}, and words that say {said}")
    by_field: Quantity | None = next((one for one in named if one), None)
    if identified or by_field or said:
        where = (
            f"the identifier {table.identifier}" if identified else "names of fields" if by_field else "its keywords"
        )
        return StatedQuantity(identified or by_field or said, where)
    for key in _DESCRIPTIONS:
        words = keywords.get(key, "")
        if names_light(words) or _SCREEN.search(words):
            return StatedQuantity(None, "", f"{key}, {shortened(words, 60)!r}")
    return StatedQuantity(None)


def _by_words(keywords: dict[str, str]) -> Quantity | None:
    by_rank: tuple[dict[str, Quantity], ...] = ({}, {}, {})  # of mode, descriptions, any other
    for key, words in keywords.items():
        if key in _DESCRIPTIONS:
            words = "" if _BOILERPLATE.search(words) else words
            _check_named(key, words)
            if quantity := measured(quantity_in(words)):
                by_rank[1][key] = quantity
        elif quantity := measured(quantity_in(words)) if "UNIT" in key else _one_of(words):
            if _MODE.search(key):
                by_rank[0][key] = quantity
            elif key not in _ELSEWHERE:
                by_rank[2][key] = quantity
    for found in by_rank:
        if len(set(found.values())) > 1:
            raise _contradiction(" and ".join(found), ", ".join(dict.fromkeys(found.values())))
        if found:
            return next(iter(found.values()))
    return None


def _check_named(key: str, words: str, raw: str | None = None) -> None:
    """Refuse what a keyword calls an absorbance or an index; raw : what it calls counts or photons, refused, too."""
    named = raw or quantity_in(words)
    if named and not measured(named):
        raise InputError(
            f"{named} {'are' if raw else 'is'} not the spectrum of a colour",
            field=key,
            found=shortened(words),
            expected="reflectance, transmittance or emission",
            hint=f"where it is another one, {_STATE}",
        )


def _one_of(words: str) -> Quantity | None:
    found: list[Quantity] = [quantity for pattern, quantity in _WORDS if pattern.search(words[:4000])]
    return found[0] if len(found) == 1 else None


def _contradiction(field: str, found: str) -> InputError:
    expected = "one of emission, reflectance and transmittance"
    return InputError(
        "the file says two things of what was measured", field=field, found=found, expected=expected, hint=_STATE
    )


def signs_of_table(
    table: CgatsTable, said: StatedQuantity, condition: str | None, beside: Luminances, above_norm: bool, path: Path
) -> list[Sign]:
    """Return the signs of a table that states nothing (rule 6), but those in its numbers.

    Parameters
    ----------
    beside : the luminances of the colours beside the spectra, against the spectra as surfaces.
    above_norm : whether values exceed SPECTRAL_NORM by more than a fluorescent white does.
    """
    found = signs_of_name("file name", path.stem, "the file name")
    surfaces, ratio = beside.of_surfaces, beside.ratio
    several = len(surfaces) > 1 and max(surfaces) > 1.1 * min(surfaces) and beside.mostly_of_surfaces
    if said.named_by and not several:
        found.append(Sign("words beside", "emission", said.named_by))
    for key in _DESCRIPTIONS:
        if not said.named_by and not _BOILERPLATE.search(table.keywords.get(key, "")):
            found += signs_beside(table.keywords.get(key, ""), key, path)
    if instrument := next((key for key, words in table.keywords.items() if _SURFACE_WORDS.search(words)), None):
        found.append(Sign("instrument", "reflectance", f"the keyword {instrument} of an instrument for surfaces"))
    if condition:
        found.append(Sign("condition", "reflectance", f"the condition {condition} of reflection"))
    if any(_INKS.fullmatch(field) for field in table.fields):
        found.append(Sign("fields", "reflectance", "amounts of ink"))
    if any(field.upper().startswith(("SPECTRAL_PCT", "SPECTRAL_DEC")) for field in table.fields):
        found.append(Sign("fields", "reflectance", "fields in parts of a white"))
    if table.identifier.upper() == "SPECT":
        found.append(Sign("format", "emission", "SPECT without a MEAS_TYPE"))
    if surfaces:
        found.append(Sign("colours beside", "reflectance", "a colour beside, which is that of a surface"))
    if several:
        found.append(Sign("several colours", "reflectance", f"{len(surfaces)} colours of that kind"))
    elif ratio is not None and not 0.1 < ratio < 10.0:
        found.append(Sign("colours beside", "emission", "colours beside, which no surface of these spectra has"))
    if above_norm:
        found.append(Sign("norm", "emission", "values above SPECTRAL_NORM"))
    return found


def check_agreement(ratio: float | None, assumed: str) -> None:
    """Refuse what was only assumed where the colours beside the spectra say that it is wrong, by a factor of ten."""
    if ratio is not None and not 0.1 < ratio < 10.0:
        raise InputError(
            "the spectra are not those of the colours beside them",
            field="XYZ and Lab",
            found=f"a luminance {ratio:.3g} times that of the spectra, taken as {assumed}",
            expected="a file that says what was measured, and the scale of its values",
            hint=f'{_STATE}, and SPECTRAL_NORM "1" or "100"',
        )
