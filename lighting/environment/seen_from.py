"""A light that spreads, as it is seen from one place: what renderers take it for."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ..lights import SpreadLight
from . import latlong
from .environment import EnvironmentLight

# Texels of the map of a light that is near, and places across each at which it is looked at.
_HEIGHT, _ACROSS = 256, 4


def seen_from(light: SpreadLight, place: Float[np.ndarray, "3"]) -> EnvironmentLight:
    """The environment that `light` is at `place`, world; an environment is itself.

    What is near is seen alike from everywhere then: the reference, which traces it as it is, shows what that costs.
    """
    if isinstance(light, EnvironmentLight):
        return light
    return _seen(light, tuple(place.tolist()))


@lru_cache(maxsize=8)
def _seen(light: SpreadLight, place: tuple[float, float, float]) -> EnvironmentLight:
    fields = np.zeros((len(light.spectra), _HEIGHT, 2 * _HEIGHT))
    for row in range(_HEIGHT):
        rows = (row + (np.arange(_ACROSS) + 0.5) / _ACROSS) / _HEIGHT
        columns = (np.arange(2 * _HEIGHT * _ACROSS) + 0.5) / (2 * _HEIGHT * _ACROSS)
        to = latlong.directions(rows[:, None], columns[None]).reshape(-1, 3)
        found = light.luminance(np.broadcast_to(np.array(place), to.shape), to)
        fields[:, row] = found.T.reshape(len(fields), _ACROSS, -1, _ACROSS).mean(axis=(1, 3))
    return EnvironmentLight(fields, light.spectra, None, 0.0, light.name, light.spectrum_name)
