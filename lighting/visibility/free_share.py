"""Free share of a spherical Gaussian: beside the nearest occlusion boundary, and above a triangle's plane.

Near the axis p of a lobe G(i) = exp(lambda (i . p - 1)) the boundary is approximated by a great circle at the signed
angle theta_d: Wang, Ren, Gong, Snyder and Guo 2009, eqs. 25 to 30. The free part is then f_h(theta_d, lambda), here
divided by f_h(pi / 2, lambda), the whole lobe above the horizon of p.

The paper's polynomial (its eq. 48) is not usable as printed. Instead: the density of f_h in theta_d is about
exp(lambda cos theta_d), a Gaussian in 2 sin(theta_d / 2) = theta_d - theta_d^3 / 24 + ... for sharp lobes and uniform
for lambda = 0. So

    share = 1/2 + 1/2 E(u(theta_d)) / E(u(pi / 2)),      u(t) = k (t + c t^3),
    k^2 = lambda / 2 (lambda + 0.2098) / (lambda + 1.2041),   c = -lambda / (24 (lambda + 0.3460)),

with E(x) = tanh(x (1.12838 + 0.10277 x^2)) for the error function, which GLSL lacks. The four constants are fitted to
the integral. Largest error of the share over all lambda >= 0 and all angles: `LARGEST_ERROR`.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError

#: Largest error of `free_share`, at lambda = 3 (tested).
LARGEST_ERROR = 0.0015
# Below this sharpness the share is linear in the angle to 1e-6, and E(u) / E(u) would lose its digits.
_LEAST_SHARPNESS = 1e-6
# Lowest axis below the shading normal's horizon, in sigmas: farther down less than a hundredth of the light is left,
# and the error of `error_function`, 4e-4, would be divided by numbers of its own size.
_LOWEST = -2.0


def free_share(
    angles: Float[np.ndarray, "*n"], sharpness: Float[np.ndarray, "*lobes"] | float
) -> Float[np.ndarray, "*both"]:
    """Return the free share, 0 to 1, of lobes.

    Parameters
    ----------
    angles : signed angles from the lobe's axis to the boundary, radians, positive where the axis is free; beyond +-pi /
        2 the lobe is entirely free or hidden.
    sharpness : lambda of the lobe, not negative; 0 is uniform light from above the horizon of the axis.

    Raises
    ------
    InputError : a sharpness that is negative or no number.

    >>> free_share(np.array([-np.pi / 2, 0.0, np.pi / 2]), 10.0).tolist()
    [0.0, 0.5, 1.0]
    """
    sharpness = np.asarray(sharpness, dtype=np.float64)
    if not (sharpness >= 0.0).all():
        found = float(sharpness[~(sharpness >= 0.0)].flat[0])
        raise InputError("not a sharpness", field="sharpness", found=found, expected="0 or more")
    k, c = steepness(sharpness)

    def below(theta: Float[np.ndarray, "*m"]) -> Float[np.ndarray, "*o"]:
        return error_function(k * (theta + c * theta**3))

    theta = np.clip(angles, -0.5 * np.pi, 0.5 * np.pi)
    return 0.5 + 0.5 * below(theta) / below(np.full_like(theta, 0.5 * np.pi))


def steepness(
    sharpness: Float[np.ndarray, "*lobes"] | float,
) -> tuple[Float[np.ndarray, "*lobes"] | float, Float[np.ndarray, "*lobes"] | float]:
    """Return k and c of u(t)."""
    lambda_ = np.clip(sharpness, _LEAST_SHARPNESS, 1e12)
    k = np.sqrt(0.5 * lambda_ * (lambda_ + 0.2098) / (lambda_ + 1.2041))
    return k, -lambda_ / (24.0 * (lambda_ + 0.3460))


def error_function(x: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Approximate erf(x) to 4e-4, as the shaders do."""
    # Clamped to 6, where it is 1 to the last digit.
    x = np.clip(x, -6.0, 6.0)
    return np.tanh(x * (1.12838 + 0.10277 * x * x))


def share_above(
    facet: Float[np.ndarray, "*n"], shading: Float[np.ndarray, "*n"], sharpness: Float[np.ndarray, "*lobes"] | float
) -> Float[np.ndarray, "*n"]:
    """Return the share, 0 to 1, of a Gaussian's illuminance that comes from above the triangle's plane.

    A point sees directions above both the horizon of its triangle and that of its shading normal. Between vertices of a
    coarse mesh the two differ by ten degrees and more, and the difference jumps from triangle to triangle. Sites at
    vertices cannot store that, and need not, since both normals are known at the point.

    Near the horizon a spherical Gaussian exp(lambda (v . p - 1)) is a Gaussian in the sine of the elevation, of the
    width sigma = 1 / sqrt(lambda). With s and f the sines of its axis above the horizons of the shading normal and of
    the triangle, both assumed parallel there, its illuminance is the integral of x exp(-(x - s)^2 / (2 sigma^2)) over x
    > 0, and over x > s - f where the triangle's horizon is the higher one; otherwise the share is exactly 1. Both
    integrals are elementary:

        g(t) = sigma exp(-(t / sigma)^2 / 2) / sqrt(2 pi) + s Phi(t / sigma),        share = g(f) / g(s).

    Parameters
    ----------
    facet, shading : sines of the axis's elevation above the triangle's plane and above the shading normal's horizon.
    sharpness : lambda, positive.
    """
    sigma = 1.0 / np.sqrt(sharpness)
    axis = np.maximum(shading / sigma, _LOWEST)
    edge = axis + np.minimum((facet - shading) / sigma, 0.0)

    def sent(to: Float[np.ndarray, "*m"]) -> Float[np.ndarray, "*m"]:
        below = 0.5 + 0.5 * error_function(to * np.sqrt(0.5))
        return np.exp(-0.5 * to * to) / np.sqrt(2.0 * np.pi) + axis * below

    return np.clip(sent(edge) / sent(axis), 0.0, 1.0)
