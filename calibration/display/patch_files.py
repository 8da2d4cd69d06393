"""Files of patches: `.ti1` for ArgyllCMS, CSV for other programs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UsageError
from ...runtime.files import existing_file, read_text, written_whole
from ...spectral.formats import cgats
from ...spectral.formats.cgats_tables import read_tables
from ...spectral.formats.registry import names_its_file
from ...spectral.srgb import srgb_to_linear
from .reading_files import code_columns

_SUFFIXES = (".ti1", ".csv")
_FULL_SCALE = "# codes from 0 to "
_COLUMNS = "patch,r,g,b"


def write_patches(path: str | Path, codes: Float[np.ndarray, "N 3"], bits: int = 8) -> None:
    """Write codes from 0 to 1, rounded to `bits`: percent (.ti1) or integer codes (.csv), by the suffix.

    Raises
    ------
    UsageError : another suffix. InputError, NoRoomError : the folder is missing, or its disk full.
    """
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise UsageError(f"{path}: patches are written as {' or '.join(_SUFFIXES)}")
    steps = 2**bits - 1
    sent = np.round(codes * steps).astype(int)
    text = _ti1(sent / steps) if path.suffix.lower() == ".ti1" else _csv(sent, steps)
    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")


@names_its_file
def read_patches(path: str | Path) -> Float[np.ndarray, "N 3"]:
    """Read the codes, from 0 to 1, of a `.ti1`, or of a CSV as `write_patches` writes it.

    Raises
    ------
    InputError : no such file; other contents; codes beyond the scale.
    """
    path = existing_file(path)
    with path.open("rb") as file:
        of_argyll = cgats.recognises(path, file.read(4096))
    full, codes = _percent(path) if of_argyll else _whole(read_text(path))
    if not len(codes) or not (np.isfinite(codes).all() and codes.min() >= 0.0 and codes.max() <= full):
        found = f"{codes.min():g} to {codes.max():g}" if len(codes) else "none"
        raise InputError("no codes of a display", field="codes", found=found, expected=f"numbers from 0 to {full:g}",
                         hint="`metamer display patches` writes them")  # fmt: skip
    return codes / full


def _percent(path: Path) -> tuple[float, np.ndarray]:
    for table in read_tables(path):
        at = code_columns(table.fields)
        if at and table.identifier.upper().startswith("CTI1"):
            return 100.0, np.array([[table.number(row[column]) for column in at] for row in table.rows]).reshape(-1, 3)
    raise _no_patches("no table of RGB_R, RGB_G, RGB_B in a CTI1 file")


def _whole(text: str) -> tuple[float, np.ndarray]:
    scale = re.match(_FULL_SCALE + r"(\d+)", text)
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    if scale is None or not lines or not lines[0].startswith(_COLUMNS):
        raise _no_patches(text.partition("\n")[0][:120])
    try:
        # Further columns may hold what was measured.
        codes = [[float(cell) for cell in line.split(",")[1:4]] for line in lines[1:]]
    except ValueError as reason:
        raise _no_patches(str(reason)) from None
    if short := [at for at, row in enumerate(codes, 1) if len(row) < 3]:
        raise _no_patches(f"fewer than three codes in row {short[0]}")
    return float(scale[1]), np.array(codes).reshape(-1, 3)


def _no_patches(found: str) -> InputError:
    return InputError(
        "not a file of patches", found=found, expected="a .ti1, or the .csv that `metamer display patches` writes"
    )


def _csv(sent: np.ndarray, steps: int) -> str:
    head = f"{_FULL_SCALE}{steps}; measure X, Y, Z in cd/m2 and add them as further columns\n{_COLUMNS}\n"
    return head + "".join(f"{at},{r},{g},{b}\n" for at, (r, g, b) in enumerate(sent, 1))


def _ti1(codes: np.ndarray) -> str:
    """Format percent of full scale, with the approximate XYZ by sRGB that the format requires (ArgyllCMS, .ti1)."""
    xyz = (
        100.0
        * srgb_to_linear(codes)
        @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    )
    rows = "".join(
        f"{at} {' '.join(f'{100.0 * code:.4f}' for code in rgb)} {' '.join(f'{value:.4f}' for value in seen)}\n"
        for at, (rgb, seen) in enumerate(zip(codes, xyz, strict=True), 1)
    )
    return (
        'CTI1\n\nDESCRIPTOR "Patches of a display"\nORIGINATOR "Metamer"\nCOLOR_REP "RGB"\n'
        f"NUMBER_OF_FIELDS 7\nBEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n\n"
        f"NUMBER_OF_SETS {len(codes)}\nBEGIN_DATA\n{rows}END_DATA\n"
    )
