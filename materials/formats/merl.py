"""Reader and writer of measured BRDFs in the layout of the MERL data base (Matusik, Pfister, Brand and McMillan 2003).

    three int32        90, 90, 180: theta_h, theta_d, phi_d
    three planes       red, green, blue, each float64 [theta_h][theta_d][phi_d], little-endian

Node k of theta_h lies at (k / 90)^2 90 degrees, of theta_d and phi_d at k degrees; phi_d covers half a turn, and
reciprocity the rest. A stored value times 1/1500, 1.15/1500 or 1.66/1500 is f_r in 1/sr. Values that are not positive
are not measurements: -1 where no pair of directions has these angles, and -1 or 0 for a dropped reading.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import read_bytes, written_whole
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import PRIMARIES, upsampling, xyz_from_rgb
from ..core.brdf import Brdf
from ..core.directions import io_from_half_difference
from ..measured.merl import SHAPE, MerlBrdf, MerlMeasurement, node_angles
from ..measured.rgl import RglBrdf
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
# Black in 1/sr: a number that is not positive is no reading in this layout.
DARKEST = 1e-9
# Distance from the horizon up to which a node counts as one that a pair of directions has.
_HORIZON = 1e-9


def recognises(path: Path, head: bytes) -> bool:
    """Return True if the file begins in this layout, whatever its name, or has the name of one."""
    return head[:_HEADER] == np.array(SHAPE, "<i4").tobytes() or path.suffix.lower() in SUFFIXES


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of the file, its values in order, and the values interpolated between and beyond them."""
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
    """Read one file; see the text of this module for the layout.

    Raises
    ------
    InputError
        The file is missing, is something else, has other dimensions, ends early or goes on; a value is NaN or infinite;
        nothing in it is positive.
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


def merl_table(brdf: Brdf) -> tuple[Float[np.ndarray, "90 90 180 3"], tuple[str, ...]]:
    """Tabulate f_r of red, green and blue at every node, 1/sr; return it with notes.

    Values are negative (-1 in the file) where no pair of directions has the node's angles.

    Spectra become RGB through XYZ (CIE 1931, 2 degrees) under D65. A MERL table round-trips exactly, an RGL file in RGB
    is not converted to spectra.

    Raises
    ------
    InputError
        Anisotropic or fluorescent, which the layout cannot represent.
    """
    if brdf.bispectral or not brdf.isotropic:
        kind = "anisotropic" if not brdf.isotropic else "fluorescent"
        raise InputError(
            f"a MERL table cannot hold an {kind} surface"
            if kind[0] == "a"
            else f"a MERL table cannot hold a {kind} one",
            field="brdf",
            found=type(brdf).__name__,
            expected="an isotropic reflectance",
            hint="export its spectrum: --format exr, cxf or csv",
        )
    if isinstance(brdf, MerlBrdf):
        return np.array(brdf.values), ("the table as it was read",)
    wi, wo = io_from_half_difference(*np.meshgrid(*node_angles(), indexing="ij"))
    met = (wi[..., 2] > _HORIZON) & (wo[..., 2] > _HORIZON)
    rgb, how = _rgb(brdf, wi[met], wo[met])
    low = rgb < DARKEST
    notes = [how]
    if low.any():
        notes.append(
            f"{int(low.sum())} of {rgb.size} values are below {DARKEST:g} (black, or a colour outside sRGB; the lowest "
            f"{rgb.min():.3g}) and written as that, since the layout takes what is not positive for no reading"
        )
    values = np.full((*SHAPE, 3), -SCALES)
    values[met] = np.maximum(rgb, DARKEST)
    return values, tuple(notes)


def _rgb(brdf: Brdf, wi: np.ndarray, wo: np.ndarray) -> tuple[Float[np.ndarray, "N 3"], str]:
    if isinstance(brdf, RglBrdf) and not brdf.spectral:
        return np.asarray(brdf.eval_measured(wi, wo)), "red, green and blue as the RGL file has them"
    weights = observer("1931_2").weights(illuminant("D65"), brdf.wavelengths_nm)
    fold = np.linalg.solve(xyz_from_rgb(), weights).T
    out = np.empty((len(wi), 3))
    for start in range(0, len(wi), 8192):
        rows = slice(start, start + 8192)
        out[rows] = brdf.eval(wi[rows], wo[rows]) @ fold
    return out, f"RGB is {PRIMARIES}, from spectra through CIE 1931 XYZ under D65"


def write_merl(path: str | Path, values: Float[np.ndarray, "H D P 3"]) -> None:
    """Write a table as `merl_table` and `MerlMeasurement` have it: f_r in 1/sr, 0 or less for no reading.

    The stored number is the one whose product with the channel's scale is nearest to f_r: values of `read_merl`
    round-trip bit for bit, others to the last bit of float64.
    """
    if values.shape != (*SHAPE, 3) or not np.isfinite(values).all():
        raise InputError("not a MERL table", file=path, field="values", found=values.shape, expected=str((*SHAPE, 3)))
    with written_whole(path) as beside, beside.open("wb") as file:
        file.write(np.array(SHAPE, "<i4").tobytes())
        for channel, scale in enumerate(SCALES):
            file.write(_stored(values[..., channel], scale).astype("<f8").tobytes())


def _stored(values: np.ndarray, scale: float) -> np.ndarray:
    best = values / scale
    for other in (np.nextafter(best, -np.inf), np.nextafter(best, np.inf)):
        nearer = np.abs(other * scale - values) < np.abs(best * scale - values)
        best = np.where(nearer, other, best)
    return best
