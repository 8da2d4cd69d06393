"""Kriging over pairs of directions: a Gaussian process that knows the symmetries of an isotropic surface.

Coordinates are functions of theta_h, theta_d, theta_i + theta_o and |theta_i - theta_o| only, so that what is
interpolated has the mirror symmetry and the reciprocity of a physical BRDF by construction, without swapped copies of
the data.

The covariance is a sum of three Matern-5/2 functions: one over half/difference angles, where lobes are simple; one
over the polar angles, where matt surfaces are; and one over half and difference angle alone, which ties a lobe
together over its azimuths. Rasmussen and Williams 2006, Gaussian Processes for Machine Learning: eq. (4.17) and
section 2.7.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError

# Solving costs N^3; at this size it takes minutes and a gigabyte.
LARGEST = 12000
# Rows of the covariance per block: they stay in the cache.
_BLOCK = 128


@dataclass(frozen=True)
class PairAngles:
    """Angles (N,) of direction pairs, radians; theta_i and theta_o in any order."""

    theta_i: Float[np.ndarray, " N"]
    theta_o: Float[np.ndarray, " N"]
    theta_h: Float[np.ndarray, " N"]
    theta_d: Float[np.ndarray, " N"]

    def __len__(self) -> int:
        return len(self.theta_h)

    def __getitem__(self, rows: slice | np.ndarray) -> PairAngles:
        return PairAngles(self.theta_i[rows], self.theta_o[rows], self.theta_h[rows], self.theta_d[rows])


@dataclass(frozen=True)
class Kernel:
    """Scales of the covariance. Angles in radians; `*_unit` are where a half angle turns from linear to logarithmic.

    lobe_*: half/difference part, of variance 1. polar_*: polar-angle part. ridge_*: half and difference angle alone.
    nugget: variance of the measurement noise, in the same unit.

    The defaults were tuned by cross-validation on three measured automotive and spray paints, and are a guess for any
    other material; `benchmarks/scattered.py` validates them on a file by holding out tenths and rings of it.
    """

    lobe_unit: float = 0.0213
    lobe_half: float = 9.3
    lobe_difference: float = 0.296
    lobe_tilt: float = 2.18
    polar_variance: float = 0.65
    polar_sum: float = 0.925
    polar_apart: float = 0.727
    polar_difference: float = 4.19
    polar_half: float = 0.985
    ridge_variance: float = 0.256
    ridge_unit: float = 0.0105
    ridge_half: float = 3.64
    ridge_difference: float = 0.988
    nugget: float = 1.8e-5

    @property
    def array(self) -> Float[np.ndarray, " K"]:
        """Scales in the order of the fields, for storing."""
        return np.array([getattr(self, field.name) for field in fields(self)])

    @classmethod
    def from_array(cls, scales: Float[np.ndarray, " K"]) -> Kernel:
        """Return the kernel that `array` came from."""
        if len(scales) != len(fields(cls)):
            raise InputError("not the scales of a kernel", found=len(scales), expected=f"{len(fields(cls))} numbers")
        return cls(*(float(scale) for scale in scales))

    def covariance(self, a: PairAngles, b: PairAngles) -> Float[np.ndarray, "N M"]:
        """Compute the prior covariance of the values at every pair of `a` and every pair of `b`."""
        variances = (1.0, self.polar_variance, self.ridge_variance)
        known = self._features(b)
        total = np.empty((len(a), len(b)))
        for start in range(0, len(a), _BLOCK):
            rows = slice(start, start + _BLOCK)
            parts = zip(variances, self._features(a[rows]), known, strict=True)
            total[rows] = sum(variance * _matern(left, right) for variance, left, right in parts)
        return total

    def _features(self, at: PairAngles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        # (cos theta_i - cos theta_o) / 2 = sin theta_h sin theta_d cos phi_d: even in the exchange once squared.
        tilt = 0.5 * (np.cos(at.theta_i) - np.cos(at.theta_o))
        apart = np.hypot(at.theta_i - at.theta_o, 0.2)
        lobe = (
            np.arcsinh(at.theta_h / self.lobe_unit) / self.lobe_half,
            at.theta_d / self.lobe_difference,
            (tilt / self.lobe_tilt) ** 2,
        )
        polar = (
            (at.theta_i + at.theta_o) / self.polar_sum,
            apart / self.polar_apart,
            at.theta_d / self.polar_difference,
            at.theta_h / self.polar_half,
        )
        ridge = (np.arcsinh(at.theta_h / self.ridge_unit) / self.ridge_half, at.theta_d / self.ridge_difference)
        return np.stack(lobe, -1), np.stack(polar, -1), np.stack(ridge, -1)


@dataclass(frozen=True, eq=False)
class Kriging:
    """Values (N,S) at direction pairs, and the weights that interpolate them. Make one with `krige`."""

    kernel: Kernel
    at: PairAngles
    mean: Float[np.ndarray, " S"]
    weights: Float[np.ndarray, "N S"]

    def __call__(self, at: PairAngles) -> Float[np.ndarray, "M S"]:
        """Interpolate values; far from every measured pair they return to the mean."""
        out = np.empty((len(at), len(self.mean)))
        for start in range(0, len(at), _BLOCK):
            rows = slice(start, start + _BLOCK)
            out[rows] = self.kernel.covariance(at[rows], self.at) @ self.weights
        return out + self.mean


def krige(kernel: Kernel, at: PairAngles, values: Float[np.ndarray, "N S"]) -> Kriging:
    """Solve for the weights, with a constant mean per column estimated by generalised least squares."""
    from scipy.linalg import cho_factor, cho_solve

    if len(at) > LARGEST:
        hint = "leave out rows where the measurement is denser than the surface needs"
        raise InputError("too many direction pairs", found=len(at), expected=f"at most {LARGEST}", hint=hint)
    covariance = kernel.covariance(at, at)
    covariance[np.diag_indices_from(covariance)] += kernel.nugget
    factor = cho_factor(covariance, lower=True, overwrite_a=True, check_finite=False)
    ones = cho_solve(factor, np.ones(len(at)))
    mean = ones @ values / ones.sum()
    return Kriging(kernel, at, mean, cho_solve(factor, values - mean))


def _matern(a: Float[np.ndarray, "N F"], b: Float[np.ndarray, "M F"]) -> Float[np.ndarray, "N M"]:
    """Evaluate the Matern covariance of smoothness 5/2 and unit scale (Rasmussen and Williams 2006, eq. 4.17)."""
    distance = a @ b.T
    distance *= -2.0
    distance += np.sum(a * a, axis=1)[:, None]
    distance += np.sum(b * b, axis=1)
    np.maximum(distance, 0.0, out=distance)
    distance *= 5.0
    np.sqrt(distance, out=distance)
    decay = np.exp(-distance)
    distance *= 1.0 + distance / 3.0
    distance += 1.0
    distance *= decay
    return distance
