"""An environment made ready for renderers: what any lobe and any matt surface gathers of it, by look-ups."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

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
    """Light from all around, of K spectra, in the environment's own frame: made once, good for every rotation.

    pyramid : for lobes. irradiance (side, side, K) : lux by normals, float32, octahedral.
    """

    pyramid: Pyramid
    irradiance: Float[np.ndarray, "side side K"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> GatheredLight:
        """What an environment sends, whichever way it is turned."""
        level = replace(environment, rotation_deg=0.0)
        normals = octahedral.texel_directions(IRRADIANCE_SIDE).reshape(-1, 3)
        found = Irradiance.of(level)(normals)
        shape = (IRRADIANCE_SIDE, IRRADIANCE_SIDE, found.shape[1])
        return cls(Pyramid.of(level), found.reshape(shape).astype(np.float32))

    def by_lobes(
        self, directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q K"]:
        """Mean luminance under each Gaussian about unit directions, cd/m^2."""
        found = self.pyramid(directions.reshape(-1, 3), sharpness.reshape(-1))
        return found.reshape(*sharpness.shape, -1)

    def by_normals(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N K"]:
        """Illuminance on surfaces that face unit directions, lx, were nothing in between."""
        u, v = octahedral.places(normals)
        padded = self._bordered
        column, row = (0.5 * (place + 1.0) * IRRADIANCE_SIDE + 0.5 for place in (u, v))
        left, top = (np.minimum(np.floor(at).astype(np.int64), IRRADIANCE_SIDE) for at in (column, row))
        right, down = (column - left)[:, None], (row - top)[:, None]
        above = padded[top, left] * (1.0 - right) + padded[top, left + 1] * right
        below = padded[top + 1, left] * (1.0 - right) + padded[top + 1, left + 1] * right
        return above * (1.0 - down) + below * down

    @cached_property
    def _bordered(self) -> Float[np.ndarray, "padded padded K"]:
        return octahedral.bordered(self.irradiance).astype(np.float64)
