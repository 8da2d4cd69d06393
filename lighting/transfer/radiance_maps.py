"""Incident radiance maps: small maps of the hemisphere above a site, made from its rays.

Highlights resolve reflections that polynomials cannot represent. A level of a map is the mean radiance under Gaussians
of one sharpness: a mean over rays near each direction, weighted by the solid angle of each, so that uneven density does
not matter. Rays are splatted onto the four nearest texels; coarser levels follow from these by a matrix that is the
same for all sites. Without rays a level falls back to the coarser one, and the coarsest to the polynomials.

A map is half of an octahedron, in the axes of `tangents`: (x + y, x - y) over the direction's L1 norm, from -1 to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array

from ...materials.core.environment_form import bends
from ..environment.pyramid import SOFTENING
from .hits import Hits, ray_directions, tangents
from .ray_light import RayLight

#: Sharpness up to which polynomials suffice; sharpness of the levels, with texels along a side.
BLUNT = 2.0
LEVELS = ((8.0, 8), (32.0, 16), (128.0, 16))
#: Number of texels of a map.
TEXELS = sum(side**2 for _, side in LEVELS)
#: First texel of each level.
FIRST = tuple(sum(side**2 for _, side in LEVELS[:number]) for number in range(len(LEVELS)))
# Lower clamp of the cosine in a ray's solid angle; and the weight of the coarser level in a texel.
_GRAZING, _FEW = 0.1, 0.05
# Rays per block.
_AT_ONCE = 1 << 17


@dataclass(frozen=True, eq=False)
class RadianceMaps:
    """Radiance maps of some of S sites, F fields, lux / sr.

    number (S,) : map of each site, -1 for none. normals (n, 3) : axis of each map.
    values (n, T, F) : half precision, in units of `scale` (F,); levels one after the other.
    """

    number: Int[np.ndarray, " S"]
    normals: Float[np.ndarray, "n 3"]
    values: Float[np.ndarray, "n T F"]
    scale: Float[np.ndarray, " F"]

    @property
    def nbytes(self) -> int:
        """Bytes of the stored maps."""
        return self.number.nbytes + self.normals.nbytes + self.values.nbytes

    @classmethod
    def of(
        cls,
        hits: Hits,
        light: RayLight,
        sites: Int[np.ndarray, " n"],
        polynomials: Float[np.ndarray, "S 9 F"],
    ) -> RadianceMaps:
        """Compute the maps of `sites` from the light that `indirect.arriving` integrates. Blocked sites (`Hits.shut`)
        share the map of a neighbour.
        """
        open_sites = sites[~hits.shut[sites]]
        scale = np.maximum(light.largest, np.finfo(np.float32).tiny)
        values = np.empty((len(open_sites), TEXELS, len(scale)), np.float16)
        step = max(1, _AT_ONCE // hits.rays)
        for start in range(0, len(open_sites), step):
            some = open_sites[start : start + step]
            found = _levels(hits, light, scale, some, polynomials[some] / scale)
            values[start : start + step] = found
        number = np.full(len(hits.sites), -1, np.int32)
        number[open_sites] = np.arange(len(open_sites))
        return cls(_beside(number, hits), hits.sites.normals[open_sites], values, scale)

    def under_lobes(
        self,
        blunt: Float[np.ndarray, "N Q F"],
        sites: Int[np.ndarray, "N 3"],
        shares: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        sharpness: Float[np.ndarray, "N Q"],
        fields: slice,
    ) -> Float[np.ndarray, "N Q F"]:
        """Interpolate the mean radiance under Gaussians between sites; `blunt` is that of the polynomials."""
        found = blunt.copy()
        point, lobe = np.nonzero(sharpness > BLUNT)
        if not len(point):
            return found
        places = [(BLUNT, 0), *LEVELS]
        steps = 1.0 / (np.array([one for one, _ in places]) + SOFTENING)
        wanted = 1.0 / (np.minimum(sharpness[point, lobe], LEVELS[-1][0]) + SOFTENING)
        # Coarser one of the two levels that enclose each 1 / sharpness.
        low = np.clip(np.searchsorted(-steps, -wanted, side="right") - 1, 0, len(LEVELS) - 1)
        mix = ((steps[low] - wanted) / (steps[low] - steps[low + 1]))[:, None]
        told = blunt[point, lobe]
        total = np.zeros_like(told)
        for corner in range(3):
            number, share = self.number[sites[point, corner]], shares[point, corner, None]
            known = number >= 0
            at = hemisphere_places(directions[point, lobe][known], self.normals[number[known]])
            seen = told.copy()
            below = seen[known]
            finer = low[known]
            for level in range(len(LEVELS)):
                mine = np.flatnonzero(finer == level)
                if level:
                    below[mine] = self._at(number[known][mine], at[mine], level - 1, fields)
                above = self._at(number[known][mine], at[mine], level, fields)
                below[mine] += mix[known][mine] * (above - below[mine])
            seen[known] = below
            total += share * seen
        found[point, lobe] = total
        return found

    def _at(
        self, number: Int[np.ndarray, " n"], places: Float[np.ndarray, "n 2"], level: int, fields: slice
    ) -> Float[np.ndarray, "n F"]:
        """Sample a level at places, linear between texels."""
        texels, weights = _about(places, LEVELS[level][1])
        values = self.values[number[:, None], FIRST[level] + texels, fields].astype(np.float64)
        return np.einsum("nt,ntf->nf", weights, values) * self.scale[fields]


def hemisphere_places(to: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
    """Return the places, from -1 to 1, of unit directions above normals; directions below the horizon are clamped to
    it.
    """
    across, along = tangents(normals)
    x, y, z = (np.einsum("ni,ni->n", to, axis) for axis in (across, along, normals))
    length = np.abs(x) + np.abs(y) + np.maximum(z, 0.0)
    # Straight down the nearest point of the horizon is not unique; any will do.
    length = np.where(length > 0.0, length, 1.0)
    return np.stack([(x + y) / length, (x - y) / length], axis=1)


def _about(places: Float[np.ndarray, "n 2"], side: int) -> tuple[Int[np.ndarray, "n 4"], Float[np.ndarray, "n 4"]]:
    """Return the four texels around places, and their bilinear weights, clamped at the rim."""
    at = np.clip(0.5 * (places + 1.0) * side - 0.5, 0.0, side - 1.0)
    corner = np.minimum(np.floor(at).astype(np.int64), side - 2)
    (right, down), (left, top) = (at - corner).T, corner.T
    first = top * side + left
    texels = np.stack([first, first + 1, first + side, first + side + 1], axis=1)
    weights = [(1.0 - right) * (1.0 - down), right * (1.0 - down), (1.0 - right) * down, right * down]
    return texels, np.stack(weights, axis=1)


def _levels(
    hits: Hits,
    brought: RayLight,
    scale: Float[np.ndarray, " F"],
    sites: Int[np.ndarray, " n"],
    polynomials: Float[np.ndarray, "n 9 F"],
) -> Float[np.ndarray, "n T F"]:
    """Compute all levels of some sites."""
    count, fields, (_, finest) = len(sites), len(scale), LEVELS[-1]
    normals = hits.sites.normals[sites]
    to = ray_directions(normals, sites, hits.rays)
    sent = brought.along(hits, sites, to) / (np.pi * scale)
    cosine = np.einsum("nri,ni->nr", to, normals)
    flat = hemisphere_places(to.reshape(-1, 3), np.repeat(normals, hits.rays, axis=0))
    texels, weights = _about(flat, finest)
    texels += (np.repeat(np.arange(count), hits.rays) * finest**2)[:, None]
    # Solid angle per ray over that of a texel; the sum is 1 at the expected density of rays.
    weights *= (finest**2 / (2.0 * hits.rays) / np.maximum(cosine, _GRAZING)).reshape(-1, 1)
    rays, size = len(texels), count * finest**2
    onto = csr_array((weights.ravel(), texels.ravel(), np.arange(0, 4 * rays + 1, 4)), (rays, size)).T
    light = (onto @ sent.reshape(rays, -1)).reshape(count, -1, fields).astype(np.float32)
    whole = onto.sum(axis=1).reshape(count, -1, 1).astype(np.float32)

    found = np.empty((count, TEXELS, fields), np.float32)
    told, before = None, 0
    for level, (sharpness, side) in enumerate(LEVELS):
        matrix = _coarser(sharpness, side)
        lit, known = (light, whole) if matrix is None else (matrix @ light, matrix @ whole)
        if told is None:
            across, along = tangents(normals)
            local = _middles(side)
            ways = np.einsum("ti,nij->ntj", local, np.stack([across, along, normals], axis=1))
            coarser = bends(ways).astype(np.float32) @ polynomials.astype(np.float32)
        else:
            coarser = _stretched(told, before, side)
        told = (lit + _FEW * coarser) / (known + _FEW)
        before = side
        found[:, FIRST[level] : FIRST[level] + side**2] = told
    return found


@cache
def _middles(side: int) -> Float[np.ndarray, "T 3"]:
    """Return unit directions of texel centres, in the axes of a map."""
    middle = (2.0 * np.arange(side) + 1.0) / side - 1.0
    u, v = np.tile(middle, side), np.repeat(middle, side)
    x, y = 0.5 * (u + v), 0.5 * (u - v)
    to = np.stack([x, y, 1.0 - np.abs(x) - np.abs(y)], axis=1)
    return to / np.linalg.norm(to, axis=1, keepdims=True)


@cache
def _coarser(sharpness: float, side: int) -> Float[np.ndarray, "T finest"] | None:
    """Compute the matrix from the finest texels to a level; None for the finest level itself.

    Splatting onto four texels and reading between four each blur with a tent; the Gaussian is narrowed accordingly.
    """
    finest = LEVELS[-1]
    if (sharpness, side) == finest:
        return None
    blurred = sum(2.0 * np.pi / one**2 / 6.0 for one in (finest[1], side))
    narrower = 1.0 / (1.0 / sharpness - blurred)
    found = np.exp(narrower * (_middles(side) @ _middles(finest[1]).T - 1.0))
    # Normalised by the number of texels under such a Gaussian.
    return (found * (narrower / finest[1] ** 2)).astype(np.float32)


def _stretched(values: Float[np.ndarray, "n t F"], side: int, wider: int) -> Float[np.ndarray, "n T F"]:
    """Resample a level to the texels of a finer one."""
    if side == wider:
        return values
    middle = (2.0 * np.arange(wider) + 1.0) / wider - 1.0
    texels, weights = _about(np.column_stack([np.tile(middle, wider), np.repeat(middle, wider)]), side)
    return np.einsum("tk,ntkf->ntf", weights.astype(np.float32), values[:, texels])


def _beside(number: Int[np.ndarray, " S"], hits: Hits) -> Int[np.ndarray, " S"]:
    """Replace the number of blocked sites by that of an open neighbour."""
    found = number.copy()
    for corners in (hits.corners, hits.backs):
        for a in range(3):
            for b in range(3):
                site, other = corners[:, a], corners[:, b]
                some = (site >= 0) & (other >= 0)
                site, other = site[some], other[some]
                lent = hits.shut[site] & (number[site] < 0) & (number[other] >= 0)
                found[site[lent]] = number[other[lent]]
    return found
