"""Shift of a colour between lights: how far its corresponding colour in daylight lies from the colour there."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...calibration.report.direction import direction
from ...calibration.report.review_facts import SHIFT_ADAPTATION, SHIFT_FORMULA, Shift
from ...runtime.errors import InputError
from ...spectral.adaptation import adaptation_matrix
from ...spectral.axis_letters import Lab, White
from ...spectral.difference import delta_e, differences, lab_from_xyz

# Differences in CIELAB that no word is spent on.
_SPOKEN_FROM = 0.5


def corresponding_lab(xyz: Float[np.ndarray, "3"], white: White, daylight: White) -> Lab | None:
    """CIELAB under `SHIFT_FROM` of the colour that looks alike there, by complete adaptation; None where none is
    possible.

    daylight : white of `SHIFT_FROM` for the same observer.
    """
    try:
        adapted = adaptation_matrix(white, daylight, SHIFT_ADAPTATION) @ xyz
    except InputError:
        return None
    return lab_from_xyz(adapted, daylight)


def shift_between(first: Lab, second: Lab) -> Shift:
    """Change from one adapted colour to another: CIE 2000, and the direction in the words of a match."""
    return Shift(
        float(delta_e(first, second, SHIFT_FORMULA)), direction(first, differences(first, second), _SPOKEN_FROM)
    )
