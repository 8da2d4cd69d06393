"""Spherical Gaussians cut by an occlusion boundary: the remaining share, and its mean direction and sharpness.

The share alone (`free_share`) does not determine the light: a lobe that a table cuts from below loses the dark ground,
not an equal part of the sky. The remainder is approximated by a Gaussian again, with the same mean direction and
spread.

With the boundary a great circle at the signed angle theta from the axis p, and M0 the integral of the free part of G(i)
= exp(lambda (i . p - 1)), the mean direction follows exactly from M0: its component across p, towards the free side, is
(dM0 / dtheta) / (lambda M0), since moving p changes G alone, and that along p is 1 + (d ln M0 / dlambda). With M0
proportional to `free_share`, which for sharp lobes is a function of theta sqrt(lambda),

    across = share' / (lambda share),      along = 1 / (1 - exp(-lambda)) - 1 / lambda + theta across / 2.

share' is taken relative to its value at pi / 2, where nothing is hidden. Compared with the integral over the free part
of the hemisphere about p, the mean direction is accurate to 0.03 rad and the sharpness to a fifth, for lambda >= 2 and
a free share of at least a sixth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .free_share import error_function, free_share, steepness

# Free share below which the remaining light is assumed to come from near the axis.
_LEAST = 1e-3
# Largest gain in sharpness, of a Gaussian cut in half or by more.
_SHARPEST = 2.0


class CutLobe(NamedTuple):
    """Free part of each lobe: its share of the lobe; the angle, radians, from the axis to its mean direction, towards
    the free side; and its sharpness.
    """

    share: Float[np.ndarray, "*n"]
    turn: Float[np.ndarray, "*n"]
    sharpness: Float[np.ndarray, "*n"]


def cut_lobe(
    angles: Float[np.ndarray, "*n"], slopes: Float[np.ndarray, "*n"], sharpness: Float[np.ndarray, "*n"]
) -> CutLobe:
    """Cut lobes at an occlusion boundary.

    Parameters
    ----------
    angles : signed angles from the axis to the boundary, see `free_share`. slopes : derivative of the angle towards the
        free side, 0 to 1; below 1 the boundary is no great circle, and the mean direction moves less.
    sharpness : lambda, positive.
    """
    share = free_share(angles, sharpness)
    k, c = steepness(sharpness)

    def steep(theta: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        return np.exp(-np.square(k * (theta + c * theta**3))) * (1.0 + 3.0 * c * theta * theta)

    theta, right = np.clip(angles, -0.5 * np.pi, 0.5 * np.pi), np.full_like(angles, 0.5 * np.pi)
    whole = error_function(k * (right + c * right**3))
    rise = k / (np.sqrt(np.pi) * whole) * np.maximum(steep(theta) - steep(right), 0.0)
    across = slopes * rise / (sharpness * np.maximum(share, _LEAST))
    alone = mean_cosine(sharpness)
    along = np.maximum(alone + 0.5 * theta * across, 0.0)
    length = np.hypot(across, along)
    sharper = np.clip((1.0 - alone) / np.maximum(1.0 - length, (1.0 - alone) / _SHARPEST), 1.0, _SHARPEST)
    return CutLobe(share, np.arctan2(across, along), sharpness * sharper)


def mean_cosine(sharpness: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Compute the mean cosine between a Gaussian over a hemisphere and its axis: 1 / (1 - exp(-lambda)) - 1 /
    lambda.
    """
    small = sharpness < 0.01
    lambda_ = np.where(small, 1.0, sharpness)
    # Series where the two terms cancel.
    return np.where(small, 0.5 + sharpness / 12.0, -1.0 / np.expm1(-lambda_) - 1.0 / lambda_)
