"""An environment made ready for renderers: what any lobe and any matt surface gathers of it, by look-ups."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from . import octahedral
from .environment import EnvironmentLight
from .irradiance import Irradiance
from .pyramid import Pyramid

#: Side of the map of irradiances: matt surfaces see nothing finer, but for the edge of a sun that sets on them.
IRRADIANCE_SIDE = 128


@dataclass(frozen=True, eq=False)
class GatheredLight:
    """`pyramid` for lobes; irradiance (side, side, K) lux, float32, octahedral in the environment's own frame."""

    pyramid: Pyramid
    irradiance: Float[np.ndarray, "side side K"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> GatheredLight:
        """Made once; another rotation or spectrum of the light only turns or colours what is looked up."""
        normals = octahedral.texel_directions(IRRADIANCE_SIDE).reshape(-1, 3)
        found = Irradiance.of(environment)(normals @ environment.world_from_map.T)
        shape = (IRRADIANCE_SIDE, IRRADIANCE_SIDE, found.shape[1])
        return cls(Pyramid.of(environment), found.reshape(shape).astype(np.float32))

    def by_lobes(
        self, directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q K"]:
        """Mean luminance under each Gaussian about unit directions of the world, cd/m^2."""
        found = self.pyramid(directions.reshape(-1, 3), sharpness.reshape(-1))
        return found.reshape(*sharpness.shape, -1)

    def by_normals(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N K"]:
        """Illuminance on surfaces that face unit directions of the world, lux, were nothing in between."""
        return octahedral.between_texels(self.irradiance, normals @ self.pyramid.world_from_map)
