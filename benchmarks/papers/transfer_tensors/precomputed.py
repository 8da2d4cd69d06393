"""Precomputed transfer of a scene: tensors from light and reflectance to the light that arrives, by bounces.

Sun et al. 2007 (section 3.1): T0(w), what of the light from w a site sees; T1(l, r, p, s), what arrives in harmonic s
of light l by way of region r and component p of its reflectance; and T2(l, r1, p1, r2, p2), by way of two, evenly from
everywhere. Rays are those of `transfer.hits`. Here, what arrives is multiplied by the cosine at the receiver before it
is projected onto harmonics, so that it goes to 0 at the horizon, and so does the noise of the rays there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8

from ....lighting.environment.cube import CubeMap
from ....lighting.transfer.hits import Hits, tangents
from ....lighting.vectors import unit
from ....lighting.visibility.occluders import Occluders
from ....runtime.memory import check_room, gigabytes
from ..harmonics import harmonics
from .components import Components

#: Texels across a face: of visibility; of the lights of one bounce and of two; and the harmonics of one bounce.
VISIBLE, ONE_BOUNCE, TWO_BOUNCES, BANDS = 64, 8, 2, 4
# Rays of visibility at once.
_AT_ONCE = 1 << 19


@dataclass(frozen=True, eq=False)
class TransferTensors:
    """Transfer tensors of S sites, R regions and P components, the first of which is matt, f_r = 1 / pi.

    visible (S,bytes) : T0, a bit a texel of `VISIBLE`. one (S,R,P,L,B) : T1, of light of 1 cd/m^2 from each texel of
    `ONE_BOUNCE`. two (S,R,P,R,P,M) : T2, first region of the path first, of each texel of `TWO_BOUNCES`: mean luminance
    by the cosine. region (S,) : of each site.
    """

    sites: Float[np.ndarray, "S 3"]
    normals: Float[np.ndarray, "S 3"]
    region: Int[np.ndarray, " S"]
    visible: UInt8[np.ndarray, "S bytes"]
    across: int
    one: Float[np.ndarray, "S R P L B"]
    two: Float[np.ndarray, "S R P R P M"]

    @property
    def nbytes(self) -> int:
        """Bytes of the tensors as they are."""
        return self.visible.nbytes + self.one.nbytes + self.two.nbytes


def transfer_tensors(
    hits: Hits,
    region_of_part: Int[np.ndarray, " parts"],
    components: Components,
    occluders: Occluders,
    across: int = VISIBLE,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> TransferTensors:
    """Return the tensors of a scene; one set of components serves all regions.

    across : texels of visibility, a multiple of `ONE_BOUNCE`.

    Raises
    ------
    InputError : they would not fit into memory.
    """
    regions, count = int(region_of_part.max()) + 1, len(hits.sites)
    parts, size = components.table.shape[3] + 1, len(CubeMap(ONE_BOUNCE))
    needed = bytes_of_site(regions, components) * count
    words = f"{count:,} sites, {regions} regions, {parts} components: {gigabytes(needed)} of memory"
    check_room(needed, "transfer tensors do not fit into memory", words, "ask for fewer regions")
    visible = _visible(hits, occluders, across, progress)
    region = region_of_part[hits.part_of_site]
    one = np.zeros((count, regions, parts, size, BANDS**2), dtype=np.float32)
    bounce = _Bounce(hits, region_of_part, components, visible, across)
    for site in range(count):
        one[site] = bounce.once(site, regions)
        progress(site + 1, count, "one bounce")
    two = np.zeros((count, regions, parts, regions, parts, len(CubeMap(TWO_BOUNCES))), dtype=np.float32)
    coarse = CubeMap(ONE_BOUNCE).coarser(TWO_BOUNCES)
    first = np.zeros((count, regions, parts, two.shape[-1], BANDS**2), dtype=np.float32)
    for texel in range(size):
        first[:, :, :, coarse[texel]] += one[:, :, :, texel]
    for site in range(count):
        two[site] = bounce.twice(site, first)
        progress(site + 1, count, "two bounces")
    return TransferTensors(hits.sites.starts, hits.sites.normals, region, visible, across, one, two)


def bytes_of_site(regions: int, components: Components) -> int:
    """Count the bytes of one site's tensors."""
    parts, size = components.table.shape[3] + 1, len(CubeMap(ONE_BOUNCE))
    return 4 * regions * parts * (size * BANDS**2 + regions * parts * len(CubeMap(TWO_BOUNCES)))


def unpack_visibility(visible: UInt8[np.ndarray, "n bytes"], across: int) -> Float[np.ndarray, "n D"]:
    """1 where a site sees the light of a texel, else 0; float32."""
    return np.unpackbits(visible, axis=1, count=len(CubeMap(across))).astype(np.float32)


def _visible(
    hits: Hits, occluders: Occluders, across: int, progress: Callable[[int, int, str], None]
) -> UInt8[np.ndarray, "S bytes"]:
    to = CubeMap(across).directions
    step = max(1, _AT_ONCE // len(to))
    found = []
    for start in range(0, len(hits.sites), step):
        rows = slice(start, start + step)
        above = hits.sites.normals[rows] @ to.T > 0.0
        site, texel = np.nonzero(above)
        above[site, texel] = occluders.free(hits.sites.starts[rows][site], to[texel])
        found.append(np.packbits(above, axis=1))
        progress(min(start + step, len(hits.sites)), len(hits.sites), "visibility")
    return np.concatenate(found)


class _Bounce:
    """Light that comes to a site by way of what its rays end on."""

    def __init__(
        self,
        hits: Hits,
        region_of_part: Int[np.ndarray, " parts"],
        components: Components,
        visible: UInt8[np.ndarray, "S bytes"],
        across: int,
    ) -> None:
        self.hits, self.components = hits, components
        self.region_of_face = region_of_part[hits.part]
        fine, coarse = CubeMap(across), CubeMap(ONE_BOUNCE)
        # A texel of a bounce's light is seen as far as those of it are that visibility has.
        within, angle = fine.coarser(ONE_BOUNCE), fine.solid_angles
        self.share = np.empty((len(visible), len(coarse)), dtype=np.float32)
        for start in range(0, len(visible), 256):
            seen = unpack_visibility(visible[start : start + 256], across) * angle
            sums = np.zeros((len(coarse), len(seen)))
            np.add.at(sums, within, seen.T)
            self.share[start : start + 256] = (sums / coarse.solid_angles[:, None]).T
        self.to, self.angle = coarse.directions, coarse.solid_angles
        self.harmonics = harmonics(self.to, BANDS)

    def once(self, site: int, regions: int) -> Float[np.ndarray, "R P L B"]:
        """T1 of a site."""
        ends = _Ends(self, site)
        out = np.zeros((regions, self.components.table.shape[3] + 1, len(self.to), BANDS**2), dtype=np.float32)
        if not len(ends.region):
            return out
        # (hits, P, L) reflected towards the site of light from each texel.
        reflected = ends.reflected() * (ends.seen() * self.angle)[:, :, None]
        arriving = ends.harmonics
        for region in np.unique(ends.region):
            mine = ends.region == region
            out[region] = np.einsum("hlp,hs->pls", reflected[mine], arriving[mine], optimize=True)
        return out

    def twice(self, site: int, first: Float[np.ndarray, "S R P M B"]) -> Float[np.ndarray, "R P R P M"]:
        """T2 of a site, from what arrives at the ends of its rays after one bounce."""
        _, regions, parts, lights, _ = first.shape
        out = np.zeros((regions, parts, regions, parts, lights), dtype=np.float32)
        ends = _Ends(self, site)
        if not len(ends.region):
            return out
        # (hits, P, B): a harmonic that arrives, by the cosine already, and how much of it is reflected to the site.
        passed = np.einsum(
            "hlp,ls->hps", ends.reflected(cosine=False), self.harmonics * self.angle[:, None], optimize=True
        )
        passed /= self.hits.rays
        for region in np.unique(ends.region):
            mine = ends.region == region
            shared = passed[mine][:, None] * ends.shares[mine][:, :, None, None]
            number, place = np.unique(ends.corners[mine].ravel(), return_inverse=True)
            summed = np.zeros((len(number), *shared.shape[2:]))
            np.add.at(summed, place.ravel(), shared.reshape(-1, *shared.shape[2:]))
            out[:, :, region] = np.einsum("nps,nrqms->rqpm", summed, first[number], optimize=True)
        return out


class _Ends:
    """Ends of the rays of one site, on fronts and backs that are lit."""

    def __init__(self, bounce: _Bounce, site: int) -> None:
        hits = bounce.hits
        corners, shares = (each[0] for each in hits.ends(slice(site, site + 1)))
        lit = np.flatnonzero(shares.sum(axis=1) > 0.0)
        self._bounce = bounce
        self.corners, self.shares = corners[lit], shares[lit]
        to = hits.directions(slice(site, site + 1))[0][lit]
        self.normals = unit(np.sum(hits.sites.normals[self.corners] * self.shares[..., None], axis=1))
        self.back = -to
        self.region = bounce.region_of_face[hits.triangle[site][lit] % len(hits.corners)]
        # Rays are as dense as the cosine over pi: each stands for pi / N of cosine-weighted solid angle.
        self.harmonics = harmonics(to, BANDS) * (np.pi / hits.rays)

    def seen(self) -> Float[np.ndarray, "h L"]:
        """Interpolate the light of each texel at the ends, between the sites about them."""
        return np.einsum("hc,hcl->hl", self.shares, self._bounce.share[self.corners])

    def reflected(self, cosine: bool = True) -> Float[np.ndarray, "h L P"]:
        """f_r towards the site of light from each texel, times the cosine at the end; 0 below its horizon."""
        bounce = self._bounce
        falls = self.normals @ bounce.to.T
        leaves = np.sum(self.normals * self.back, axis=1)
        found = np.zeros((*falls.shape, bounce.components.table.shape[3] + 1), dtype=np.float32)
        row, texel = np.nonzero((falls > 0.0) & (leaves > 0.0)[:, None])
        wi, wo = _local(bounce.to[texel], falls[row, texel], self.back[row], leaves[row])
        found[row, texel, 0] = 1.0 / np.pi
        found[row, texel, 1:] = bounce.components.values(wi, wo)
        return found * np.maximum(falls, 0.0)[..., None] if cosine else found


def _local(
    to: Float[np.ndarray, "n 3"],
    falls: Float[np.ndarray, " n"],
    back: Float[np.ndarray, "n 3"],
    leaves: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Two directions in a frame of which isotropic surfaces need the normal alone: the view lies over x."""
    sine = np.sqrt(np.maximum(1.0 - leaves * leaves, 0.0))
    between = np.sum(to * back, axis=1)
    # The part of the light along the view's tangent; where the view is the normal, any tangent is as good.
    along = np.divide(between - falls * leaves, sine, out=np.zeros_like(sine), where=sine > 0.0)
    across = np.sqrt(np.maximum(1.0 - falls * falls - along * along, 0.0))
    return np.stack([along, across, falls], axis=1), np.stack([sine, np.zeros_like(sine), leaves], axis=1)


def local(to: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Directions in frames about their own normals."""
    across, along = tangents(normals)
    return np.stack([np.sum(to * axis, axis=1) for axis in (across, along, normals)], axis=1)


def outward(to: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Directions of frames in the world."""
    across, along = tangents(normals)
    return to[:, :1] * across + to[:, 1:2] * along + to[:, 2:] * normals
