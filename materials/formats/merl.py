"""Reads measured BRDFs in the layout of the MERL data base (Matusik, Pfister, Brand and McMillan 2003).

    three int32        90, 90, 180: theta_h, theta_d, phi_d
    three planes       red, green, blue, each float64 [theta_h][theta_d][phi_d], little-endian

Node k of theta_h lies at (k / 90)^2 90 degrees, of theta_d and phi_d at k degrees; phi_d covers half a turn, and
reciprocity the rest. A stored value times 1/1500, 1.15/1500 or 1.66/1500 is f_r in 1/sr. What is not positive is no
measurement: -1 where no pair of directions has these angles, and -1 or 0 where a reading dropped out.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import read_bytes
from ...spectral.upsampling import upsampling
from ..measured.merl import SHAPE, MerlBrdf, MerlMeasurement
from ..records.source import MaterialSource, Rejected
from .measured_source import measured_source, placed
from .naming import printable
from .reading_cost import ReadingCost, cost_of_bytes

NAME = "MERL table"
SUFFIXES = (".binary",)
SCALES = np.array([1.0, 1.15, 1.66]) / 1500.0
_HEADER = 12
_LAYOUT = "three int32 (90, 90, 180), then 3 x 90 x 90 x 180 float64"
_AGAIN = "the file is damaged: download or copy it again"


def recognises(path: Path, head: bytes) -> bool:
    """True where the file begins as this layout does, whatever its name, or has the name of one."""
    return head[:_HEADER] == np.array(SHAPE, "<i4").tobytes() or path.suffix.lower() in SUFFIXES


def reading_cost(path: Path) -> ReadingCost:
    """Return the file, its values in order, and what stands between and beyond them."""
    return cost_of_bytes(path, 11.0, 0.06e-6)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Yield the file's one material, its spectra made up by `uplift`; raises `InputError` as `read_merl` does."""
    with placed(path, hint=_AGAIN):
        brdf = MerlBrdf.from_measurement(read_merl(path), uplift)
    yield measured_source(
        path,
        brdf,
        source=f"{path.name}, a table in the layout of the MERL data base",
        kind=upsampling(uplift).provenance,
        geometry="90 x 90 x 180 nodes of theta_h, theta_d and phi_d, in red, green and blue",
        original={
            "file": printable(path.name),
            "units": "1/sr; stored in the file divided by `scale`",
            "scale": SCALES,
        },
    )


def read_merl(path: str | Path) -> MerlMeasurement:
    """One file; see the text of this module for the layout.

    Raises
    ------
    InputError
        The file is missing, is something else, has other dimensions, ends early or goes on; a value is NaN or
        infinite; nothing in it is positive.
    """
    path = Path(path)
    raw = read_bytes(path, "a readable binary file")
    if len(raw) < _HEADER:
        raise InputError(
            "not a MERL file", file=path, field="header", found=f"{len(raw)} bytes", expected=_LAYOUT, hint=_AGAIN
        )
    dimensions = tuple(int(size) for size in np.frombuffer(raw, "<i4", 3))
    if dimensions != SHAPE:
        plausible = all(0 < size <= 3600 for size in dimensions)
        raise InputError(
            "a MERL file of other dimensions" if plausible else "not a MERL file",
            file=path,
            field="dimensions",
            found=dimensions if plausible else f"{raw[:_HEADER]!r} ...",
            expected=_LAYOUT,
            hint="export it on the grid of the data base" if plausible else "give it the name of its own format",
        )
    whole = _HEADER + 3 * int(np.prod(SHAPE)) * 8
    if len(raw) != whole:
        problem = "the file ends early" if len(raw) < whole else "the file goes on after the last value"
        found, expected = f"{len(raw)} bytes", f"{whole} bytes"
        raise InputError(problem, file=path, field="planes", found=found, expected=expected, hint=_AGAIN)
    planes = np.frombuffer(raw, "<f8", offset=_HEADER).reshape(3, *SHAPE)
    if not np.isfinite(planes).all():
        at = tuple(int(index) for index in np.argwhere(~np.isfinite(planes))[0])
        field = f"{('red', 'green', 'blue')[at[0]]}{list(at[1:])}"
        raise InputError(
            "not a finite number", file=path, field=field, found=planes[at], expected="f_r, or -1", hint=_AGAIN
        )
    if not (planes > 0).any():
        raise InputError(
            "no value is positive: nothing was measured",
            file=path,
            field="planes",
            found="0 and less",
            expected="f_r > 0",
            hint=_AGAIN,
        )
    return MerlMeasurement(path.stem, np.ascontiguousarray(np.moveaxis(planes, 0, -1) * SCALES))
