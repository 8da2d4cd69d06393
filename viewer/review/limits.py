"""Parts of an image that its display cannot show: out of gamut, darker than black, brighter than white."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, UInt8

from ...calibration.report.row import Limits
from ...calibration.report.statistics import FULL_COVERAGE
from ...runtime.errors import InputError
from ...spectral.difference import delta_e_lab, lab_from_xyz
from ...spectral.image import ColourImage
from ..display.transform import DISPLAY_WHITE_XYZ, DisplayTransform

#: Codes of the mask.
BELOW_GAMUT, ABOVE_WHITE, BELOW_BLACK = 1, 2, 4


def limits_of(
    image: ColourImage, share: Float[np.ndarray, "H W"], display: DisplayTransform
) -> tuple[Limits, UInt8[np.ndarray, "H W"]] | None:
    """Compute the shares of a surface that the display cannot show, and their mask; None if the view limits values
    itself.

    image : XYZ. share : coverage of each pixel by the surface; only fully covered pixels are judged. The mask has
    `BELOW_GAMUT` for a channel below its range, `ABOVE_WHITE` for one above, `BELOW_BLACK` in addition for colours
    darker than black, and their sums.
    """
    if not display.shows_limits:
        return None
    surface = (np.asarray(share) >= FULL_COVERAGE) & np.isfinite(image.values).all(axis=-1)
    mask = np.zeros(surface.shape, dtype=np.uint8)
    if not surface.any():
        return Limits(0.0, 0.0, None), mask
    xyz = np.asarray(image.values, dtype=np.float64)[surface]
    if image.space == "xyz":
        xyz = xyz @ display.adaptation_from(image.white_xyz).T
    rgb = display.apply(xyz)
    below, above = display.out_of_range(xyz, rgb)
    darker = below & display.darker_than_black(xyz)
    mask[surface] = BELOW_GAMUT * below + ABOVE_WHITE * above + BELOW_BLACK * darker
    off = _off(xyz, rgb, np.logical_and(below, ~above), display)
    return Limits(float(below.mean()), float(above.mean()), off, float(darker.mean())), mask


def _off(
    xyz: Float[np.ndarray, "N 3"],
    rgb: Float[np.ndarray, "N 3"],
    chosen: Bool[np.ndarray, "N"],
    display: DisplayTransform,
) -> float | None:
    """Return the mean ΔE2000 between chosen colours and the displayed ones."""
    if not chosen.any():
        return None
    try:
        shown = display.shown(rgb[chosen])
    except InputError:
        return None
    labs = [lab_from_xyz(one.astype(np.float64), DISPLAY_WHITE_XYZ) for one in (xyz[chosen], shown)]
    return float(delta_e_lab(labs[0], labs[1], "CIE 2000").mean())
