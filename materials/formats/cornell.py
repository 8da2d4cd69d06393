"""Reader of scattered spectral BRDF measurements in the text layout of Cornell's gonioreflectometer.

Words separated by any white space, or by commas, `#` starting a comment that runs to the end of its line:

    L                                   number of wavelengths
    w_1 ... w_L                         wavelengths, nm, ascending; descending ones are reversed with their values
    theta_i phi_i theta_o phi_o  f_1 ... f_L     one direction pair: radians, then f_r in 1/sr

repeated for as many pairs as were measured, in any order. An f_r of exactly 0 is a reading that was clamped: the signal
was lost in the noise of the detector, so it counts as missing and not as black.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import InputError
from ...runtime.files import read_bytes
from ...spectral.formats.shared.text import is_number
from ...spectral.wavelengths import validated_wavelengths
from ..core.directions import spherical
from ..measured.measurement import ScatteredMeasurement
from ..records.source import MaterialSource, Rejected
from .measured_source import measured_source, placed
from .naming import printable
from .reading_cost import ReadingCost, cost_of_bytes

NAME = "Cornell scattered BRDF"
SUFFIXES = (".brdf",)
_LAYOUT = "a count, that many wavelengths in nm, then rows: theta_i phi_i theta_o phi_o and one f_r a wavelength"
# Comments that only label the numbers below them.
_LABEL = re.compile(r"(num(ber)?\b.*)?\b(wls?|wavelengths?|theta|phi)\b", re.IGNORECASE)
# Angles are printed with six digits or so: pi/2 may come out a hair larger.
_ROUNDING = 1e-4
# As Fortran prints numbers of double precision: 8.726650D-01.
_DOUBLE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))[dD]([+-]?\d+)")


def recognises(path: Path, head: bytes) -> bool:
    """Return True for text that begins with a count and that many ordered wavelengths, or a file with such a name."""
    return path.suffix.lower() in SUFFIXES or _begins_with_wavelengths(head)


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of its numbers as text, and of the interpolation between scattered pairs."""
    return cost_of_bytes(path, 13.0, 4e-6)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Yield the file's one material; it is spectral, and needs no `uplift`. Raises `InputError` as `read_cornell`
    does."""
    from ..measured.scattered import ScatteredBrdf

    measurement = read_cornell(path)
    with placed(path, "rows", "leave out what cannot be used, or measure it again"):
        brdf = ScatteredBrdf.from_measurement(measurement)
    yield measured_source(
        path,
        brdf,
        source=". ".join(text for text in (measurement.name or path.name, measurement.description) if text),
        kind="measured",
        geometry=f"{len(measurement)} scattered direction pairs",
        original={
            "file": printable(path.name),
            "units": "1/sr; angles in radians",
            "comments": printable(measurement.description),
        },
    )


def read_cornell(path: str | Path) -> ScatteredMeasurement:
    """Read one file of scattered direction pairs; see the text of this module for the layout.

    Returns
    -------
    ScatteredMeasurement
        At the file's own wavelengths, with clamped readings marked in `missing` and what was found said in `notes`.

    Raises
    ------
    InputError
        The file is missing or something else; a row is short; a number is NaN, infinite or negative; wavelengths are
        not ascending nanometres; angles are beyond pi/2 or in degrees; no direction pair is there at all.
    """
    path = Path(path)
    words, lines, comments = _words(path)
    numbers = _numbers(path, words, lines)
    count = _count(path, numbers)
    field = "wavelengths"
    if len(numbers) < 1 + count:
        found, hint = f"{len(numbers) - 1} of {count}", "the file may be truncated: download or copy it again"
        _fail("the list of wavelengths ends early", path, field, found, f"{count} values", hint)
    listed = numbers[1 : 1 + count]
    turned = bool((np.diff(listed) < 0).all())
    wavelengths_nm = validated_wavelengths(listed[::-1] if turned else listed, file=path, field=field)
    rows = _rows(path, numbers[1 + count :], lines[1 + count :], count)
    row_lines = lines[1 + count :: 4 + count]
    angles, values = rows[:, :4], rows[:, :3:-1] if turned else rows[:, 4:]
    _check_values(path, values, wavelengths_nm, row_lines)
    _check_angles(path, angles, row_lines)
    missing = values == 0
    name, description = _names(path, comments)
    theta = np.minimum(angles[:, [0, 2]], np.nextafter(np.pi / 2, 0))
    return ScatteredMeasurement(
        wavelengths_nm=wavelengths_nm,
        wi=spherical(theta[:, 0], angles[:, 1]),
        wo=spherical(theta[:, 1], angles[:, 3]),
        values=values,
        missing=missing,
        name=name,
        description=description,
        notes=(*(["wavelengths descend in the file and are turned round"] if turned else []), *_notes(missing, angles)),
    )


def _begins_with_wavelengths(head: bytes) -> bool:
    """Check for a count alone on its line, unlike tables of spectra, and its wavelengths; `head` may cut these off."""
    if b"\0" in head:
        return False
    text = head.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    # Most texts are ruled out by their first line: the others are not split.
    found = (_split(line.partition("#")[0]) for line in text.splitlines())
    first = next((line for line in found if line), [])
    if len(first) != 1 or not re.fullmatch(r"\d{1,5}", first[0], re.ASCII):
        return False
    lines = [first, *(line for line in found if line)]
    if len(lines) < 2:
        return False
    count, words = int(lines[0][0]), [word for line in lines[1:] for word in line]
    if len(words) < count:
        # The last word may be half a number.
        del words[-1:]
    try:
        listed = np.array([float(word) for word in words[:count]])
    except ValueError:
        return False
    whole = len(listed) == count or (len(listed) > 0 and len(head) >= 4096)
    steps = np.diff(listed)
    in_order = bool((steps > 0).all() or (steps < 0).all())
    return count > 1 and whole and in_order and bool(listed.min() > 100 and listed.max() < 1e5)


def _split(line: str) -> list[str]:
    """Split a line at white space or commas; a single comma within a word may be a decimal one."""
    found: list[str] = []
    for word in line.split():
        inner = word.removesuffix(",")
        parts = inner.split(",")
        found += parts if len(parts) > 2 or "." in inner else [inner] if inner else []
    return [_DOUBLE.sub(r"\1e\2", word) if _DOUBLE.fullmatch(word) else word for word in found]


def _fail(
    problem: str, path: Path, field: str | None, found: object, expected: str, hint: str | None = None
) -> NoReturn:
    raise InputError(problem, file=path, field=field, found=found, expected=expected, hint=hint)


def _words(path: Path) -> tuple[list[str], np.ndarray, list[str]]:
    """Return words outside comments, the line number of each, and the comments before the first word."""
    raw = read_bytes(path, "a readable text file")
    if b"\0" in raw:
        hint = "import the measurement that it was made from, or give it the name of its own format (.binary, .bsdf)"
        _fail("not a text file", path, "header", f"binary data, {raw[:8]!r} ...", _LAYOUT, hint)
    # The numbers are ASCII; a comment may be in any encoding that contains it.
    text = raw.decode("utf-8-sig", errors="replace")
    words: list[str] = []
    lines: list[int] = []
    comments: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        body, _, comment = line.partition("#")
        here = _split(body)
        words += here
        lines += [number] * len(here)
        if not words and comment.strip():
            comments.append(comment.strip())
    if not words:
        found = "an empty file" if not raw.strip() else "comments only"
        _fail("holds no numbers", path, "count", found, _LAYOUT, "download or copy the file again")
    return words, np.array(lines), comments


def _numbers(path: Path, words: list[str], lines: np.ndarray) -> Float[np.ndarray, " n"]:
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError:
        at = next(index for index, word in enumerate(words) if not is_number(word))
        found = repr(words[at][:40])
        if at == 0:
            hint = "a .brdf of another laboratory or program: export it in this layout, or as MERL or RGL"
            _fail("not a file of scattered BRDF measurements", path, f"line {lines[0]}", found, _LAYOUT, hint)
        hint = "correct the line, or leave it out; text goes behind a #"
        _fail("not a number", path, f"line {lines[at]}", found, "numbers, and comments after #", hint)
    if not np.isfinite(numbers).all():
        at = int(np.argmin(np.isfinite(numbers)))
        _fail("not a finite number", path, f"line {lines[at]}", words[at], "finite numbers", "leave the row out")
    return numbers


def _count(path: Path, numbers: np.ndarray) -> int:
    count = numbers[0]
    if count < 2 or count != int(count) or count > 10000:
        hint = "one wavelength is no spectrum" if count == 1 else "put the number of wavelengths first"
        _fail("does not begin with a number of wavelengths", path, "count", f"{count:g}", "an integer, 2 or more", hint)
    return int(count)


def _rows(path: Path, numbers: np.ndarray, lines: np.ndarray, count: int) -> Float[np.ndarray, "N W"]:
    width = 4 + count
    expected = f"{width} numbers a row: 4 angles and {count} values"
    if len(numbers) == 0:
        hint = "the file may be truncated: download or copy it again"
        _fail("holds no direction pairs", path, "rows", "the file ends after the wavelengths", expected, hint)
    per_line = np.unique(lines, return_counts=True)
    # If lines are rows, a row of another length shifts all that follow: name the line, not the end.
    if np.mean(per_line[1] == width) > 0.5 and not (per_line[1] == width).all():
        at = int(np.argmax(per_line[1] != width))
        field = f"line {per_line[0][at]}"
        _fail("a row is not complete", path, field, f"{per_line[1][at]} numbers", expected, "the file may be truncated")
    if len(numbers) % width:
        found = f"{len(numbers) // width} rows and {len(numbers) % width} numbers more"
        _fail("the last row is not complete", path, f"line {lines[-1]}", found, expected, "the file may be truncated")
    return numbers.reshape(-1, width)


def _check_values(path: Path, values: np.ndarray, wavelengths_nm: np.ndarray, row_lines: np.ndarray) -> None:
    if (values < 0).any():
        row, column = np.argwhere(values < 0)[0]
        found = f"{values[row, column]:g} at {wavelengths_nm[column]:g} nm ({(values < 0).sum()} such values)"
        hint = "set readings below the detector's noise to 0: they are taken as missing"
        _fail("negative f_r", path, f"line {row_lines[row]}", found, "f_r >= 0, 1/sr", hint)
    if not (values > 0).any():
        hint = "measure it again with more light, or export it without clamping"
        _fail("every value is 0: nothing was measured", path, "rows", f"{len(values)} rows of 0", "f_r > 0, 1/sr", hint)


def _check_angles(path: Path, angles: np.ndarray, row_lines: np.ndarray) -> None:
    theta, phi = angles[:, [0, 2]], angles[:, [1, 3]]
    degrees = "radians"
    if np.abs(phi).max() > 2 * np.pi + _ROUNDING or theta.max() > np.pi + _ROUNDING:
        largest = max(np.abs(phi).max(), theta.max())
        row = int(np.argmax(np.abs(angles).max(axis=1)))
        hint = "they look like degrees: multiply by pi/180"
        _fail("angles are not in radians", path, f"line {row_lines[row]}", f"{largest:g}", degrees, hint)
    if theta.max() > np.pi / 2 + _ROUNDING or theta.min() < 0:
        bad = (theta > np.pi / 2 + _ROUNDING) | (theta < 0)
        row = int(np.argmax(bad.any(axis=1)))
        hint = "leave out directions below the surface"
        found = f"{theta[bad][0]:g}"
        _fail("a polar angle is out of range", path, f"line {row_lines[row]}", found, "theta in [0, pi/2] rad", hint)


def _names(path: Path, comments: list[str]) -> tuple[str, str]:
    sentences = [comment for comment in comments if not _LABEL.match(comment)]
    # The first comment names the laboratory, the second the sample.
    name = sentences[1] if len(sentences) > 1 else sentences[0] if sentences else path.stem
    return name, "; ".join(sentences)


def _notes(missing: Bool[np.ndarray, "N L"], angles: np.ndarray) -> tuple[str, ...]:
    notes = []
    if missing.any():
        touched, whole = int(missing.any(axis=1).sum()), int(missing.all(axis=1).sum())
        notes.append(
            f"{int(missing.sum())} of {missing.size} values are 0 in the file and taken as missing "
            f"(in {touched} of {len(missing)} direction pairs; {whole} pairs hold nothing else)"
        )
    if np.ptp(np.mod(angles[:, 1] + 1e-9, 2 * np.pi)) > 1e-3:
        notes.append("phi_i varies; only phi_o - phi_i is used: the sample is taken as isotropic")
    return tuple(notes)
