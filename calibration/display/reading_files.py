"""Files of readings: `.ti3` and its relatives, tables (CSV) and CxF3, each told by its content."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import existing_file, read_text
from ...spectral.formats import cgats, cxf
from ...spectral.formats.cgats_bands import bands, grid_of
from ...spectral.formats.cgats_tables import CgatsTable, read_tables
from ...spectral.formats.registry import names_its_file
from .cxf_readings import read_cxf
from .readings import Readings, ReadingSpectra

#: Full scales that codes are written to.
SCALES = (1.0, 100.0, 255.0, 1023.0, 65535.0)
_HEAD = 4096
# Y of white that may be meant relative to it: about 100, or that of no display, in cd/m2.
_NEARLY_100, _DARKEST_WHITE = 1.0, 2.0
# Words at the heads of columns.
_CODES = ("rgb_r", "rgb_g", "rgb_b"), ("r", "g", "b"), ("red", "green", "blue")
_XYZ = ("xyz_x", "xyz_y", "xyz_z"), ("x", "y", "z")
_UNIT = re.compile(r"cd\s*/?\s*m|nit", re.I)


@dataclass(frozen=True)
class Answers:
    """Answers to questions that files of readings leave open.

    codes : the number that is full scale. unit : "cd/m2" or "Y100". luminance : cd/m2 of white, for "Y100".
    observer : whose XYZ they are.
    """

    codes: float | None = None
    unit: str | None = None
    luminance: float | None = None
    observer: str | None = None


NOTHING_SAID = Answers()


@names_its_file
def read_readings(path: Path, answers: Answers = NOTHING_SAID) -> Readings:
    """Read the patches of one display.

    Raises
    ------
    InputError : no such file; none of the formats; several displays in it; a scale that it leaves open; bad numbers.
    """
    path = existing_file(path)
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if cxf.recognises(path, head):
        return read_cxf(path, answers.codes, answers.observer or "1931_2")
    if cgats.recognises(path, head):
        return _of_tables(path, read_tables(path), answers)
    return _of_csv(path, read_text(path), answers)


def _of_tables(path: Path, tables: list[CgatsTable], answers: Answers) -> Readings:
    identifier = tables[0].identifier.upper()
    if identifier.startswith(("CCSS", "CCMX", "CTI1", "CAL")):
        what = {"CCSS": "spectra of primaries", "CCMX": "a correction of an instrument", "CTI1": "patches to measure"}
        raise InputError(
            "no readings of patches",
            field="identifier",
            found=f"{identifier}: {what.get(identifier[:4], 'a calibration')}",
            expected="a file of codes and of what was measured of each, such as .ti3",
            hint="`metamer display observer` compares ccss files" if identifier.startswith("CCSS") else None,
        )
    tables = [table for table in tables if _columns(table.fields, _CODES)]
    if len(tables) != 1:
        raise InputError(
            "readings of several displays in one file" if tables else "no codes beside the readings",
            field="BEGIN_DATA_FORMAT",
            found=f"{len(tables)} tables of codes and readings" if tables else "no RGB_R, RGB_G, RGB_B",
            expected="one table with RGB_R, RGB_G, RGB_B and XYZ_X, XYZ_Y, XYZ_Z or spectra",
            hint="split the file, one display in each" if tables else "export the codes with the readings",
        )
    table = tables[0]
    if "DISPLAY" in (field.upper() for field in table.fields):
        column = [field.upper() for field in table.fields].index("DISPLAY")
        _one_display({row[column] for row in table.rows})
    numbers = np.array([[table.number(cell) for cell in row] for row in table.rows])
    codes = numbers[:, _columns(table.fields, _CODES)]
    luminance = _luminance(table)
    normalised = table.keywords.get("NORMALIZED_TO_Y_100", "").upper() == "YES"
    spectra, at = None, _columns(table.fields, _XYZ)
    if fields := bands(table):
        grid, order = grid_of(table, fields)
        norm = float(table.keywords.get("SPECTRAL_NORM", "1"))
        # ArgyllCMS writes mW of emission.
        radiance = numbers[:, [fields[one].column for one in order]] / (1000.0 * norm)
        spectra = ReadingSpectra(grid, radiance)
    observer = answers.observer or "1931_2"
    if at:
        xyz, unit = numbers[:, at], "Y100" if normalised else answers.unit
        if identifier.startswith("CTI3") and not normalised:
            unit = "cd/m2"
    elif spectra is not None:
        xyz, unit = spectra.xyz(observer), "cd/m2"
    else:
        raise InputError(
            "no XYZ and no spectra", field="BEGIN_DATA_FORMAT", expected="XYZ_X, XYZ_Y, XYZ_Z or SPEC_380 ..."
        )
    keywords = table.keywords
    # The format has percent; a file with larger numbers is not of its makers.
    scale = answers.codes or (100.0 if identifier.startswith("CTI3") else None)
    return _made(
        path,
        codes,
        xyz,
        scale,
        unit,
        Answers(answers.codes, answers.unit, answers.luminance or luminance, observer),
        display=keywords.get("DISPLAY") or _described(keywords.get("DESCRIPTOR", "")),
        instrument=keywords.get("TARGET_INSTRUMENT", keywords.get("INSTRUMENT", "")),
        measured=keywords.get("CREATED", ""),
        spectra=spectra,
    )


def _described(words: str) -> str:
    """Return what a descriptor calls the display; ArgyllCMS describes its file there, whatever was measured."""
    return "" if words.casefold().startswith("argyll") else words


def _luminance(table: CgatsTable) -> float | None:
    words = table.keywords.get("LUMINANCE_XYZ_CDM2", "").split()
    return table.number(words[1]) if len(words) == 3 else None


def _columns(fields: list[str], known: tuple[tuple[str, ...], ...]) -> list[int]:
    """Columns of the three names of the first triple that is all there; none where none is."""
    lower = [re.sub(r"[\s_]*(?:[\[(]|cd\s*/|nits?\b).*", "", field, flags=re.I).strip().casefold() for field in fields]
    for triple in known:
        if all(name in lower for name in triple):
            return [lower.index(name) for name in triple]
    return []


def _of_csv(path: Path, text: str, answers: Answers) -> Readings:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    mark = next((mark for mark in (";", "\t", ",") if mark in lines[0]), ",")
    heads = [cell.strip().strip('"') for cell in lines[0].split(mark)]
    codes_at, xyz_at = _columns(heads, _CODES), _columns(heads, _XYZ)
    if not (codes_at and xyz_at):
        raise InputError(
            "not a file of readings",
            field="line 1",
            found=", ".join(heads)[:120],
            expected="columns r, g, b and X, Y, Z, or a .ti3 or CxF3 file",
        )
    rows = [[cell.strip().strip('"') for cell in line.split(mark)] for line in lines[1:]]
    for at, row in enumerate(rows, 2):
        if len(row) != len(heads):
            raise InputError("a row of another length", field=f"line {at}", found=f"{len(row)} cells",
                             expected=f"{len(heads)}, as the first line has")  # fmt: skip
    lower = [head.casefold() for head in heads]
    if "display" in lower:
        _one_display({row[lower.index("display")] for row in rows})
    comma = mark != "," and any("," in row[at] for row in rows for at in (*codes_at, *xyz_at))

    def number(cell: str) -> float:
        try:
            return float(cell.replace(",", ".") if comma else cell)
        except ValueError:
            return float("nan")

    codes, xyz = (np.array([[number(row[at]) for at in which] for row in rows]) for which in (codes_at, xyz_at))
    if not rows:
        raise InputError("no readings", field="rows", found="a head alone", expected="a row a reading")
    unit = answers.unit or ("cd/m2" if any(_UNIT.search(heads[at]) for at in xyz_at) else None)
    display = rows[0][lower.index("display")] if "display" in lower else ""
    return _made(path, codes, xyz, answers.codes, unit, answers, display=display)


def _one_display(names: set[str]) -> None:
    if len(names) > 1:
        raise InputError(
            "readings of several displays in one file",
            field="display",
            found=", ".join(sorted(names)[:4]),
            expected="one display",
            hint="split the file, one display in each",
        )


def _made(
    path: Path,
    codes: np.ndarray,
    xyz: np.ndarray,
    scale: float | None,
    unit: str | None,
    answers: Answers,
    display: str = "",
    instrument: str = "",
    measured: str = "",
    spectra: ReadingSpectra | None = None,
) -> Readings:
    """Readings on the scale 0 to 1 and in cd/m2, as far as that is known."""
    scale = scale or _scale(codes)
    if np.isfinite(codes).all() and codes.max() > scale * (1.0 + 1e-9):
        raise InputError(
            "codes beyond their scale",
            field="codes",
            found=f"{codes.max():g}, where {scale:g} is full scale",
            expected=f"0 to {scale:g}",
            hint="say which number is full scale: --codes 1, 100, 255 or 1023",
        )
    notes = [f"codes are parts of {scale:g}"]
    white = (codes >= scale * (1.0 - 1e-9)).all(axis=1)
    luminous = float(xyz[white, 1].mean()) if white.any() else np.nan
    if unit is None and (abs(luminous - 100.0) <= _NEARLY_100 or luminous <= _DARKEST_WHITE):
        raise InputError(
            "XYZ may be cd/m2 or relative to white = 100",
            field="XYZ",
            found=f"white with Y = {luminous:.4g}",
            expected="to be told which",
            hint="--xyz cd/m2, or --xyz Y100 with --white-luminance L; multiply by 100 where white is 1",
        )
    absolute = unit != "Y100" or answers.luminance is not None
    if unit == "Y100" and answers.luminance is not None:
        xyz = xyz * (answers.luminance / 100.0)
        notes.append(f"XYZ relative to white = 100, times {answers.luminance:g} cd/m2")
    elif unit == "Y100":
        notes.append("XYZ are relative to white = 100: no luminance is known")
    return Readings(
        codes / scale,
        xyz,
        str(path),
        display,
        instrument,
        answers.observer or "1931_2",
        absolute,
        spectra,
        measured,
        notes=tuple(notes),
    )


def _scale(codes: np.ndarray) -> float:
    """Return the full scale that a largest code tells; anything else is asked."""
    largest = float(np.nanmax(codes))
    for scale in SCALES:
        whole = np.all(codes == np.round(codes))
        # 1 of whole numbers is one step of many, and 100 of whole numbers may be of 255.
        if largest == scale and not (whole and scale in (1.0, 100.0)):
            return scale
    raise InputError(
        "the scale of the codes is not told",
        field="codes",
        found=f"largest {largest:g}",
        expected="a largest code of 255, 1023 or 65535, or of 1 or 100 with fractions below",
        hint="say which number is full scale: --codes 1, 100, 255 or 1023",
    )
