"""Mixtures of spherical Gaussians and one cosine, fitted to what a slice sends where: expectation and maximisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

# A mean resultant length that is no closer to 1 than rounding of directions leaves; a sharpness of 2e9.
_LONGEST = 1.0 - 1.0e-9
# Sharpness is no lower: such a Gaussian is even over the sphere, which is nothing that a hemisphere's slice is made of.
_BLUNTEST = 0.5


@dataclass(frozen=True, eq=False)
class Mixture:
    """Q normalised spherical Gaussians and a cosine.

    axes (Q,3) : unit. sharpness (Q,) : lambda. shares (Q+1,) : of the whole, above 0, the cosine's last.
    """

    axes: Float[np.ndarray, "Q 3"]
    sharpness: Float[np.ndarray, " Q"]
    shares: Float[np.ndarray, "_"]

    def responsibilities(self, directions: Float[np.ndarray, "S 3"]) -> Float[np.ndarray, "S _"]:
        """(S, Q+1) which part of what comes from each direction is whose; rows add up to 1."""
        logs = np.empty((len(directions), len(self.shares)))
        norm = self.sharpness / (2.0 * np.pi * -np.expm1(-2.0 * self.sharpness))
        # 1 - v.p from the difference: it does not cancel where lobes are sharp.
        near = 1.0 - directions @ self.axes.T
        logs[:, :-1] = np.log(self.shares[:-1] * norm) - self.sharpness * near
        logs[:, -1] = np.log(self.shares[-1] * directions[:, 2] / np.pi)
        logs -= logs.max(axis=1, keepdims=True)
        found = np.exp(logs)
        return found / found.sum(axis=1, keepdims=True)

    def shared(self, directions: Float[np.ndarray, "S 3"], power: Float[np.ndarray, " S"], rounds: int) -> Mixture:
        """The same Gaussians with the shares that suit `power` (S,), not negative, some of it above 0."""
        shares = self.shares * (power.sum() / self.shares.sum())
        for _ in range(rounds):
            found = power @ Mixture(self.axes, self.sharpness, shares).responsibilities(directions)
            shares = np.maximum(found, 1.0e-6 * power.sum())
        return Mixture(self.axes, self.sharpness, shares)

    def refined(self, directions: Float[np.ndarray, "S 3"], power: Float[np.ndarray, " S"], rounds: int) -> Mixture:
        """After so many rounds of expectation and maximisation (Banerjee et al. 2005, with their eq. 4.4 for the
        sharpness); power (S,) is what comes from each direction, not negative, some of it above 0.

        Shares add up to the whole power. No part dies: its share stays above a millionth.
        """
        axes, sharpness, shares = self.axes, self.sharpness, self.shares
        least = 1.0e-6 * power.sum()
        for _ in range(rounds):
            weight = Mixture(axes, sharpness, shares).responsibilities(directions) * power[:, None]
            shares = np.maximum(weight.sum(axis=0), least)
            moment = weight[:, :-1].T @ directions
            length = np.linalg.norm(moment, axis=1)
            axes = np.where(length[:, None] > 0.0, moment / np.where(length > 0.0, length, 1.0)[:, None], axes)
            mean = np.clip(length / shares[:-1], 0.0, _LONGEST)
            sharpness = np.maximum(mean * (3.0 - mean**2) / (1.0 - mean**2), _BLUNTEST)
        return Mixture(axes, sharpness, shares)

    def turned(self, rotation: Float[np.ndarray, "3 3"]) -> Mixture:
        """Its Gaussians turned about the point."""
        return Mixture(self.axes @ rotation.T, self.sharpness, self.shares)
