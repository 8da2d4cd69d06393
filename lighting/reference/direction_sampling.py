"""The directions that a reference draws from: Sobol's points, scrambled, and what a far light gives for each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, UInt32

from ..environment import latlong
from ..environment.environment import EnvironmentLight
from ..lights import SpreadLight

# Points for each direction that a pixel may be asked for, and points at the least: pixels begin at different ones.
_TIMES, _LEAST = 4, 1 << 14


# Even environments: largest ratio of a texel to the mean, and least share that a side gives of what the brightest side
# gives, so that draws from the whole find what any surface sees; and fewest texels, since directions are drawn texel by
# texel, and few would each be drawn from unevenly.
_BRIGHTEST, _DARKEST, _FINE = 16.0, 0.02, 1 << 14


@dataclass(frozen=True, eq=False)
class DrawnDirections:
    """S scrambled points, a power of two, and where the light is the same for all places, its directions for them.

    uniform (S, 5) : in [0, 1): two for a direction of the light, two for one of a surface, one for a sample.
    towards (S, 3), density (S,), luminance (S, K) : as `SpreadLight.drawn` and `SpreadLight.luminance` have them.
    """

    uniform: Float[np.ndarray, "S 5"]
    towards: Float[np.ndarray, "S 3"] | None = None
    density: Float[np.ndarray, " S"] | None = None
    luminance: Float[np.ndarray, "S K"] | None = None


def drawn_pool(light: SpreadLight, most: int, rng: np.random.Generator) -> DrawnDirections:
    """Enough for `most` directions a pixel."""
    points = _sobol(max(_TIMES * most, _LEAST))
    scrambling = rng.integers(0, 2**32, 5, dtype=np.uint32)
    uniform = ((points ^ scrambling) + 0.5) * 2.0**-32
    if not isinstance(light, EnvironmentLight):
        return DrawnDirections(uniform)
    nowhere = np.zeros((len(uniform), 3))
    towards, density = light.drawn(nowhere, np.ascontiguousarray(uniform[:, :2]))
    return DrawnDirections(uniform, towards, density, light.luminance(nowhere, towards))


def is_even(light: SpreadLight) -> bool:
    """Return whether directions that are drawn as a light shines serve a matt surface alone, however it is turned."""
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
    """At least so many points of Sobol's sequence, as whole numbers of 32 bits; a power of two."""
    from scipy.stats import qmc

    points = qmc.Sobol(5, scramble=False, bits=32).random_base2(max(count - 1, 1).bit_length())
    found = (points * 2.0**32).astype(np.uint32)
    found.flags.writeable = False
    return found
