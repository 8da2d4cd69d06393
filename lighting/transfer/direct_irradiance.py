"""Direct irradiance at sites for relighting: as illuminance, and by direction at glossy ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from ..environment.environment import EnvironmentLight
from ..lights import DeltaLight, Light, SpreadLight
from ..vectors import dot
from .direct import drawn_arrivals
from .glossy_part import GlossyPart
from .glossy_rays import GlossyRays
from .operator import ByPart
from .precomputation import Precomputation
from .reflection import Reflection

# Sites per block, for lights at a finite distance.
_BLOCK = 1024


@dataclass(frozen=True, eq=False)
class Received:
    """Direct irradiance of K spectra of all lights, one after the other.

    lux (S,K) : illuminance. incoming (K, G, I) : of lights that spread, what glossy sites receive from each cell of
    their hemispheres, lux. free : of each light from one direction its first spectrum's number, and which sites see it.
    """

    lux: Float[np.ndarray, "S K"]
    incoming: Float[np.ndarray, "K G I"]
    free: tuple[tuple[int, DeltaLight, Bool[np.ndarray, " S"]], ...]
    by_part: ByPart
    _scattered: dict[int, tuple[Reflection, np.ndarray]] = field(default_factory=dict, repr=False)

    @cached_property
    def amounts(self) -> Float[np.ndarray, "K n"]:
        """Compute the light that white parts would send to sites of it, see `ByPart`."""
        return self.by_part.amounts(self.lux)

    def scattered(self, part: GlossyPart, reflection: Reflection) -> Float[np.ndarray, "KR GO"]:
        """Return the radiance that the sites of one glossy part send into cells by each term, without its spectrum; 0
        where no ray looks at the site. Kept, since other materials elsewhere leave it as it is.
        """
        known = self._scattered.get(part.part)
        if known is None or known[0] is not reflection:
            terms, cells = len(reflection.table), self.incoming.shape[2]
            found = np.zeros((len(self.incoming), terms, len(part.sites), cells), dtype=self.incoming.dtype)
            for arriving, sent in zip(self.incoming, found, strict=True):
                # Only a product of those that are lit and looked at.
                some = part.shines[arriving[part.sites[part.shines]].any(axis=1)]
                lit = arriving[part.sites[some]]
                for table, one in zip(reflection.table, sent, strict=True):
                    one[some] = lit @ table.T
            known = reflection, found.reshape(-1, len(part.sites) * cells)
            self._scattered[part.part] = known
        return known[1]


def received(prepared: Precomputation, rays: GlossyRays, lights: Sequence[Light]) -> Received:
    """Light from infinitely far off is taken along the rays that are kept, wherever they see the sky; of near lights
    that spread, directions are drawn (`direct`); what comes from one direction is exact.
    """
    sites, spectra = prepared.hits.sites, sum(len(light.spectra) for light in lights)
    lux = np.zeros((len(sites), spectra), dtype=np.float32)
    incoming = np.zeros((spectra, len(rays.sites), len(rays.cells)), dtype=np.float32)
    free, first = [], 0
    for light in lights:
        mine = slice(first, first + len(light.spectra))
        if isinstance(light, DeltaLight):
            seen, lux[:, first] = _of_delta(prepared, light)
            free.append((first, light, seen))
        elif isinstance(light, EnvironmentLight):
            sky = prepared.sky.means(light, min(256, light.fields.shape[1])).astype(np.float32)
            cells = rays.sky_in_cells
            for k, one in enumerate(sky, first):
                lux[:, k] = prepared.sky_operator @ one
                # Each ray brings pi / N times the luminance that it meets.
                incoming[k] = (cells @ one[: cells.shape[1]]).reshape(incoming[k].shape)
        else:
            assert isinstance(light, SpreadLight)
            lux[:, mine], incoming[mine] = _of_near(prepared, rays, light)
        first = mine.stop
    return Received(lux, incoming, tuple(free), prepared.by_part)


def _of_delta(prepared: Precomputation, light: DeltaLight) -> tuple[Bool[np.ndarray, " S"], Float[np.ndarray, " S"]]:
    sites = prepared.hits.sites
    centre, radius = prepared.centre_and_radius
    arriving = light.arrivals(sites.starts * radius + centre)
    cosine = dot(sites.normals, arriving.directions)
    free = np.zeros(len(sites), dtype=bool)
    up = np.flatnonzero(cosine > 0.0)
    free[up] = prepared.occluders.free(sites.starts[up], arriving.directions[up], arriving.distance[up] / radius)
    return free, arriving.illuminance_lux * cosine * free


def _of_near(prepared: Precomputation, rays: GlossyRays, light: SpreadLight) -> tuple[np.ndarray, np.ndarray]:
    sites, spectra = prepared.hits.sites, len(light.spectra)
    lux = np.zeros((len(sites), spectra))
    incoming = np.zeros((spectra, len(rays.sites) * len(rays.cells)))
    for start in range(0, len(sites), _BLOCK):
        rows = slice(start, min(start + _BLOCK, len(sites)))
        to, brings = drawn_arrivals(light, sites, rows, prepared.occluders, *prepared.centre_and_radius)
        lux[rows] = brings.sum(axis=1)
        own = np.flatnonzero(rays.number[rows] >= 0)
        local = np.einsum("nij,ndj->ndi", prepared.frames[rows][own], to[own])
        place = rays.number[rows][own, None] * len(rays.cells) + rays.cells.of(local)
        for k in range(spectra):
            incoming[k] += np.bincount(place.ravel(), brings[own, :, k].ravel(), incoming.shape[1])
    return lux, incoming.reshape(spectra, len(rays.sites), len(rays.cells))
