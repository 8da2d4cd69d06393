"""Writes a BRDF as a MERL table: evaluated at every node, in red, green and blue."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import PRIMARIES, xyz_from_rgb
from ..core.brdf import Brdf
from ..core.directions import io_from_half_difference
from ..measured.merl import SHAPE, MerlBrdf, node_angles
from ..measured.rgl import RglBrdf
from .merl import SCALES

# What is not positive is no reading in this layout, so black is written as this, 1/sr.
DARKEST = 1e-9
# As close to the horizon as a node counts as one that a pair of directions has.
_HORIZON = 1e-9


def merl_table(brdf: Brdf) -> tuple[Float[np.ndarray, "90 90 180 3"], tuple[str, ...]]:
    """f_r of red, green and blue at every node, 1/sr, and notes; negative (-1 in the file) where no pair of directions
    has the node's angles.

    Spectra become RGB through XYZ (CIE 1931, 2 degrees) under D65. A MERL table comes back as it was read, an RGL file
    in RGB is not taken through spectra.

    Raises
    ------
    InputError
        Anisotropic or fluorescent: the layout has room for neither.
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

    The number that is stored for f_r is the one whose product with the channel's scale is nearest to it: what
    `read_merl` gave comes back bit for bit, anything else to the last bit of float64.
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
