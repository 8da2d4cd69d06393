"""Irradiance of an environment on a matt surface, by the surface's normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from . import convolution
from .environment import EnvironmentLight

#: Rows of the map over normals: where the sun sets on a surface, the cosine's edge is then good to 0.2 % of what the
#: sun gives at most.
ROWS = 128
#: Rows of the environment that are enough for this: half a degree of smoothing moves a cosine by 1e-5.
ENVIRONMENT_ROWS = 180


@dataclass(frozen=True, eq=False)
class Irradiance:
    """Illuminance over normals: the environment convolved with the clamped cosine, Ramamoorthi and Hanrahan 2001.

    lux (K, ROWS, 2 ROWS) : by the surface's normal, latitude-longitude, in the environment's own frame.
    world_from_map : turns that frame.
    """

    lux: Float[np.ndarray, "K H W"]
    world_from_map: Float[np.ndarray, "3 3"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> Irradiance:
        """Made once, by sums over all directions."""
        return cls.of_fields(environment.fields, environment.world_from_map)

    @classmethod
    def of_fields(cls, fields: Float[np.ndarray, "K H W"], world_from_map: np.ndarray | None = None) -> Irradiance:
        """Return the same of any fields, which may be negative too: a map's moments."""
        fields = convolution.Resolutions(fields).at_least(ENVIRONMENT_ROWS)
        mean = convolution.convolved(fields, lambda cosine: np.maximum(cosine, 0.0), 0.5 * np.pi, ROWS)
        # A mean under the clamped cosine, whose integral is pi.
        return cls(np.pi * mean, np.eye(3) if world_from_map is None else world_from_map)

    def __call__(self, normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n K"]:
        """(n, K) lx on surfaces of these unit normals of the world, one for each of the environment's spectra."""
        return convolution.smooth_between_texels(self.lux, normals @ self.world_from_map)
