"""Share of a spherical Gaussian on one side of a plane, exact; `lighting.visibility` has a quick form.

A hemisphere whose edge passes the lobe's axis at an angle theta_d (positive: the axis is inside). Turning the edge by
d theta_d sweeps, at psi along it, cos(psi) d theta_d, so that with the modified Bessel function I_1

    d/d theta_d  of the integral  =  2 pi I_1(lambda cos theta_d) exp(-lambda),

which is smooth, and one short quadrature from the half at theta_d = 0 gives any of them.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# Beyond so many standard deviations 1 / sqrt(lambda) nothing is added to the 16th digit.
_FAR = 9.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


def share_in_hemisphere(theta_d: Float[np.ndarray, "..."], sharpness: Float[np.ndarray, "..."]) -> np.ndarray:
    """Return the share of a Gaussian's integral over the sphere that lies inside, exact to 1e-12.

    theta_d : of the lobe's axis above the edge, rad, from -pi/2 to pi/2. sharpness : lambda >= 0.
    """
    from scipy.special import ive

    theta_d, sharpness = np.broadcast_arrays(np.asarray(theta_d, dtype=float), np.asarray(sharpness, dtype=float))
    safe = np.maximum(sharpness, 1e-12)
    to = np.minimum(np.abs(theta_d), _FAR / np.sqrt(safe))
    angle = 0.5 * to[..., None] * (_NODES + 1.0)
    cosine = np.cos(angle)
    fall = np.exp(-2.0 * sharpness[..., None] * np.sin(0.5 * angle) ** 2)
    swept = 0.5 * to * np.sum(_WEIGHTS * ive(1, sharpness[..., None] * cosine) * fall, axis=-1)
    # Over the whole, 2 pi (1 - exp(-2 lambda)) / lambda.
    share = swept * safe / -np.expm1(-2.0 * safe)
    # A half less a half is rounding's; there are no shares below 0 or above 1.
    return np.asarray(np.clip(0.5 + np.copysign(share, theta_d), 0.0, 1.0))
