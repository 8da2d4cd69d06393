"""Direct illuminance at the sites of a scene."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..lights import DeltaLight, Light, SpreadLight
from ..scene import Scene
from ..vectors import dot
from ..visibility.occluders import Occluders
from ..visibility.sites import Sites
from .hits import shifted_pattern

#: Default number of samples of an area or environment light at each site.
DRAWN = 256
# Rays per block.
_AT_ONCE = 1 << 18


def direct_illuminance(
    scene: Scene, sites: Sites, occluders: Occluders, drawn: int = DRAWN
) -> tuple[Float[np.ndarray, "S K"], ...]:
    """Compute the direct illuminance by each light of a scene, lux at each site for each of its K spectra, with
    shadows.

    Delta lights are exact. Area and environment lights are importance sampled in `drawn` directions, from a
    low-discrepancy set shifted at each site.
    """
    low, high = scene.bounds
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    found = []
    for light in scene.lights:
        lux = np.empty((len(sites), len(light.spectra)))
        step = max(1, _AT_ONCE // (1 if isinstance(light, DeltaLight) else drawn))
        for start in range(0, len(sites), step):
            rows = slice(start, min(start + step, len(sites)))
            lux[rows] = _of_light(light, sites, rows, occluders, centre, radius, drawn)
        found.append(lux)
    return tuple(found)


def _of_light(
    light: Light,
    sites: Sites,
    rows: slice,
    occluders: Occluders,
    centre: Float[np.ndarray, "3"],
    radius: float,
    drawn: int,
) -> Float[np.ndarray, "n K"]:
    starts, normals = sites.starts[rows], sites.normals[rows]
    points = starts * radius + centre
    if isinstance(light, DeltaLight):
        arriving = light.arrivals(points)
        cosine = np.maximum(dot(normals, arriving.directions), 0.0)
        free = occluders.free(starts, arriving.directions, arriving.distance / radius)
        return (arriving.illuminance_lux * cosine * free)[:, None]
    assert isinstance(light, SpreadLight)
    return drawn_arrivals(light, sites, rows, occluders, centre, radius, drawn)[1].sum(axis=1)


def drawn_arrivals(
    light: SpreadLight,
    sites: Sites,
    rows: slice,
    occluders: Occluders,
    centre: Float[np.ndarray, "3"],
    radius: float,
    drawn: int = DRAWN,
) -> tuple[Float[np.ndarray, "n D 3"], Float[np.ndarray, "n D K"]]:
    """Sample a light at some sites: unit directions, and the contribution of each to the illuminance, lux."""
    points = np.repeat(sites.starts[rows] * radius + centre, drawn, axis=0)
    normals = np.repeat(sites.normals[rows], drawn, axis=0)
    numbers = np.arange(len(sites))[rows]
    to, density = light.drawn(points, shifted_pattern(numbers, drawn).reshape(-1, 2))
    cosine = dot(normals, to)
    lux = np.zeros((len(to), len(light.spectra)))
    lit = np.flatnonzero((cosine > 0.0) & (density > 0.0))
    distance = light.distance(points[lit], to[lit]) / radius
    lit = lit[occluders.free(np.repeat(sites.starts[rows], drawn, axis=0)[lit], to[lit], distance)]
    lux[lit] = light.luminance(points[lit], to[lit]) * (cosine[lit] / density[lit])[:, None]
    return to.reshape(-1, drawn, 3), lux.reshape(-1, drawn, lux.shape[1]) / drawn
