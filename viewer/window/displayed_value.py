"""Display value of a colour, by OpenColorIO on the CPU: value, code and clipping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import xyz_from_lab
from ..display.png import quantise
from ..display.transform import CLIP_TOLERANCE, DISPLAY_WHITE_XYZ, DisplayTransform
from .state import Adaptation


@dataclass(frozen=True, eq=False)
class Displayed:
    """Display value. rgb (3,) : encoded, before clipping. codes : 8 bits. clipped : "R above, B below", "darker than
    black" for a display with black luminance, or "beyond the gamut" of a profile with codes limited to it; "" if the
    display can show it. Limits applied by a view itself are not detected.
    """

    rgb: Float[np.ndarray, "3"]
    codes: tuple[int, int, int]
    clipped: str


def displayed(
    xyz: Float[np.ndarray, "3"],
    white: Float[np.ndarray, "3"],
    display: DisplayTransform,
    adaptation: Adaptation,
    exposure: float = 0.0,
    surround: float = 50.0,
    coverage: float = 1.0,
) -> Displayed:
    """Return a colour as the window shows it.

    Parameters
    ----------
    xyz, white : (3,) of the image, premultiplied by coverage, and the white of its light.
    exposure : stops. surround : L* of the background, under the display's white. coverage : of the pixel, 0 to 1.
    """
    method, degree = adaptation.method, adaptation.degree
    to_display = adaptation_matrix(white, DISPLAY_WHITE_XYZ, method, degree)  # pyright: ignore[reportArgumentType]
    behind = xyz_from_lab(np.array([surround, 0.0, 0.0]), DISPLAY_WHITE_XYZ)
    xyz_d65 = to_display @ (2.0**exposure * np.asarray(xyz, dtype=np.float64)) + (1.0 - coverage) * behind
    rgb = display.apply(xyz_d65).astype(np.float64)
    sides = [("above", rgb > 1.0 + CLIP_TOLERANCE), ("below", rgb < -CLIP_TOLERANCE)]
    clipped = [f"{name} {side}" for side, which in sides for name, hit in zip("RGB", which, strict=True) if hit]
    below, above = (bool(side) for side in display.out_of_range(xyz_d65, rgb))
    if below and not above and display.darker_than_black(xyz_d65):
        clipped = ["darker than black"]
    elif not clipped and below:
        clipped = ["beyond the gamut"]
    red, green, blue = (int(code) for code in quantise(rgb[None, None])[0, 0])
    return Displayed(rgb, (red, green, blue), ", ".join(clipped))
