"""Pairs of directions refracted into a clear coat over flakes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..analytic.cook_torrance import beckmann, fresnel, ggx, smith_ggx

#: Refractive index of the clear coat.
COAT_INDEX = 1.5
#: Exponent of cos(theta_i) cos(theta_o) on the body, found on measured paints: without it metallics are too dark at
#: grazing angles.
GRAZING = -0.15


@dataclass(frozen=True, eq=False)
class CoatedPair:
    """Pairs above the horizon, refracted into the coat; all (N,), none changed by exchanging light and viewer.

    tilt : angle between the normal and the half vector within the coat, radians: the tilt of a mirroring flake.
    incidence : half the angle between both directions within the coat, radians: the incidence on that flake.
    cosines : cos(theta_i) + cos(theta_o) within the coat.
    through : transmission into the coat and out of it, (1 - F(theta_i)) (1 - F(theta_o)) / n^2.
    """

    tilt: Float[np.ndarray, " N"]
    incidence: Float[np.ndarray, " N"]
    cosines: Float[np.ndarray, " N"]
    through: Float[np.ndarray, " N"]
    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]

    @classmethod
    def of(cls, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> CoatedPair:
        """Refract both directions into the coat."""
        inside_i, inside_o = _refracted(wi), _refracted(wo)
        half, across = inside_i + inside_o, inside_i - inside_o
        return cls(
            tilt=np.arctan2(np.hypot(half[:, 0], half[:, 1]), half[:, 2]),
            # Half and difference are the diagonals of a rhombus.
            incidence=np.arctan2(np.sqrt(np.sum(across**2, axis=1)), np.sqrt(np.sum(half**2, axis=1))),
            cosines=half[:, 2],
            through=_transmitted(wi) * _transmitted(wo) / COAT_INDEX**2,
            wi=wi,
            wo=wo,
        )

    def matt(self, grazing: float = GRAZING) -> Float[np.ndarray, " N"]:
        """Return a white matt body under the coat, 1/sr; `grazing` : exponent of the cosines outside."""
        return self._body(grazing) * COAT_INDEX**2 / np.pi

    def flakes(self, spread: float, grazing: float = GRAZING) -> Float[np.ndarray, " N"]:
        """Evaluate mirror flakes whose tilts are distributed by GGX of that roughness, 1/sr."""
        density = ggx(np.cos(self.tilt) ** 2, np.sin(self.tilt) ** 2, spread)
        return self._body(grazing) * density / (4.0 * self.cosines)

    def _body(self, grazing: float) -> Float[np.ndarray, " N"]:
        return self.through * (self.wi[:, 2] * self.wo[:, 2]) ** grazing

    def coat(self, roughness: float, needle: bool) -> Float[np.ndarray, " N"]:
        """Evaluate the coat's own reflection, F D G / (4 cos cos), 1/sr.

        D is Beckmann's for a needle, which has a bounded tail, else GGX.
        """
        half, across = self.wi + self.wo, self.wi - self.wo
        cos2_d, sin2_d = 0.25 * np.sum(half * half, axis=1), 0.25 * np.sum(across * across, axis=1)
        cos2_h = 0.25 * half[:, 2] ** 2 / cos2_d
        sin2_h = 0.25 * (half[:, 0] ** 2 + half[:, 1] ** 2) / cos2_d
        density = (beckmann if needle else ggx)(cos2_h, sin2_h, roughness)
        return _fresnel(cos2_d, sin2_d) * density * smith_ggx(self.wi, roughness) * smith_ggx(self.wo, roughness)


def aspecular(wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Compute the angle between the viewer and the mirror direction, radians."""
    mirror = wi * (-1.0, -1.0, 1.0)
    along, across = mirror + wo, mirror - wo
    return 2.0 * np.arctan2(np.sqrt(np.sum(across**2, axis=1)), np.sqrt(np.sum(along**2, axis=1)))


def _refracted(w: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Refract directions into the coat (Snell)."""
    flat = w[:, :2] / COAT_INDEX
    return np.column_stack([flat, np.sqrt(1.0 - np.sum(flat**2, axis=1))])


def _transmitted(w: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    return 1.0 - _fresnel(w[:, 2] ** 2, np.sum(w[:, :2] ** 2, axis=1))


def _fresnel(cos2: Float[np.ndarray, " N"], sin2: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    return fresnel(cos2, sin2, np.array([COAT_INDEX]), np.zeros(1))[:, 0]
