"""Columns that makers of spectrometers name in a way of their own, by the words that all tables use.

Spectra Vista's .sig has no header: wavelength, what a white panel sends back, what the target sends back, each in the
unit that the line "units=" gives, and their ratio in percent. Ocean Optics' Jaz heads its columns with letters: W for
wavelengths, D, R and S for the counts of dark, reference and sample, P for what was made of them. Spectral Evolution's
.sed shortens radiance, irradiance and the ratio of target and reference. ASD's ViewSpec Pro calls columns after files,
whose endings say what was made of the reading: "leaf.00001.asd.ref.sco" is a reflectance, corrected at splices. JASCO's
texts have no header: "YUNITS" says what the first channel is, "Y2UNITS" or "YUNITS2" the next, such as a voltage. Nor
have PerkinElmer's: below "#GR" stand the units of both axes, a factor and an offset of the values, a line each.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from ....runtime.errors import InputError
from ..shared.words import measured, quantity_in, quantity_in_lines
from .parsing import TextTable
from .section import Column

_SPECTRA_VISTA = re.compile(r"Spectra Vista(?: Corp\w*)? SIG Data", re.I)
_UNITS = re.compile(r"^\W*units\s*[=:;,\t]\s*(.+)$", re.I | re.M)
_JAZ = {"D": "dark counts", "R": "reference counts", "S": "sample counts", "P": ""}
_JAZ_FILE = re.compile(r"\bJaz\b|Begin Processed Spectral Data", re.I)
_SHORTENED = re.compile(r"((?:ir)?rad)\.(?=\s*[(\[]|\s*$)", re.I)
_ASD = re.compile(r".*\.asd\.(ref|rad)(?:\.(?:sco|pco|mn|md))*(?:\.txt)?", re.I)
_ASD_MADE = {"ref": "reflectance", "rad": "radiance"}
_CHANNELS = re.compile(
    r"^\W*Y(?:(?P<before>\d)[ _]?UNITS|[ _]?UNITS(?P<behind>\d?))\W*[:=,;\t]?\s*(?P<unit>\S.*)$", re.I | re.M
)
_PERKIN_ELMER = re.compile(r"^PE (?:UV|IR)\b.*^nm$\n^(%?[A-Z]{1,4})$\n^([\d.]+)$\n^(-?[\d.]+)$", re.M | re.S)
_RATIO = re.compile(r"t(?:ar)?ge?t\.?\s*/\s*ref(?:erence)?\.?\s*(.*)", re.I)


def name_by_maker(table: TextTable, stem: str) -> None:
    """Give columns of a maker's export the words for what they hold; of other tables nothing is changed.

    stem : of the file's name, which its one measurement is called.
    """
    for block in table.blocks:
        words = [column.words.strip() for column in block]
        if len(block) == 3 and not any(words) and _SPECTRA_VISTA.search(block[0].around):
            _name_spectra_vista(block, stem)
        elif len(block) == 1 and not any(words) and (found := _PERKIN_ELMER.search(block[0].around)):
            _check_untouched(*found.groups()[1:])
            block[0].words = {"A": "absorbance"}.get(found[1], found[1])
        elif len(block) > 1 and not any(words) and (units := _channel_units(block[0].around)):
            for number, column in enumerate(block, 1):
                column.words = units.get(number, "")
                column.name = f"{stem} channel {number}" if number > 1 else stem
        elif _is_jaz(words, block):
            for column, letter in zip(block, words, strict=True):
                column.words, column.name = _JAZ[letter], f"{stem} {_JAZ[letter]}".strip()
        else:
            for column in block:
                _name_spectral_evolution(column)
                if made := _ASD.fullmatch(column.words.strip()):
                    column.words = _ASD_MADE[made[1].lower()]


def _name_spectra_vista(block: Sequence[Column], stem: str) -> None:
    line = _UNITS.search(block[0].around)
    units = [unit.strip() for unit in line[1].split(",")] if line else []
    for column, what, unit in zip(block, ("reference", "target"), [*units, "", ""], strict=False):
        column.words, column.name = f"{what} {unit}".strip(), f"{stem} {what}"
    block[2].words, block[2].unit, block[2].name = "reflectance (%)", "%", stem


def _check_untouched(factor: str, offset: str) -> None:
    """Refuse values of a text of PerkinElmer's with a factor or an offset."""
    if (float(factor), float(offset)) != (1.0, 0.0):
        raise InputError(
            "values with a factor or an offset",
            field="#GR",
            found=f"{factor} and {offset}",
            expected="1 and 0",
            hint="export it from the instrument's program without them",
        )


def _channel_units(around: str) -> dict[int, str]:
    """Units of the channels of a text of JASCO's by their number, where it has several; what is no quantity beside one,
    such as "HT [V]", is a detector's counts.
    """
    found = {int(each["before"] or each["behind"] or 1): each["unit"].strip() for each in _CHANNELS.finditer(around)}
    known = {number: measured(quantity_in(unit)) for number, unit in found.items()}
    if len(found) < 2 or not any(known.values()):
        return {}
    return {number: unit if known[number] else f"{unit} counts" for number, unit in found.items()}


def _is_jaz(words: Sequence[str], block: Sequence[Column]) -> bool:
    if len(set(words)) < len(words) or not set(words) <= set(_JAZ):
        return False
    return len(words) > 2 or (len(words) > 1 and bool(_JAZ_FILE.search(block[0].around)))


def _name_spectral_evolution(column: Column) -> None:
    column.words = _SHORTENED.sub(lambda match: f"{match[1]}iance", column.words)
    if ratio := _RATIO.fullmatch(column.words.strip()):
        measured = "transmittance" if quantity_in_lines(column.around)[0] == "transmittance" else "reflectance"
        column.words = f"{measured} {ratio[1]}".strip()
