"""Sample points of a reference: scrambled Sobol points, with directions and luminance for environment lights."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, UInt32

from ..environment import latlong
from ..environment.environment import EnvironmentLight
from ..lights import SpreadLight

# Points per direction of a pixel, and least number of points: pixels have different offsets.
_TIMES, _LEAST = 4, 1 << 14


# Even environments: largest ratio of a texel to the mean, and least irradiance of a side relative to the brightest
# side, so that sampling the whole suffices for any surface; and least number of texels, since directions are sampled by
# texels.
_BRIGHTEST, _DARKEST, _FINE = 16.0, 0.02, 1 << 14


@dataclass(frozen=True, eq=False)
class DrawnDirections:
    """S scrambled points, a power of two, and for environment lights the directions sampled with them.

    uniform (S, 5) : in [0, 1): two for a direction from the light, two for one from the surface, one for a sample.
    towards (S, 3), density (S,), luminance (S, K) : see `SpreadLight.drawn` and `SpreadLight.luminance`.
    """

    uniform: Float[np.ndarray, "S 5"]
    towards: Float[np.ndarray, "S 3"] | None = None
    density: Float[np.ndarray, " S"] | None = None
    luminance: Float[np.ndarray, "S K"] | None = None


def drawn_pool(light: SpreadLight, most: int, rng: np.random.Generator) -> DrawnDirections:
    """Return points for up to `most` directions per pixel."""
    points = _sobol(max(_TIMES * most, _LEAST))
    scrambling = rng.integers(0, 2**32, 5, dtype=np.uint32)
    uniform = ((points ^ scrambling) + 0.5) * 2.0**-32
    if not isinstance(light, EnvironmentLight):
        return DrawnDirections(uniform)
    nowhere = np.zeros((len(uniform), 3))
    towards, density = light.drawn(nowhere, np.ascontiguousarray(uniform[:, :2]))
    return DrawnDirections(uniform, towards, density, light.luminance(nowhere, towards))


def is_even(light: SpreadLight) -> bool:
    """Return whether sampling a light alone suffices for diffuse surfaces of any orientation."""
    if not isinstance(light, EnvironmentLight) or light.fields[0].size < _FINE:
        return False
    luminance = light.fields.sum(axis=0)
    sends = luminance * latlong.solid_angles(*luminance.shape)[:, None]
    if luminance.max() * 4.0 * np.pi > _BRIGHTEST * sends.sum():
        return False
    to = latlong.texel_directions(*luminance.shape)
    sides = [(sends * np.maximum(sign * to[..., axis], 0.0)).sum() for axis in range(3) for sign in (-1.0, 1.0)]
    return bool(min(sides) >= _DARKEST * max(sides) > 0.0)


@lru_cache(maxsize=2)
def _sobol(count: int) -> UInt32[np.ndarray, "n 5"]:
    """Return at least `count` points of Sobol's sequence as 32-bit integers, a power of two."""
    from scipy.stats import qmc

    points = qmc.Sobol(5, scramble=False, bits=32).random_base2(max(count - 1, 1).bit_length())
    found = (points * 2.0**32).astype(np.uint32)
    found.flags.writeable = False
    return found
