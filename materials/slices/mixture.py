"""Mixtures of spherical Gaussians and one cosine, fitted to a slice by expectation-maximisation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

# A mean resultant length that is no closer to 1 than rounding of directions leaves; a sharpness of 2e9.
_LONGEST = 1.0 - 1.0e-9
#: Least sharpness: such a Gaussian is even over the sphere, and no hemisphere's slice is made of such.
BLUNTEST = 0.5
#: Floor of a Gaussian's exponent, where it counts as 0.
FARTHEST = -300.0
# Least share of a part, so that none dies.
_LEAST = 1.0e-6


@dataclass(frozen=True, eq=False)
class Mixture:
    """Q normalised spherical Gaussians and a cosine.

    axes (Q,3) : unit. sharpness (Q,) : lambda. shares (Q+1,) : weights in the sum, above 0, the cosine's last.
    """

    axes: Float[np.ndarray, "Q 3"]
    sharpness: Float[np.ndarray, " Q"]
    shares: Float[np.ndarray, "_"]

    def refined(self, directions: Float[np.ndarray, "S 3"], power: Float[np.ndarray, " S"], rounds: int) -> Mixture:
        """Refine the mixture by `rounds` of expectation-maximisation (Banerjee et al. 2005, eq. 4.4 for the sharpness).

        power (S,) : of each direction, non-negative, some of it above 0. Shares sum to the total power, and each stays
        above a millionth of it.
        """
        found, least, to = self, _LEAST * power.sum(), np.ascontiguousarray(directions.T)
        for _ in range(rounds):
            weight, rest = found.densities(to)
            of_whole = power / (weight.sum(axis=0) + rest)
            weight *= of_whole
            shares = np.maximum(np.append(weight.sum(axis=1), rest @ of_whole), least)
            moment = weight @ directions
            length = np.linalg.norm(moment, axis=1)
            axes = np.where(length[:, None] > 0.0, moment / np.where(length > 0.0, length, 1.0)[:, None], found.axes)
            mean = np.clip(length / shares[:-1], 0.0, _LONGEST)
            sharpness = np.maximum(mean * (3.0 - mean**2) / (1.0 - mean**2), BLUNTEST)
            found = Mixture(axes, sharpness, shares)
        return found

    def likelihood(self, directions: Float[np.ndarray, "S 3"], power: Float[np.ndarray, " S"]) -> float:
        """Compute the mean log-density, weighted by `power` (S,), non-negative, some of it above 0."""
        lobes, rest = self.densities(np.ascontiguousarray(directions.T))
        return float(np.log(lobes.sum(axis=0) + rest) @ power / power.sum())

    def turned(self, rotation: Float[np.ndarray, "3 3"]) -> Mixture:
        """Return the mixture with its Gaussians rotated."""
        return replace(self, axes=self.axes @ rotation.T)

    def densities(self, to: Float[np.ndarray, "3 S"]) -> tuple[Float[np.ndarray, "Q S"], Float[np.ndarray, " S"]]:
        """Evaluate each Gaussian at each direction, and the cosine, which is above 0 everywhere."""
        norm = self.sharpness / (2.0 * np.pi * -np.expm1(-2.0 * self.sharpness))
        lobes = self.axes @ to
        lobes -= 1.0
        lobes *= self.sharpness[:, None]
        # Numbers below 1e-308 would be nothing but slow.
        np.maximum(lobes, FARTHEST, out=lobes)
        np.exp(lobes, out=lobes)
        lobes *= (self.shares[:-1] * norm)[:, None]
        return lobes, (self.shares[-1] / np.pi) * to[2]
