"""Light along the rays of sites from other surfaces: diffuse radiosity, and directional reflection of direct light by
glossy parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.fast import Fast
from ..lights import Light
from ..scene import Scene
from .coefficients import Coefficients
from .direct_irradiance import Received, received
from .first_bounce import cell_radiosity, ray_radiosity
from .glossy_rays import GlossyRays
from .hits import Hits
from .precomputation import Precomputation
from .reflection import Reflection

#: Largest number of glossy sites with directional light, up to 40 KB each.
MOST_GLOSSY = 34_000
# Sites per block.
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class GlossyLight:
    """Directional light of G glossy sites into the O cells of their hemispheres, besides their diffuse radiosity, F
    fields.

    cells (G O, F) : pi times radiance, of area and environment lights. at_ends (n, F) : the same of delta lights, along
    each ray that hits a glossy part. frames (S,3,3) : of sites.
    """

    rays: GlossyRays
    frames: Float[np.ndarray, "S 3 3"]
    cells: Float[np.ndarray, "GO F"]
    at_ends: Float[np.ndarray, "n F"]

    def beyond(
        self, hits: Hits, sites: Int[np.ndarray, " n"], to: Float[np.ndarray, "n N 3"]
    ) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, "m F"]]:
        """Return the rays of `sites` that hit glossy parts, as indices among all n N, and pi times the directional
        radiance along each.
        """
        rays, known, size = hits.rays, self.rays, len(self.rays.cells)
        first, last = (np.searchsorted(known.ray, (sites + k) * rays) for k in (0, 1))
        count = last - first
        which = np.repeat(last - np.cumsum(count), count) + np.arange(count.sum())
        place = np.repeat(np.arange(len(sites)) * rays, count) + known.ray[which] % rays
        back, found = -to.reshape(-1, 3)[place], self.at_ends[which]
        for corner in range(3):
            about, share = known.about[which, corner], known.share[which, corner]
            # A corner of weight 0 may be no glossy site.
            row = np.maximum(known.number[about], 0) * size
            column = row + known.cells.of(np.einsum("nij,nj->ni", self.frames[about], back))
            found = found + share[:, None].astype(np.float32) * self.cells[column]
        return place, found

    def irradiance(self, hits: Hits) -> Float[np.ndarray, "S F"]:
        """Compute the irradiance of all sites by this light."""
        found = np.zeros((len(hits.sites), self.cells.shape[1]), np.float32)
        for start in range(0, len(found), _BLOCK):
            sites = np.arange(start, min(start + _BLOCK, len(found)))
            place, values = self.beyond(hits, sites, hits.directions(slice(start, start + _BLOCK)))
            for field in range(found.shape[1]):
                found[sites, field] = np.bincount(place // hits.rays, values[:, field], len(sites)) / hits.rays
        return found


@dataclass(frozen=True, eq=False)
class RayLight:
    """Outgoing light of sites: diffuse `radiosity` (S,F), and directional light unless `glossy` is None."""

    radiosity: Float[np.ndarray, "S F"]
    glossy: GlossyLight | None = None

    @property
    def largest(self) -> Float[np.ndarray, " F"]:
        """Upper bound of the size of each field along any ray."""
        found = np.abs(self.radiosity).max(axis=0, initial=0.0)
        if self.glossy is None:
            return found
        more = (np.abs(one).max(axis=0, initial=0.0) for one in (self.glossy.cells, self.glossy.at_ends))
        return found + sum(more)

    def along(
        self, hits: Hits, sites: Int[np.ndarray, " n"], to: Float[np.ndarray, "n N 3"]
    ) -> Float[np.ndarray, "n N F"]:
        """Compute pi times the radiance along each ray of `sites`; `to` are the rays' unit directions."""
        number, share = hits.about(hits.triangle[sites], hits.place[sites])
        found = np.einsum("nrc,nrcf->nrf", share, self.radiosity[number])
        if self.glossy is not None:
            place, more = self.glossy.beyond(hits, sites, to)
            found.reshape(-1, found.shape[2])[place] += more
        return found


def glossy_parts(prepared: Precomputation, scene: Scene, surfaces: Mapping[str, Fast]) -> dict[int, Reflection]:
    """Return the reflections of all glossy parts by index. scene : whose parts have materials `surfaces`."""
    lobed = [name for name in scene.material_ids if surfaces[name].environment_form().count]
    known = {name: Reflection.of(surfaces[name], prepared.cells, name) for name in lobed}
    worn = {number: known.get(part.material) for number, part in enumerate(scene.parts)}
    return {number: one for number, one in worn.items() if one is not None and not one.is_matt}


def glossy_light(
    prepared: Precomputation,
    originals: Mapping[int, Reflection],
    lights: Sequence[Light],
    spectrum: Sequence[int],
    coefficients: Coefficients,
    lux: Float[np.ndarray, "S K"],
) -> tuple[GlossyLight, Float[np.ndarray, "G F"]]:
    """Compute the directional light of glossy parts under all lights, and the diffuse radiosity of their G sites under
    `lux`.

    originals : see `glossy_parts`; not empty. spectrum : index among K for each spectrum of all lights.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    part, nm = prepared.hits.part_of_site, coefficients.basis.wavelengths_nm
    rays = prepared.glossy_rays(np.isin(np.arange(len(prepared.scene.parts)), list(originals)))
    fitting = {number: one.on(nm) for number, one in originals.items()}
    got = _merged(received(prepared, rays, lights), spectrum, lux)
    cells = np.zeros((len(rays.sites), len(rays.cells), coefficients.fields), np.float32)
    for one in cell_radiosity(rays, originals, fitting, got, coefficients):
        cells[one.part.sites] = (one.values.T @ one.spread).reshape(len(one.part.sites), len(rays.cells), -1)
    at_ends = ray_radiosity(prepared, rays, fitting, got, coefficients)
    matt = np.zeros((len(prepared.scene.parts), len(nm)))
    for number, one in fitting.items():
        matt[number] = one.matt
    terms = (one[part[rays.sites]] for one in coefficients.sent(matt))
    evenly = coefficients.joined([one[:, None] * each for one, each in zip(lux[rays.sites].T, terms, strict=True)])
    return GlossyLight(rays, prepared.frames, cells.reshape(-1, cells.shape[2]), at_ends), evenly


def _merged(got: Received, spectrum: Sequence[int], lux: Float[np.ndarray, "S K"]) -> Received:
    """Sum lights of the same spectrum."""
    incoming = np.zeros((lux.shape[1], *got.incoming.shape[1:]), np.float32)
    for k, place in enumerate(spectrum):
        incoming[place] += got.incoming[k]
    free = tuple((spectrum[k], light, seen) for k, light, seen in got.free)
    return replace(got, lux=lux, incoming=incoming, free=free, _scattered={})
