"""Spherical Gaussians and their closed forms.

Formulas use the squared distance of two unit vectors in place of 1 - cosine, and exp(-x) in place of sinh(x): no
sharpness overflows, and none loses digits (lambda from 1e-6 to 1e8 in the tests).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

#: A Gaussian's support is where it is above this share of its top (Wang et al. 2009, eq. 3).
EPSILON = 0.1

Scalars = Float[np.ndarray, "..."]
Vectors = Float[np.ndarray, "... 3"]
# Standard deviations 1 / sqrt(lambda) beyond which nothing is added to the 16th digit.
_FAR = 9.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)


@dataclass(frozen=True, eq=False)
class Gaussians:
    """Lobes G(v; p, lambda, mu) = mu exp(lambda (v . p - 1)) (Wang et al. 2009, eq. 2), any number of them at once.

    axis (..., 3) : p, unit. sharpness (...) : lambda >= 0; 0 is a constant. amplitude (...) : mu. Their shapes
    broadcast. A mixture (eq. 6) is an array of lobes, summed over its last axis.
    """

    axis: Vectors
    sharpness: Scalars
    amplitude: Scalars

    def value(self, directions: Vectors) -> Scalars:
        """Evaluate G in unit directions (..., 3), eq. 2."""
        apart = np.sum((directions - self.axis) ** 2, axis=-1)
        return np.asarray(self.amplitude * np.exp(-0.5 * self.sharpness * apart))

    @property
    def integral(self) -> Scalars:
        """Integral over the sphere: 2 pi mu (1 - exp(-2 lambda)) / lambda, and 4 pi mu for lambda = 0."""
        return np.asarray(self.amplitude * sphere_integral(self.sharpness))

    def product(self, other: Gaussians) -> Gaussians:
        """Multiply G1 G2 in each direction, again a Gaussian (eq. 5, derived in eqs. 44 and 45).

        With d = |lambda1 p1 + lambda2 p2| the printed exponent d - lambda1 - lambda2 is written as -lambda1 lambda2 |p1
        - p2|^2 / (d + lambda1 + lambda2): the same, without the cancellation.
        """
        first, second = np.asarray(self.sharpness)[..., None], np.asarray(other.sharpness)[..., None]
        summed = first * self.axis + second * other.axis
        sharpness = np.asarray(np.linalg.norm(summed, axis=-1))
        whole = self.sharpness + other.sharpness
        exponent = self.sharpness * other.sharpness * np.sum((self.axis - other.axis) ** 2, axis=-1)
        exponent = exponent / np.maximum(sharpness + whole, np.finfo(float).tiny)
        # Opposite lobes of one sharpness give a constant, whose axis may be any.
        somewhere = sharpness > 0.0
        axis = np.where(somewhere[..., None], summed / np.where(somewhere, sharpness, 1.0)[..., None], self.axis)
        return Gaussians(axis, sharpness, np.asarray(self.amplitude * other.amplitude * np.exp(-exponent)))

    def inner(self, other: Gaussians) -> Scalars:
        """Integrate G1 G2 over the sphere (eq. 4, whose sinh overflows from lambda1 + lambda2 = 710 on)."""
        return self.product(other).integral

    def over_hemisphere(self, normal: Vectors) -> Scalars:
        """Integrate over the directions with v . normal > 0, exactly."""
        elevation = np.arctan2(
            np.sum(self.axis * normal, axis=-1), np.linalg.norm(np.cross(self.axis, normal), axis=-1)
        )
        return np.asarray(self.integral * share_in_hemisphere(np.asarray(elevation), self.sharpness))


def sphere_integral(sharpness: Scalars) -> Scalars:
    """Integrate exp(lambda (v . p - 1)) over the sphere, sr; 4 pi at lambda = 0."""
    sharpness = np.asarray(sharpness, dtype=np.float64)
    safe = np.maximum(sharpness, 1e-300)
    return np.where(sharpness > 1e-300, -2.0 * np.pi * np.expm1(-2.0 * safe) / safe, 4.0 * np.pi)


def area(sharpness: Scalars, epsilon: float = EPSILON) -> Scalars:
    """Compute f_a, sr: the area in which a Gaussian exceeds `epsilon` of its peak (eq. 3), at most the sphere.

    The printed form holds for lambda > -ln(epsilon) / 2, where the support does not yet cover the sphere; the paper
    requires twice that, so that it is within a hemisphere.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum(-2.0 * np.pi * np.log(epsilon) / sharpness, 4.0 * np.pi))


def sharpness_of_area(area_sr: Scalars, epsilon: float = EPSILON) -> Scalars:
    """Invert `area`, for an area below 4 pi."""
    return np.asarray(-2.0 * np.pi * np.log(epsilon) / area_sr)


def share_in_hemisphere(theta_d: Float[np.ndarray, "..."], sharpness: Float[np.ndarray, "..."]) -> np.ndarray:
    """Compute the fraction of a Gaussian's integral over the sphere within a hemisphere, exact to 1e-12.

    theta_d : of the lobe's axis above the edge, rad, from -pi/2 to pi/2. sharpness : lambda >= 0. Rotating the edge by
    d theta_d sweeps, at psi along it, cos(psi) d theta_d, so that with the modified Bessel function I_1 d/d theta_d of
    the integral is 2 pi I_1(lambda cos theta_d) exp(-lambda): smooth, and one short quadrature from the half at theta_d
    = 0 suffices for any of them. `lighting.visibility.free_share` is a fast approximation.
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
