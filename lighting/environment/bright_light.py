"""An environment where something stands in its way: its bright parts as lobes that are hidden each for itself.

One share of light for a whole lobe is as bad as none: what is hidden of a sun says nothing of the sky about it. So what
lobes and surfaces gather stays what it is where all is free, and of it is taken what is hidden. For glossy surfaces: of
each bright part by itself, and of the rest by the lobe's own share. For matt ones only the narrow among the bright
parts are hidden each for itself, wherever a shadow's edge runs between vertices; what all other light gives is smooth,
so that it is enough to know what vertices lose of it, by cells of directions (`lighting.visibility.hidden_light`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from . import latlong
from .brights import BrightParts, taken_apart
from .cells import Cells, cells_of
from .environment import EnvironmentLight

# Bright parts, of the brightest tenth of the sphere: with 8 of 3 % matt shadows under a sky are off by twice as much,
# and with 32 of 30 % by hardly less.
_COUNT, _SHARE = 16, 0.1
# Parts of this sharpness, of a standard deviation of 3.3 degrees, and beyond are narrow.
_NARROW = 300.0
# Cells that all other light is divided into: twice as many change nothing that can be seen.
_CELLS = 512
# Nodes of what a bright part sends onto a surface, by the cosine to its axis; and those of the integral over it.
_COSINES, _ACROSS, _AROUND = 257, 24, 24


@dataclass(frozen=True, eq=False)
class BrightLight:
    """The bright parts of an environment as it is turned, world, and cells of all other light.

    parts : n lobes, the narrowest first; `narrow` : how many of them are narrow. lux (n, nodes) : what a lobe of
    amplitude 1 sends onto surfaces whose normals lie at cosines from -1 to 1 to its axis. cells, rest (P, K) : all
    light but the narrow parts', lux on a surface that faces the cell; where a fit took too much it is negative.
    """

    parts: BrightParts
    narrow: int
    lux: Float[np.ndarray, "n nodes"]
    cells: Cells
    rest: Float[np.ndarray, "P K"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> BrightLight:
        """Found in the environment's own axes, some tenths of a second, then turned as it is: a rotation moves nothing
        in relation to the light.
        """
        turned, environment = environment.world_from_map, replace(environment, rotation_deg=0.0)
        found, _ = taken_apart(environment, _COUNT, _SHARE)
        order = np.argsort(-found.sharpness, kind="stable")
        parts = BrightParts(found.axis[order], found.sharpness[order], found.amplitude[order])
        narrow = int((parts.sharpness >= _NARROW).sum())
        cells = cells_of(environment, _CELLS)
        height, width = environment.fields.shape[1:]
        to = latlong.texel_directions(height, width).reshape(-1, 3)
        angles = np.repeat(latlong.solid_angles(height, width), width)[:, None]
        apart = np.maximum(1.0 - to @ parts.axis[:narrow].T, 0.0)
        there = (
            cells.sums(np.exp(-parts.sharpness[:narrow] * apart) * angles)
            if narrow
            else np.zeros((len(cells.directions), 0))
        )
        # A lobe that is hardly wider than a texel is not its sum over texels.
        there *= _integrals(parts.sharpness[:narrow]) / there.sum(axis=0)
        rest = cells.sums(environment.fields.reshape(len(environment.fields), -1).T * angles)
        lux = np.array([_on_surfaces(one) for one in parts.sharpness]).reshape(-1, _COSINES)
        return cls(parts, narrow, lux, cells, rest - there @ parts.amplitude[:narrow]).turned(turned)

    def turned(self, rotation: Float[np.ndarray, "3 3"]) -> BrightLight:
        """Return the same light turned by a rotation of the world: nothing is found anew."""
        parts = replace(self.parts, axis=self.parts.axis @ rotation.T)
        return replace(self, parts=parts, cells=replace(self.cells, directions=self.cells.directions @ rotation.T))

    def by_lobes(
        self, directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q n"]:
        """Return the mean of each bright part, of amplitude 1, under Gaussians about unit directions of the world.

        Wang et al. 2009, eq. 4, over the Gaussian's integral, with the exponent written so that it does not overflow.
        """
        other = self.parts.sharpness
        cosine = directions @ self.parts.axis.T
        both = sharpness[..., None] + other
        product = sharpness[..., None] * other * (1.0 - cosine)
        length = np.sqrt(np.maximum(both * both - 2.0 * product, 1e-300))
        inner = -2.0 * np.pi * np.expm1(-2.0 * length) / length * np.exp(-2.0 * product / (length + both))
        return inner / _integrals(sharpness)[..., None]

    def on_surfaces(self, normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N n"]:
        """Lux that each bright part of amplitude 1 gives surfaces of unit normals, world."""
        axis, lux = self.parts.axis, self.lux
        place = (np.clip(normals @ axis.T, -1.0, 1.0) + 1.0) * (0.5 * (_COSINES - 1))
        below = np.minimum(place.astype(np.int64), _COSINES - 2)
        share = place - below
        which = np.arange(len(lux))
        return lux[which, below] * (1.0 - share) + lux[which, below + 1] * share


def _integrals(sharpness: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Integrate exp(lambda (v . p - 1)) over the sphere, sr."""
    return -2.0 * np.pi * np.expm1(-2.0 * sharpness) / sharpness


def _on_surfaces(sharpness: float) -> Float[np.ndarray, " nodes"]:
    """Return the integral of a lobe times the clamped cosine, by the cosine between normal and axis."""
    # The lobe's own distribution: equal shares of it by 1 - cosine to the axis, which a Gaussian has an inverse for.
    shares = (np.arange(_ACROSS) + 0.5) / _ACROSS
    off = -np.log1p(shares * np.expm1(-2.0 * sharpness)) / sharpness
    across = np.sqrt(np.maximum(off * (2.0 - off), 0.0))
    around = np.cos(2.0 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND)
    cosine = np.linspace(-1.0, 1.0, _COSINES)[:, None, None]
    sine = np.sqrt(1.0 - cosine * cosine)
    seen = np.maximum(cosine * (1.0 - off)[:, None] + sine * across[:, None] * around, 0.0)
    return seen.mean(axis=(1, 2)) * float(_integrals(np.array([sharpness]))[0])
