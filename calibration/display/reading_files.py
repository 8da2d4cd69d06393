"""Files of readings: `.ti3` and its relatives, tables (CSV) and CxF3, recognised by content."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file, read_text
from ...spectral.formats import cgats, cxf
from ...spectral.formats.cgats_bands import bands, grid_of
from ...spectral.formats.cgats_tables import CgatsTable, read_tables
from ...spectral.formats.registry import names_its_file
from ...spectral.observers import OBSERVERS, observer_name
from .cxf_readings import read_cxf
from .readings import Readings, ReadingSpectra

#: Full scales that codes are written to.
SCALES = (1.0, 100.0, 255.0, 1023.0, 4095.0, 65535.0)
T = TypeVar("T", str, float)
_HEAD = 4096
# Y of white that may be meant relative to it: about 100, or that of no display, in cd/m2.
_NEARLY_100, _DARKEST_WHITE = 1.0, 2.0
# Share by which white may miss 100 where it is called 100, and a stated luminance.
_OFF_WHITE = 0.2
# Distance in x, y, root mean square, at which XYZ are none that any observer sees of the spectra beside them; and the
# share by which their luminance may differ before spectra are on another scale.
_OTHER_SPECTRA, _SAME_LUMINANCE = 0.02, 0.02
# Words at the heads of columns.
_CODES = ("rgb_r", "rgb_g", "rgb_b"), ("r", "g", "b"), ("red", "green", "blue")
_XYZ = ("xyz_x", "xyz_y", "xyz_z"), ("x", "y", "z")
_STRIPPED = re.compile(r"[\s_]*(?:[\[(]|cd\s*/|nits?\b).*", re.I)
_UNIT = re.compile(r"(?<![a-z])(?:cd\s*[/·.*]?\s*m|nits?\b)", re.I)


@dataclass(frozen=True)
class Answers:
    """Answers to questions that files of readings leave open.

    codes : number at full scale. unit : "cd/m2" or "Y100". luminance : cd/m2 of white, for "Y100".
    observer : of the XYZ.
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
    InputError : no such file; none of the formats; several displays in it; an unknown scale; invalid numbers.
    """
    path = existing_file(path)
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if cxf.recognises(path, head):
        found = read_cxf(path)
        scale = _agreed("--codes", answers.codes, found.full_scale)
        stated = None if found.observer is None else _known_observer(found.observer, answers.observer)
        seen_by = _agreed("--observer", answers.observer, stated)
        return _made(path, found.codes, found.xyz, scale or 255.0, answers.unit, replace(answers, observer=seen_by),
                     notes=found.notes)  # fmt: skip
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
    used_as = tables[0].keywords.get("DEVICE_CLASS", "DISPLAY").upper()
    if used_as != "DISPLAY":
        raise InputError(
            "readings of something else than a display",
            field="DEVICE_CLASS",
            found=used_as,
            expected="DISPLAY",
            hint="name the file that was measured on the screen",
        )
    tables = [table for table in tables if code_columns(table.fields)]
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
    codes = numbers[:, code_columns(table.fields)]
    spectra, at = None, _columns(table.fields, _XYZ)
    if fields := bands(table):
        grid, order = grid_of(table, fields)
        norm = float(table.keywords.get("SPECTRAL_NORM", "1"))
        # ArgyllCMS writes mW of emission.
        radiance = numbers[:, [fields[one].column for one in order]] / (1000.0 * norm)
        if not np.isfinite(radiance).all():
            row = int(np.argwhere(~np.isfinite(radiance))[0, 0])
            raise InputError("not a number", field=f"spectrum of reading {row + 1}", expected="a number in every band")
        spectra = ReadingSpectra(grid, radiance)
    seen_by, notes = answers.observer or "1931_2", ()
    if at:
        xyz = numbers[:, at]
        if spectra is not None:
            xyz, spectra, seen_by, notes = _with_spectra(xyz, spectra, answers.observer)
        stated = _stated_unit(table, float(xyz[_white(codes), 1].mean()) if _white(codes).any() else np.nan)
        unit = _agreed("--xyz", answers.unit, stated)
    elif spectra is not None:
        xyz, unit = spectra.xyz(seen_by), "cd/m2"
    else:
        raise InputError(
            "no XYZ and no spectra", field="BEGIN_DATA_FORMAT", expected="XYZ_X, XYZ_Y, XYZ_Z or SPEC_380 ..."
        )
    luminance = answers.luminance or (_luminance(table) if unit == "Y100" else None)
    keywords = table.keywords
    # The format has percent; a file with larger numbers is not of its makers.
    scale = answers.codes or (100.0 if identifier.startswith("CTI3") else None)
    return _made(
        path,
        codes,
        xyz,
        scale,
        unit,
        replace(answers, luminance=luminance, observer=seen_by),
        display=keywords.get("DISPLAY") or _described(keywords.get("DESCRIPTOR", "")),
        instrument=keywords.get("TARGET_INSTRUMENT", keywords.get("INSTRUMENT", "")),
        measured=keywords.get("CREATED", ""),
        spectra=spectra,
        notes=notes,
    )


def _white(codes: np.ndarray) -> np.ndarray:
    """Select the rows whose three codes are all at their maximum."""
    return (codes >= codes.max() * (1.0 - 1e-9)).all(axis=1)


def _stated_unit(table: CgatsTable, white: float) -> str | None:
    """Return the unit of XYZ that a table states; None if it does not.

    Older files of ArgyllCMS lack it: a white of 100 beside a different luminance is relative.
    """
    stated = table.keywords.get("NORMALIZED_TO_Y_100", "").upper()
    if stated in ("YES", "NO"):
        return "Y100" if stated == "YES" else "cd/m2"
    luminance = _luminance(table)
    if luminance is None or abs(white - luminance) <= _OFF_WHITE * luminance:
        return None if luminance is None else "cd/m2"
    return "Y100" if abs(white - 100.0) <= _NEARLY_100 else None


def _with_spectra(
    xyz: np.ndarray, spectra: ReadingSpectra, asked: str | None
) -> tuple[np.ndarray, ReadingSpectra, str, tuple[str, ...]]:
    """Identify the observer of the XYZ by the spectra beside them, and return those of the requested observer.

    Spectra are scaled to the XYZ, which alone may be normalised in a file.
    """
    bright = xyz[:, 1] > 0.05 * xyz[:, 1].max()
    seen = {name: spectra.xyz(name) for name in OBSERVERS}
    off = {name: float(np.sqrt(np.mean((_xy(xyz[bright]) - _xy(made[bright])) ** 2))) for name, made in seen.items()}
    whose = min(off, key=lambda name: off[name])
    if not off[whose] <= _OTHER_SPECTRA:
        raise InputError(
            "XYZ that are not those of the spectra beside them",
            field="XYZ and spectra",
            found=f"x, y apart by {off[whose]:.3f}, root mean square, for the nearest observer ({whose})",
            expected="XYZ and spectra of one reading in each row",
            hint="leave out the columns that are wrong",
        )
    factor = float(xyz[bright, 1].sum() / seen[whose][bright, 1].sum())
    if abs(factor - 1.0) > _SAME_LUMINANCE:
        spectra = replace(spectra, radiance=spectra.radiance * factor)
    name = asked or whose
    if name == whose:
        said = () if whose == "1931_2" else (f"XYZ are of {whose}, by the spectra beside them",)
        return xyz, spectra, whose, said
    return spectra.xyz(name), spectra, name, (f"XYZ of {name} are made of the spectra; the file has those of {whose}",)


def _xy(xyz: np.ndarray) -> np.ndarray:
    return xyz[:, :2] / xyz.sum(axis=1, keepdims=True)


def _agreed(option: str, asked: T | None, stated: T | None) -> T | None:
    """Return the requested or the stated value; both must agree if both exist."""
    if asked is not None and stated is not None and asked != stated:
        raise InputError(
            "the file says it itself, and something else",
            field=option.removeprefix("--"),
            found=f"{stated} in the file, {option} {asked}",
            expected="one answer",
            hint=f"leave {option} out, or correct the file",
        )
    return stated if asked is None else asked


def _known_observer(stated: str, asked: str | None) -> str | None:
    """Return the short name of an observer named by a file; for a custom one, the answer is required."""
    try:
        return observer_name(stated)
    except UnknownNameError:
        if asked is not None:
            return None
        raise InputError(
            "XYZ of an observer that is not known",
            field="Observer",
            found=stated,
            expected="2_Degree or 10_Degree",
            hint="--observer NAME says whose they are",
        ) from None


def _described(words: str) -> str:
    """Return the display's name in a descriptor; ArgyllCMS describes its file there, whatever was measured."""
    return "" if words.casefold().startswith("argyll") else words


def _luminance(table: CgatsTable) -> float | None:
    words = table.keywords.get("LUMINANCE_XYZ_CDM2", "").split()
    return table.number(words[1]) if len(words) == 3 else None


def code_columns(fields: list[str]) -> list[int]:
    """Find the columns of red, green and blue codes by the names of all columns; none if one is missing.

    Raises
    ------
    InputError : a name heads several columns.
    """
    return _columns(fields, _CODES)


def _columns(fields: list[str], known: tuple[tuple[str, ...], ...]) -> list[int]:
    """Return the columns of the first complete triple of names; None without one.

    Raises
    ------
    InputError : a name heads several columns, and not exactly one of them beside the other two.
    """
    named = [_STRIPPED.sub("", field).strip() for field in fields]
    lower = [name.casefold() for name in named]
    for triple in known:
        if not all(name in lower for name in triple):
            continue
        if all(lower.count(name) == 1 for name in triple):
            return [lower.index(name) for name in triple]
        # Chromaticities x, y or x, y, z and luminance Y may stand beside X, Y, Z.
        ours = [at for at in range(len(lower) - 2) if tuple(lower[at : at + 3]) == triple]
        if len(ours) > 1 and triple == _XYZ[1]:
            ours = [at for at in ours if named[at : at + 3] == ["X", "Y", "Z"]]
        if len(ours) == 1:
            return [ours[0], ours[0] + 1, ours[0] + 2]
        several = [field for field, name in zip(fields, lower, strict=True) if name in triple]
        raise InputError(
            "several columns of one name",
            field="heads of columns",
            found=", ".join(several)[:120],
            expected=f"{', '.join(name.upper() for name in triple)}, once each",
            hint="leave out the columns that are not what was measured",
        )
    return []


def _of_csv(path: Path, text: str, answers: Answers) -> Readings:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    mark = next((mark for mark in (";", "\t", ",") if mark in lines[0]), ",")
    heads = [cell.strip().strip('"') for cell in lines[0].split(mark)]
    codes_at, xyz_at = code_columns(heads), _columns(heads, _XYZ)
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
    unit = _agreed("--xyz", answers.unit, _headed_unit([heads[at] for at in xyz_at], answers.unit))
    display = rows[0][lower.index("display")] if "display" in lower else ""
    return _made(path, codes, xyz, answers.codes, unit, answers, display=display)


def _headed_unit(heads: list[str], asked: str | None) -> str | None:
    """Return the unit in the headings of X, Y, Z; None if they state none, or another one of relative XYZ."""
    named = [head for head in heads if _STRIPPED.search(head)]
    if named and all(_UNIT.search(head) for head in named):
        return "cd/m2"
    if named and asked != "Y100":
        raise InputError(
            "XYZ in a unit that is not known",
            field="line 1",
            found=", ".join(heads)[:120],
            expected="X [cd/m2], Y [cd/m2], Z [cd/m2], or no unit",
            hint="convert them (1 fL is 3.4263 cd/m2), or say that they are relative to white = 100: --xyz Y100",
        )
    return None


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
    notes: tuple[str, ...] = (),
) -> Readings:
    """Convert readings to the scale 0 to 1 and to cd/m2, as far as that is known."""
    scale = scale or _scale(codes)
    if np.isfinite(codes).all() and codes.max() > scale * (1.0 + 1e-9):
        raise InputError(
            "codes beyond their scale",
            field="codes",
            found=f"{codes.max():g}, where {scale:g} is full scale",
            expected=f"0 to {scale:g}",
            hint="say which number is full scale: --codes 1, 100, 255 or 1023",
        )
    told = [f"codes are parts of {scale:g}", *notes]
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
    if unit == "Y100" and abs(luminous - 100.0) > 100.0 * _OFF_WHITE:
        raise InputError(
            "XYZ are not relative to white = 100",
            field="XYZ",
            found=f"white with Y = {luminous:.4g}",
            expected="about 100",
            hint="leave --xyz Y100 out where they are cd/m2; multiply by 100 where white is 1",
        )
    if unit != "Y100" and answers.luminance is not None:
        raise InputError(
            "a luminance of white beside XYZ that have one",
            field="white-luminance",
            found=f"--white-luminance {answers.luminance:g}, and XYZ in cd/m2 with a white of {luminous:.4g}",
            expected="XYZ relative to white = 100",
            hint="leave --white-luminance out, or say --xyz Y100",
        )
    absolute = unit != "Y100" or answers.luminance is not None
    if unit == "Y100" and answers.luminance is not None:
        factor = answers.luminance / 100.0
        xyz, spectra = xyz * factor, spectra and replace(spectra, radiance=spectra.radiance * factor)
        told.append(f"XYZ relative to white = 100, times {answers.luminance:g} cd/m2")
    elif unit == "Y100":
        told.append("XYZ are relative to white = 100: no luminance is known")
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
        notes=tuple(told),
    )


def _scale(codes: np.ndarray) -> float:
    """Return the full scale implied by a largest code; other codes require an answer."""
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
