"""Direct irradiance at sites for relighting: illuminance, and at glossy sites by direction."""

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
    """Direct irradiance by all lights, whose K spectra follow each other.

    lux (S,K) : illuminance. incoming (K, G, I) : illuminance of glossy sites by area and environment lights from each
    cell of their hemispheres, lux. free : for each delta light the index of its spectrum, and a mask of the sites that
    see it.
    """

    lux: Float[np.ndarray, "S K"]
    incoming: Float[np.ndarray, "K G I"]
    free: tuple[tuple[int, DeltaLight, Bool[np.ndarray, " S"]], ...]
    by_part: ByPart
    _scattered: dict[int, tuple[Reflection, np.ndarray]] = field(default_factory=dict, repr=False)

    @cached_property
    def amounts(self) -> Float[np.ndarray, "K n"]:
        """Irradiance of sites by each part if all parts were white, see `ByPart`."""
        return self.by_part.amounts(self.lux)

    def scattered(self, part: GlossyPart, reflection: Reflection) -> Float[np.ndarray, "KR GO"]:
        """Return the radiance of one glossy part's sites into cells by each term, without its spectrum; 0 where no ray
        hits the site. It is cached, since it does not depend on the materials of other parts.
        """
        known = self._scattered.get(part.part)
        if known is None or known[0] is not reflection:
            terms, cells = len(reflection.table), self.incoming.shape[2]
            found = np.zeros((len(self.incoming), terms, len(part.sites), cells), dtype=self.incoming.dtype)
            for arriving, sent in zip(self.incoming, found, strict=True):
                # Only sites that are lit and hit by rays.
                some = part.shines[arriving[part.sites[part.shines]].any(axis=1)]
                lit = arriving[part.sites[some]]
                for table, one in zip(reflection.table, sent, strict=True):
                    one[some] = lit @ table.T
            known = reflection, found.reshape(-1, len(part.sites) * cells)
            self._scattered[part.part] = known
        return known[1]


def received(prepared: Precomputation, rays: GlossyRays, lights: Sequence[Light]) -> Received:
    """Compute direct irradiance: of environments along the stored rays that escape, of area lights by importance
    sampling (`direct`), of delta lights exactly.
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
                # Each ray contributes pi / N times the luminance that it hits.
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
