"""Chromatic adaptation by scaling in a cone-like space."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from .axis_letters import Matrix3, White
from .errors import InputError, UnknownNameError

Method = Literal["Bradford", "CAT02", "CAT16"]

# Rows take XYZ to sharpened cone responses: Lam 1985 (in CIE 15 sec. 8), CIE 159:2004 eq. (1), Li et al. 2017 eq. (5).
CONE_FROM_XYZ = {
    "Bradford": np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]),
    "CAT02": np.array([[0.7328, 0.4296, -0.1624], [-0.7036, 1.6975, 0.0061], [0.0030, 0.0136, 0.9834]]),
    "CAT16": np.array(
        [[0.401288, 0.650173, -0.051461], [-0.250268, 1.204414, 0.045854], [-0.002079, 0.048952, 0.953127]]
    ),
}


def adaptation_matrix(white_from_xyz: White, white_to_xyz: White, method: Method = "Bradford") -> Matrix3:
    """Matrix M (3,3) that moves one white to another, full adaptation: adapted = M @ xyz, or xyz @ M.T for images.

    Raises
    ------
    InputError
        A white whose response in some cone channel is not positive: there is nothing to scale by.
    """
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
    return np.linalg.solve(cones, (response_to / response_from)[:, None] * cones)
