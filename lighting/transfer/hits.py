"""Hit points of rays from a scene's sites: the geometry needed for interreflection.

Sun et al. 2007 (section 3.1) store the light incident at a vertex as tensors over light, regions and reflectances. Here
the rays themselves are stored: N cosine-distributed rays from each site, with the triangle hit and the barycentric
weights there. Materials, lights and cameras are not included, so that all of them may change.

Ray directions are not stored. All sites share a low-discrepancy pattern in the unit square (the R2 sequence of M.
Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018), with a toroidal shift for each (Cranley and
Patterson 1976) that decorrelates the errors of neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int, UInt16

from ...runtime.memory import check_room, gigabytes
from ..mesh.ray_index import ray_index
from ..vectors import dot
from ..visibility.sites import Corners, Sites

#: Rays per site. The error in ΔE94 falls with about their number to the power of -0.7.
RAYS = 256
#: Bytes stored per ray.
BYTES_A_RAY = 8
# Peak bytes per ray of a block, and rays per block.
_BYTES_TRACED, _AT_ONCE = 200, 1 << 18
# The R2 sequence: powers of the inverse of the plastic number, the real root of x^3 = x + 1.
_PLASTIC = 1.32471795724474602596
_STEPS = np.array([1.0 / _PLASTIC, 1.0 / _PLASTIC**2])
# Steps of the sites' shifts: a sequence of the same kind, by the fractions of the golden and the silver ratio.
_SHIFTS = np.array([0.61803398874989484820, 0.41421356237309504880])
# Length of rays in contact, in radii of the scene, and their share at a blocked site; number of rays that suffices to
# find most sites open; and the least weight of open sites around a point for interpolating from these alone.
_AT_ONCE_FAR, _NEARLY_ALL, _TELL, _LEAST = 0.003, 0.9, 32, 0.05
# Largest value of quantised barycentric weights, 16 bits.
_WHOLE = 65535


@dataclass(frozen=True, eq=False)
class Hits:
    """Hit points of N rays from each of S sites.

    sites : ray origins.
    corners (F, 3) : site of each triangle's corners on the front; backs (F, 3) : on the back, -1 where that is dark
        (the inside of a solid).
    triangle (S, N) : hit by each ray; F + its index for a hit on the back; -1 for none.
    place (S, N, 2) : barycentric weights of the triangle's second and third corner, times 65535.
    part (F,) : part of each triangle.
    areas (S,) : of each site, a third of each adjacent triangle, in a scene of radius 1.
    """

    sites: Sites
    corners: Int[np.ndarray, "F 3"]
    backs: Int[np.ndarray, "F 3"]
    triangle: Int[np.ndarray, "S N"]
    place: UInt16[np.ndarray, "S N 2"]
    part: Int[np.ndarray, " F"]
    areas: Float[np.ndarray, " S"]

    @cached_property
    def part_of_site(self) -> Int[np.ndarray, " S"]:
        """Part of each site."""
        found = np.zeros(len(self.sites), dtype=np.int64)
        for corners in (self.backs, self.corners):
            there = corners >= 0
            found[corners[there]] = np.broadcast_to(self.part[:, None], corners.shape)[there]
        found.flags.writeable = False
        return found

    @property
    def rays(self) -> int:
        """Number of rays per site, N."""
        return self.triangle.shape[1]

    @property
    def nbytes(self) -> int:
        """Bytes of the stored rays."""
        return self.triangle.nbytes + self.place.nbytes

    def directions(self, rows: slice = slice(None)) -> Float[np.ndarray, "n N 3"]:
        """Return the unit directions of the rays of some sites, world."""
        numbers = np.arange(len(self.sites))[rows]
        return ray_directions(self.sites.normals[rows], numbers, self.rays)

    def ends(self, rows: slice = slice(None)) -> tuple[Int[np.ndarray, "n N 3"], Float[np.ndarray, "n N 3"]]:
        """Return the three sites around each ray's hit point, for some sites, and their weights: 0 without a hit.

        A dark corner has index 0 and weight 0, so that the weights sum to less than 1.
        """
        return self.about(self.triangle[rows], self.place[rows])

    def about(
        self, triangle: Int[np.ndarray, "n N"], place: UInt16[np.ndarray, "n N 2"]
    ) -> tuple[Int[np.ndarray, "n N 3"], Float[np.ndarray, "n N 3"]]:
        """Return `ends` for other rays in this scene.

        A point that a ray hits is not blocked: next to another part in contact, corners covered by that part have no
        weight.
        """
        found, shares = self._about(triangle, place)
        return found, self.open_shares(found, shares)

    def open_shares(
        self, sites: Int[np.ndarray, "*n 3"], shares: Float[np.ndarray, "*n 3"]
    ) -> Float[np.ndarray, "*n 3"]:
        """Return the weights of sites around visible points: those of `shut` sites are distributed to the others."""
        kept = np.where(self.shut[sites], 0.0, shares)
        # `sum` along such a short axis takes five times as long.
        whole, left = ((one[..., 0] + one[..., 1] + one[..., 2])[..., None] for one in (shares, kept))
        # Weights are kept if almost none is of open sites.
        return np.where(
            left > _LEAST * whole, kept * np.divide(whole, left, out=np.ones_like(left), where=left > 0.0), shares
        )

    @cached_property
    def shut(self) -> Bool[np.ndarray, " S"]:
        """Mask of blocked sites, inside of solids or covered by another part: nearly all of their rays hit the dark
        side of a solid, or anything in contact.
        """
        found = np.zeros(len(self.sites), dtype=bool)
        some = np.arange(len(found))
        for rays in (min(_TELL, self.rays), self.rays):
            blocks = [
                some[start : start + max(1, _AT_ONCE // rays)]
                for start in range(0, len(some), max(1, _AT_ONCE // rays))
            ]
            some = np.concatenate([block[self._ends_at_once(block, rays)] for block in blocks] or [some])
        found[some] = True
        return found

    def _ends_at_once(self, sites: Int[np.ndarray, " n"], rays: int) -> Bool[np.ndarray, " n"]:
        triangle, starts = self.triangle[sites, :rays], self.sites.starts
        number, share = self._about(triangle, self.place[sites, :rays])
        way = np.einsum("nrc,nrci->nri", share, starts[number]) - starts[sites, None]
        gone = (share.sum(axis=2) == 0.0) | (np.einsum("nri,nri->nr", way, way) < _AT_ONCE_FAR**2)
        return ((triangle >= 0) & gone).mean(axis=1) >= _NEARLY_ALL

    def _about(
        self, triangle: Int[np.ndarray, "n N"], place: UInt16[np.ndarray, "n N 2"]
    ) -> tuple[Int[np.ndarray, "n N 3"], Float[np.ndarray, "n N 3"]]:
        both = np.concatenate([self.corners, self.backs])
        found = both[np.where(triangle < 0, 0, triangle)]
        part = place.astype(np.float64) / _WHOLE
        shares = np.concatenate([1.0 - (part[..., :1] + part[..., 1:]), part], axis=2)
        shares[triangle < 0] = 0.0
        shares[found < 0] = 0.0
        assert triangle.max(initial=-1) < len(both)
        return np.maximum(found, 0), shares


def ray_directions(
    normals: Float[np.ndarray, "n 3"], numbers: Int[np.ndarray, " n"], rays: int
) -> Float[np.ndarray, "n N 3"]:
    """Sample cosine-distributed unit directions about each normal (density cos / pi, 1/sr).

    numbers : indices of the sites, which determine the shifts of the pattern.
    """
    square = shifted_pattern(numbers, rays)
    # Uniform on the disc below the hemisphere, hence cosine-distributed.
    radius, turn = np.sqrt(square[..., 0]), 2.0 * np.pi * square[..., 1]
    x, y, z = radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square[..., 0])
    across, along = tangents(normals)
    found = np.empty((*x.shape, 3))
    for axis in range(3):
        found[..., axis] = x * across[:, None, axis] + y * along[:, None, axis] + z * normals[:, None, axis]
    return found


def shifted_pattern(numbers: Int[np.ndarray, " n"], count: int) -> Float[np.ndarray, "n count 2"]:
    """Return low-discrepancy points in the unit square, with a toroidal shift for each set."""
    pattern = (0.5 + np.arange(1, count + 1)[:, None] * _STEPS) % 1.0
    shifted = pattern + (numbers[:, None] * _SHIFTS % 1.0)[:, None, :]
    # Values are below 2, so that this is the exact remainder.
    shifted -= shifted >= 1.0
    return shifted


def tangents(normals: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return two axes across each normal (Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017)."""
    x, y, z = normals.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return first, np.stack([b, sign + y * y * a, -y], axis=1)


def check_rays_fit(sites: int, rays: int) -> None:
    """Raise `InputError` if all rays of so many sites do not fit into memory."""
    needed = sites * rays * BYTES_A_RAY + _AT_ONCE * _BYTES_TRACED
    words = f"{sites:,} vertices, {rays} rays each: {gigabytes(needed)} of memory"
    check_room(needed, "what light does between the parts does not fit into memory", words, "ask for fewer rays")


class RayTracer:
    """BVH of triangles (F, 3, 3) with their normals (F, 3), for closest hits."""

    def __init__(self, triangles: Float[np.ndarray, "F 3 3"], face_normals: Float[np.ndarray, "F 3"]) -> None:
        self._index, self._face_normals = ray_index(triangles), face_normals

    def ends(
        self, starts: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], first: int, rays: int
    ) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]:
        """Return `triangle` and `place`, as in `Hits`, for sites numbered from `first`."""
        return self.met(starts, ray_directions(normals, first + np.arange(len(starts)), rays))

    def met(
        self, starts: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n N 3"]
    ) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]:
        """Return the same for given directions."""
        rays, to = directions.shape[1], directions.reshape(-1, 3)
        origins = np.repeat(starts, rays, axis=0)
        met = self._index.run(origins.astype(np.float32), to.astype(np.float32), query="INTERSECT", output=True)
        face = met["primID"].astype(np.int64)
        back = dot(to, self._face_normals[face]) > 0.0
        triangle = np.where(face < 0, -1, face + len(self._face_normals) * back).astype(np.int32)
        shares = np.clip(np.stack([met["u"], met["v"]], axis=1).astype(np.float64), 0.0, 1.0)
        shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1.0)
        place = np.floor(shares * _WHOLE + 0.5 * (shares < 1.0)).astype(np.uint16)
        return triangle.reshape(-1, rays), place.reshape(-1, rays, 2)


def ray_blocks(sites: int, rays: int) -> list[slice]:
    """Return blocks of sites whose rays are traced together and cached in one file."""
    step = max(1, _AT_ONCE // rays)
    return [slice(start, min(start + step, sites)) for start in range(0, sites, step)]


def traced_hits(
    where: Sites,
    corners: Corners,
    triangles: Float[np.ndarray, "F 3 3"],
    rays: int,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> Hits:
    """Trace the rays of sites against triangles in the same coordinates."""
    tracer, count = RayTracer(triangles, corners.face_normals), len(where)
    triangle = np.full((count, rays), -1, dtype=np.int32)
    place = np.zeros((count, rays, 2), dtype=np.uint16)
    for rows in ray_blocks(count, rays):
        triangle[rows], place[rows] = tracer.ends(where.starts[rows], where.normals[rows], rows.start, rays)
        progress(rows.stop, count, "interreflection")
    return hits_of(where, corners, triangles, triangle, place)


def hits_of(
    where: Sites,
    corners: Corners,
    triangles: Float[np.ndarray, "F 3 3"],
    triangle: Int[np.ndarray, "S N"],
    place: UInt16[np.ndarray, "S N 2"],
) -> Hits:
    """Combine traced rays with their sites and triangles."""
    count = len(where)
    vertex = corners.vertex.reshape(-1, 3)
    fronts, backs = where.fronts[vertex], where.backs[vertex]
    edges = triangles[:, 1:].astype(np.float64) - triangles[:, :1]
    thirds = np.repeat(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 6.0, 3)
    areas = np.bincount(fronts.ravel(), thirds, count)
    areas += np.bincount(backs.ravel()[backs.ravel() >= 0], thirds[backs.ravel() >= 0], count)
    return Hits(where, fronts, backs, triangle, place, corners.part, areas)
