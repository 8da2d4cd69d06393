"""What a CGATS table says was measured, and whether the colours beside its spectra are of the same surface.

By the file's own words, the first that speaks:

1. MEAS_TYPE or MEASUREMENT_TYPE: emission, ambient and flash; reflective; transmissive.
2. DEVICE_CLASS: DISPLAY and EMISINPUT are emission, OUTPUT and INPUT reflectance.
3. a .ccss, or the keywords DISPLAY, TECHNOLOGY or LUMINANCE_XYZ_CDM2: emission.
4. the identifier: IT8.7/1 is a target of transmission, IT8.7/2 one of reflection; then names of fields (REFL_380).
5. "emission", "transmission", "reflection" and their like in the keywords of mode, type, unit and source, then in
   DESCRIPTOR, FILE_DESCRIPTOR and TARGET_TYPE, then in any other.
6. a display or a light in one of those three: emission, which a note says, unless the colours beside are of a surface.
7. nothing, which a note says: a SPECT file with values above its norm is emission, the rest reflectance, unless the
   colours beside the spectra are no surface's: then it is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..illuminants import illuminant
from ..observers import observer
from ..spectrum import Quantity
from .cgats_tables import CgatsTable
from .reading import StatedColour
from .shared.text import shortened
from .shared.words import measured, names_light, quantity_in

_MEASURED: tuple[tuple[str, Quantity], ...] = (
    ("EMIS|AMBIENT|FLASH|DISPLAY|PROJECTOR", "emission"),
    ("TRANSM", "transmittance"),
    ("REFLECT|REMISS", "reflectance"),
)
_WORDS: tuple[tuple[re.Pattern[str], Quantity], ...] = (
    (re.compile(r"emissi(?:on|ve)|irradian|(?<!ir)radiance(?![ _-]*factor)", re.I), "emission"),
    (re.compile(r"transmi(?:ssi|tt[ae])", re.I), "transmittance"),
    (re.compile(r"reflect(?!or)|r[eé]mission\b", re.I), "reflectance"),
)
_TARGET = re.compile(r"IT8\.7/([12])(?!\d)", re.I)
_TARGETS: dict[str, Quantity] = {"1": "transmittance", "2": "reflectance"}
_MODE = re.compile(r"MODE(?!L)|TYPE|UNIT|^MEAS")
_DESCRIPTIONS = ("DESCRIPTOR", "FILE_DESCRIPTOR", "TARGET_TYPE")
# Who made the file and what lay below the sample say nothing of the measurement.
_ELSEWHERE = ("ORIGINATOR", "MANUFACTURER", "CREATED", "SAMPLE_BACKING", *_DESCRIPTIONS)
_SCREEN = re.compile(r"\b(?:display|monitor|projector|ambient|flash)", re.I)
_STATE = 'add a line MEAS_TYPE "EMISSION", "REFLECTIVE" or "TRANSMISSIVE" below the first one'
_GRID_NM = np.arange(400.0, 701.0, 10.0)


class Told(NamedTuple):
    """What a table says was measured; None where nothing does. `named_by`: the words that name a light, and no more."""

    quantity: Quantity | None
    named_by: str = ""


def told_quantity(table: CgatsTable, named: Iterable[Quantity | None], path: Path) -> Told:
    """By rules 1 to 6 at the head of this module; `named` is what the names of spectral fields say.

    Raises
    ------
    InputError : words of one rank, or the identifier and words, say different things; or they say absorbance.
    """
    keywords = table.keywords
    for key in ("MEAS_TYPE", "MEASUREMENT_TYPE"):
        for pattern, quantity in _MEASURED:
            if re.search(pattern, keywords.get(key, ""), re.I):
                return Told(quantity)
    device = keywords.get("DEVICE_CLASS", "").upper()
    if device in ("DISPLAY", "EMISINPUT") or table.identifier.upper().startswith("CCSS"):
        return Told("emission")
    if device in ("OUTPUT", "INPUT"):
        return Told("reflectance")
    if {"DISPLAY", "TECHNOLOGY", "LUMINANCE_XYZ_CDM2"} & set(keywords):
        return Told("emission")
    target = _TARGET.match(table.identifier)
    identified = _TARGETS[target[1]] if target else None
    said = _by_words(keywords, path)
    if identified and said and said != identified:
        raise _contradiction(path, "identifier", f"{table.identifier}, and words that say {said}")
    by_field: Quantity | None = next((one for one in named if one), None)
    if identified or by_field or said:
        return Told(identified or by_field or said)
    for key in _DESCRIPTIONS:
        words = keywords.get(key, "")
        if names_light(words) or _SCREEN.search(words):
            return Told("emission", f"{key}, {shortened(words, 60)!r}")
    return Told(None)


def _by_words(keywords: dict[str, str], path: Path) -> Quantity | None:
    by_mode: dict[str, Quantity] = {}
    described: dict[str, Quantity] = {}
    others: dict[str, Quantity] = {}
    for key, words in keywords.items():
        if key in _DESCRIPTIONS:
            # ArgyllCMS calls its own files "Spectral power/reflectance information", whichever they are.
            told = None if "power/reflectance" in words.casefold() else quantity_in(words)
            if told in ("absorbance", "index"):
                expected = "reflectance, transmittance or emission"
                raise InputError(
                    f"{told} is not the spectrum of a colour",
                    file=path,
                    field=key,
                    found=shortened(words),
                    expected=expected,
                    hint=f"where it is another one, {_STATE}",
                )
            if quantity := measured(told):
                described[key] = quantity
        elif quantity := measured(quantity_in(words)) if "UNIT" in key else _one_of(words):
            if _MODE.search(key):
                by_mode[key] = quantity
            elif key not in _ELSEWHERE:
                others[key] = quantity
    for found in (by_mode, described, others):
        if len(set(found.values())) > 1:
            raise _contradiction(path, " and ".join(found), ", ".join(dict.fromkeys(found.values())))
        if found:
            return next(iter(found.values()))
    return None


def _one_of(words: str) -> Quantity | None:
    found: list[Quantity] = [quantity for pattern, quantity in _WORDS if pattern.search(words[:4000])]
    return found[0] if len(found) == 1 else None


def _contradiction(path: Path, field: str, found: str) -> InputError:
    expected = "one of emission, reflectance and transmittance"
    return InputError(
        "the file says two things of what was measured",
        file=path,
        field=field,
        found=found,
        expected=expected,
        hint=_STATE,
    )


def luminance_ratio(
    grids: Iterable[np.ndarray], fractions: Iterable[np.ndarray], stated: Iterable[tuple[StatedColour, ...]]
) -> float | None:
    """The Y that is stated over the Y of the spectra as a surface's, the median of all samples; None where none tells.

    Lab and XYZ count each for itself, and the one nearer to 1 is given: XYZ may be on another scale.

    Parameters
    ----------
    grids, fractions, stated : per sample wavelengths (L,) in nm, values (L,) as fractions of 1, and the colours beside.
    """
    ratios: dict[str, list[float]] = {"XYZ": [], "Lab": []}
    for grid, values, colours in zip(grids, fractions, stated, strict=True):
        there = np.isfinite(values) & np.isfinite(grid)
        if not colours or np.count_nonzero(there) < 2 or grid[there].min() > 450 or grid[there].max() < 650:
            continue
        order = np.argsort(grid[there])
        computed = float(100.0 * _weights() @ np.interp(_GRID_NM, grid[there][order], values[there][order]))
        for colour in colours:
            luminance = float(colour.values[1] if colour.space == "XYZ" else _luminance(colour.values[0]))
            if max(luminance, computed) >= 1.0:
                ratios[colour.space].append(max(luminance, 1e-3) / max(computed, 1e-3))
    medians = [float(np.median(found)) for found in ratios.values() if found]
    return min(medians, key=lambda ratio: abs(np.log(ratio)), default=None)


@cache
def _weights() -> np.ndarray:
    """(L,) of Y, of the perfect diffuser 1; under the equal-energy light, which tells factors of ten."""
    return observer("1931_2").weights(illuminant("E"), _GRID_NM)[1]


def _luminance(lightness: float) -> float:
    """Y of CIELAB's L*, of the perfect diffuser 100."""
    return 100.0 * ((lightness + 16.0) / 116.0) ** 3 if lightness > 8.0 else lightness / 9.033


def check_agreement(ratio: float | None, assumed: str, path: Path) -> None:
    """Refuse what was only assumed where the colours beside the spectra say that it is wrong, by a factor of ten."""
    if ratio is not None and not 0.1 < ratio < 10.0:
        raise InputError(
            "the spectra are not those of the colours beside them",
            file=path,
            field="XYZ and Lab",
            found=f"a luminance {ratio:.3g} times that of the spectra, taken as {assumed}",
            expected="a file that says what was measured, and the scale of its values",
            hint=f'{_STATE}, and SPECTRAL_NORM "1" or "100"',
        )
