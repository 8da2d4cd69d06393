"""Reads measured BRDFs in the layout of the MERL data base (Matusik, Pfister, Brand and McMillan 2003).

    three int32        90, 90, 180: theta_h, theta_d, phi_d
    three planes       red, green, blue, each float64 [theta_h][theta_d][phi_d], little-endian

Node k of theta_h lies at (k / 90)^2 90 degrees, of theta_d and phi_d at k degrees; phi_d covers half a turn, and
reciprocity the rest. A stored value times 1/1500, 1.15/1500 or 1.66/1500 is f_r in 1/sr. What is not positive is no
measurement: -1 where no pair of directions has these angles, and -1 or 0 where a reading dropped out.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...spectral.errors import InputError

SHAPE = (90, 90, 180)
SCALES = np.array([1.0, 1.15, 1.66]) / 1500.0
_HEADER = 12
_LAYOUT = "three int32 (90, 90, 180), then 3 x 90 x 90 x 180 float64"


@dataclass(frozen=True, eq=False)
class MerlMeasurement:
    """f_r of the three channels, 1/sr, [theta_h][theta_d][phi_d][channel]; 0 or less: no reading."""

    name: str
    values: Float[np.ndarray, "90 90 180 3"]


def is_merl(path: str | Path) -> bool:
    """True where the file begins as this layout does, whatever its name."""
    try:
        with Path(path).open("rb") as file:
            return file.read(_HEADER) == np.array(SHAPE, "<i4").tobytes()
    except OSError:
        return False


def read_merl(path: str | Path) -> MerlMeasurement:
    """One file; see the text of this module for the layout.

    Raises
    ------
    InputError
        The file is missing, is something else, has other dimensions, ends early or goes on; a value is NaN or
        infinite; nothing in it is positive.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        found = error.strerror or str(error)
        raise InputError("cannot be read", file=path, found=found, expected="a readable binary file") from None
    if len(raw) < _HEADER:
        raise InputError("not a MERL file", file=path, found=f"{len(raw)} bytes", expected=_LAYOUT)
    dimensions = tuple(int(size) for size in np.frombuffer(raw, "<i4", 3))
    if dimensions != SHAPE:
        plausible = all(0 < size <= 3600 for size in dimensions)
        raise InputError(
            "a MERL file of other dimensions" if plausible else "not a MERL file",
            file=path,
            field="dimensions",
            found=dimensions if plausible else f"{raw[:_HEADER]!r} ...",
            expected=_LAYOUT,
        )
    whole = _HEADER + 3 * int(np.prod(SHAPE)) * 8
    if len(raw) != whole:
        problem = "the file ends early" if len(raw) < whole else "the file goes on after the last value"
        hint = "download or copy it again" if len(raw) < whole else None
        raise InputError(problem, file=path, found=f"{len(raw)} bytes", expected=f"{whole} bytes", hint=hint)
    planes = np.frombuffer(raw, "<f8", offset=_HEADER).reshape(3, *SHAPE)
    if not np.isfinite(planes).all():
        at = tuple(int(index) for index in np.argwhere(~np.isfinite(planes))[0])
        field = f"{('red', 'green', 'blue')[at[0]]}{list(at[1:])}"
        raise InputError("not a finite number", file=path, field=field, found=planes[at], expected="f_r, or -1")
    if not (planes > 0).any():
        raise InputError(
            "no value is positive: nothing was measured", file=path, found="0 and less", expected="f_r > 0"
        )
    return MerlMeasurement(path.stem, np.ascontiguousarray(np.moveaxis(planes, 0, -1) * SCALES))
