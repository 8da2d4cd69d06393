"""Chromatic adaptation by scaling in a cone-like space."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from ..runtime.errors import InputError, UnknownNameError
from .axis_letters import Matrix3, White

Method = Literal["Bradford", "CAT02", "CAT16"]

# Rows take XYZ to sharpened cone responses: Lam 1985 (in CIE 15 sec. 8), CIE 159:2004 eq. (1), Li et al. 2017 eq. (5).
CONE_FROM_XYZ = {
    "Bradford": np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]),
    "CAT02": np.array([[0.7328, 0.4296, -0.1624], [-0.7036, 1.6975, 0.0061], [0.0030, 0.0136, 0.9834]]),
    "CAT16": np.array(
        [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]]
    ),
}


def adaptation_matrix(
    white_from_xyz: White, white_to_xyz: White, method: Method = "Bradford", degree: float = 1.0
) -> Matrix3:
    """Compute the matrix M (3,3) that adapts one white to another: adapted = M @ xyz, or xyz @ M.T for images.

    degree : 1 is full adaptation, which maps one white to the other; 0 is none, the identity; between, D of CIECAM02
        (CIE 159:2004), in any of the cone spaces, both whites having the same Y.

    Raises
    ------
    InputError
        A white with a cone response that is not positive, so that scaling is impossible. A degree outside 0 to 1.
    """
    if not 0.0 <= degree <= 1.0:
        raise InputError("not a degree of adaptation", field="degree", found=degree, expected="0 (none) to 1 (full)")
    if method not in get_args(Method):
        raise UnknownNameError("chromatic adaptation", method, get_args(Method))
    cones = CONE_FROM_XYZ[method]
    response_from = cones @ np.asarray(white_from_xyz, dtype=np.float64)
    response_to = cones @ np.asarray(white_to_xyz, dtype=np.float64)
    for field, response, white in (
        ("white_from_xyz", response_from, white_from_xyz),
        ("white_to_xyz", response_to, white_to_xyz),
    ):
        if not (response > 0).all():
            raise InputError(
                f"{method} adaptation has no meaning for this white",
                field=field,
                found=np.array2string(np.asarray(white), precision=4),
                expected="positive response in every cone channel",
                hint="the light is too narrow in spectrum to adapt to; adapt to a broader one",
            )
    # Full adaptation to the bit as without a degree.
    scale = response_to / response_from
    scale = scale if degree == 1.0 else degree * scale + (1.0 - degree)
    return np.linalg.solve(cones, scale[:, None] * cones)


def degree_of_adaptation(adapting_luminance: float, surround: float = 1.0) -> float:
    """Compute D of CIECAM02 (CIE 159:2004), clamped to 0 and 1: the adaptation to a field's luminance in cd/m^2.

    surround : F, 1 for an average surround, 0.9 for a dim one, 0.8 in the dark.

    >>> round(degree_of_adaptation(1000.0 / np.pi * 0.2), 3)
    0.912
    """
    if not adapting_luminance >= 0.0:
        expected = "0 or more cd/m^2"
        raise InputError("not a luminance", field="adapting_luminance", found=adapting_luminance, expected=expected)
    return float(np.clip(surround * (1.0 - np.exp(-(adapting_luminance + 42.0) / 92.0) / 3.6), 0.0, 1.0))
