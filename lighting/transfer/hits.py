"""Hits of the rays of a scene's sites: all of its geometry that interreflection needs.

Sun et al. 2007 (section 3.1) keep what arrives at a vertex, as tensors over light, regions and reflectances. Here the
rays themselves are kept: from each site, N rays that are as dense as the cosine to its normal, and of each the triangle
that it ends on and where. Materials, lights and cameras are not in it, so that all of them may change.

A ray's direction is not kept. All sites share one even pattern in the unit square (the R2 sequence of M. Roberts, "The
unreasonable effectiveness of quasirandom sequences", 2018), which each shifts by an amount of its own, around its edges
(Cranley and Patterson 1976), so that neighbours err apart.
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

#: Rays of a site. ΔE94 falls with about their number to the power of -0.7.
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
# Length of rays that end at once, in radii of the scene, and the share of them that shuts a site; rays that show most
# sites to be open; and the least share of open sites about a place to interpolate from them alone.
_AT_ONCE_FAR, _NEARLY_ALL, _TELL, _LEAST = 0.003, 0.9, 32, 0.05
# Largest value of a triangle's quantised shares, 16 bits.
_WHOLE = 65535


@dataclass(frozen=True, eq=False)
class Hits:
    """Ends of N rays of each of S sites.

    sites : where rays start.
    corners (F, 3) : the site that each corner of each triangle is on its front; backs (F, 3) : on its back, -1 where
        that is dark (the inside of a solid).
    triangle (S, N) : that each ray ends on; F + its number where it meets the back; -1 where it meets nothing.
    place (S, N, 2) : shares of the triangle's second and third corner there, of 65535.
    part (F,) : that each triangle belongs to.
    areas (S,) : of what each site stands for, in units of a scene of radius 1: a third of each triangle about it.
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
        """Part that each site is on."""
        found = np.zeros(len(self.sites), dtype=np.int64)
        for corners in (self.backs, self.corners):
            there = corners >= 0
            found[corners[there]] = np.broadcast_to(self.part[:, None], corners.shape)[there]
        found.flags.writeable = False
        return found

    @property
    def rays(self) -> int:
        """N."""
        return self.triangle.shape[1]

    @property
    def nbytes(self) -> int:
        """Bytes of the stored rays."""
        return self.triangle.nbytes + self.place.nbytes

    def directions(self, rows: slice = slice(None)) -> Float[np.ndarray, "n N 3"]:
        """Unit vectors of the rays of some sites, in the world."""
        numbers = np.arange(len(self.sites))[rows]
        return ray_directions(self.sites.normals[rows], numbers, self.rays)

    def ends(self, rows: slice = slice(None)) -> tuple[Int[np.ndarray, "n N 3"], Float[np.ndarray, "n N 3"]]:
        """Return the three sites about the end of each ray of some sites, and their shares: 0 where it meets nothing.

        A corner that is dark has the number 0 and no share; the sum of shares is then below 1.
        """
        return self.about(self.triangle[rows], self.place[rows])

    def about(
        self, triangle: Int[np.ndarray, "n N"], place: UInt16[np.ndarray, "n N 2"]
    ) -> tuple[Int[np.ndarray, "n N 3"], Float[np.ndarray, "n N 3"]]:
        """`ends` of other rays of this scene.

        A place that a ray sees is not shut: of what lies beside another part that stands there, the corners below that
        part do not count.
        """
        found, shares = self._about(triangle, place)
        return found, self.open_shares(found, shares)

    def open_shares(
        self, sites: Int[np.ndarray, "*n 3"], shares: Float[np.ndarray, "*n 3"]
    ) -> Float[np.ndarray, "*n 3"]:
        """Shares of sites about places that are seen: those that are `shut` leave theirs to the others there."""
        kept = np.where(self.shut[sites], 0.0, shares)
        # Sums along so short an axis take five times as long by `sum`.
        whole, left = ((one[..., 0] + one[..., 1] + one[..., 2])[..., None] for one in (shares, kept))
        # Shares stay as they are if next to none of them is of open sites.
        return np.where(
            left > _LEAST * whole, kept * np.divide(whole, left, out=np.ones_like(left), where=left > 0.0), shares
        )

    @cached_property
    def shut(self) -> Bool[np.ndarray, " S"]:
        """Sites that see next to nothing, inside of solids or with another part on them: nearly all of their rays
        end on the dark side of a solid, or at once.
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
    """Unit vectors as dense as the cosine to each normal (density cos / pi, 1/sr).

    numbers : of the sites, which say how each shifts the pattern.
    """
    square = shifted_pattern(numbers, rays)
    # The disc below the hemisphere, even in area: a cosine.
    radius, turn = np.sqrt(square[..., 0]), 2.0 * np.pi * square[..., 1]
    x, y, z = radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square[..., 0])
    across, along = tangents(normals)
    found = np.empty((*x.shape, 3))
    for axis in range(3):
        found[..., axis] = x * across[:, None, axis] + y * along[:, None, axis] + z * normals[:, None, axis]
    return found


def shifted_pattern(numbers: Int[np.ndarray, " n"], count: int) -> Float[np.ndarray, "n count 2"]:
    """Make points spread evenly over the unit square, each set shifted by an amount of its own."""
    pattern = (0.5 + np.arange(1, count + 1)[:, None] * _STEPS) % 1.0
    shifted = pattern + (numbers[:, None] * _SHIFTS % 1.0)[:, None, :]
    # Below 2, so that this is the remainder, exactly.
    shifted -= shifted >= 1.0
    return shifted


def tangents(normals: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Two axes across each normal (Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017)."""
    x, y, z = normals.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return first, np.stack([b, sign + y * y * a, -y], axis=1)


def check_rays_fit(sites: int, rays: int) -> None:
    """Raise `InputError` where all rays of so many sites do not fit into memory."""
    needed = sites * rays * BYTES_A_RAY + _AT_ONCE * _BYTES_TRACED
    words = f"{sites:,} vertices, {rays} rays each: {gigabytes(needed)} of memory"
    check_room(needed, "what light does between the parts does not fit into memory", words, "ask for fewer rays")


class RayTracer:
    """Index of triangles (F, 3, 3) for the question where rays end, and their normals (F, 3)."""

    def __init__(self, triangles: Float[np.ndarray, "F 3 3"], face_normals: Float[np.ndarray, "F 3"]) -> None:
        self._index, self._face_normals = ray_index(triangles), face_normals

    def ends(
        self, starts: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"], first: int, rays: int
    ) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]:
        """`triangle` and `place`, as `Hits` has them, of sites that are numbered from `first` on."""
        return self.met(starts, ray_directions(normals, first + np.arange(len(starts)), rays))

    def met(
        self, starts: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n N 3"]
    ) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]:
        """Return the same in directions of the caller's."""
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
    """Sites whose rays are traced together, and are one file where they are kept."""
    step = max(1, _AT_ONCE // rays)
    return [slice(start, min(start + step, sites)) for start in range(0, sites, step)]


def traced_hits(
    where: Sites,
    corners: Corners,
    triangles: Float[np.ndarray, "F 3 3"],
    rays: int,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> Hits:
    """Return the rays of sites against triangles, scaled alike."""
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
    """Rays that are traced, with the sites and triangles that they are of."""
    count = len(where)
    vertex = corners.vertex.reshape(-1, 3)
    fronts, backs = where.fronts[vertex], where.backs[vertex]
    edges = triangles[:, 1:].astype(np.float64) - triangles[:, :1]
    thirds = np.repeat(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 6.0, 3)
    areas = np.bincount(fronts.ravel(), thirds, count)
    areas += np.bincount(backs.ravel()[backs.ravel() >= 0], thirds[backs.ravel() >= 0], count)
    return Hits(where, fronts, backs, triangle, place, corners.part, areas)
