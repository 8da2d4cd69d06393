"""Occlusion of an environment light: its bright parts as lobes, each with its own visibility.

One visibility factor for a whole lobe is useless: the occlusion of a sun says nothing about the sky around it. So the
unoccluded light is gathered first, and the occluded part subtracted. On glossy surfaces each bright part has its own
visibility, and the rest has the lobe's. On diffuse surfaces only narrow bright parts have their own, so that shadow
edges between vertices are resolved; the loss of all other light is smooth, so it is computed at vertices, summed over
cells of directions (`lighting.visibility.hidden_light`).
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
    """Bright parts of a rotated environment, and cells of all other light, in world axes.

    parts : n lobes, the narrowest first; `narrow` : the number of narrow ones. lux (n, nodes) : illuminance by a lobe
    of amplitude 1, at cosines from -1 to 1 between surface normal and lobe axis. cells, rest (P, K) : all light
    except the narrow parts', lux on a surface facing the cell; negative where the fit overshoots.
    """

    parts: BrightParts
    narrow: int
    lux: Float[np.ndarray, "n nodes"]
    cells: Cells
    rest: Float[np.ndarray, "P K"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> BrightLight:
        """Fit in the environment's own axes (some tenths of a second), then rotate: the result turns with the light."""
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
        """Return the same light rotated in the world; nothing is fitted again."""
        parts = replace(self.parts, axis=self.parts.axis @ rotation.T)
        return replace(self, parts=parts, cells=replace(self.cells, directions=self.cells.directions @ rotation.T))

    def by_lobes(
        self, directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q n"]:
        """Return the mean of each bright part, at amplitude 1, weighted by Gaussians about unit world directions.

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
        """Return the illuminance, lux, by each bright part at amplitude 1, for unit world normals."""
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
    """Integrate a lobe times the clamped cosine, tabulated by the cosine between normal and axis."""
    # The lobe's own distribution: equal shares of it by 1 - cosine to the axis, which a Gaussian has an inverse for.
    shares = (np.arange(_ACROSS) + 0.5) / _ACROSS
    off = -np.log1p(shares * np.expm1(-2.0 * sharpness)) / sharpness
    across = np.sqrt(np.maximum(off * (2.0 - off), 0.0))
    around = np.cos(2.0 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND)
    cosine = np.linspace(-1.0, 1.0, _COSINES)[:, None, None]
    sine = np.sqrt(1.0 - cosine * cosine)
    seen = np.maximum(cosine * (1.0 - off)[:, None] + sine * across[:, None] * around, 0.0)
    return seen.mean(axis=(1, 2)) * float(_integrals(np.array([sharpness]))[0])
