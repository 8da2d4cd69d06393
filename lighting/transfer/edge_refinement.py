"""Refinement of sites at the midpoints of edges where indirect light is not linear, as at contacts and corners.

The criterion is the colour error of interpolation under standard lighting that is independent of materials: uniform
light, at least a share of it on every surface, and a different colour for each part. If the indirect light at both ends
of an edge differs enough, its midpoint is traced; if interpolation there is off by more than `ALLOWED`, it becomes a
site, and the triangles on both sides are bisected there (`visibility.edge_bisection`). New edges are tested again. Both
ends and the midpoint use the same ray directions, so that noise nearly cancels and differences are due to geometry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.difference import delta_e_xyz, xyz_from_lab
from ..scene import Scene
from ..vectors import dot, unit, welded
from ..visibility.blocked_probes import shut_sites
from ..visibility.edge_bisection import Halving
from ..visibility.edge_refinement import middle_sites
from ..visibility.occluders import OFFSET, Occluders
from ..visibility.refinement import Vertices, divided, edges_between, refined
from ..visibility.sites import Corners, Sites, faces_of, pieces_of, scaled_triangles, sites_at
from .hits import RAYS, Hits, RayTracer, check_rays_fit, hits_of, ray_directions, traced_hits
from .operator import gathering_rows, irradiance_operator

#: Error budget of interpolation at the midpoint of an edge, ΔE94, and largest number of rounds.
ALLOWED, ROUNDS = 0.5, 4
#: Largest number of added sites, per site of the original mesh.
MOST = 0.1
#: Points at which the remaining error is measured, and rays of each.
POINTS, RAYS_OF_POINT = 1024, 256
# Rays per site for choosing edges; sites per block.
_RAYS, _BLOCK = 64, 2048
# Least direct illuminance of a site, relative to unoccluded uniform light.
_AT_LEAST = 0.25
# Colours of parts: CIE L*, chroma, and the step in hue, by the golden ratio; and the reflectance of receivers.
_LIGHTNESS, _CHROMA, _HUE, _RECEIVES = 65.0, 45.0, 2.0 * np.pi * 0.61803398874989484820, 0.5
_WHITE = np.ones(3)


@dataclass(frozen=True, eq=False)
class PlacedSites:
    """Sites of a scene after refinement.

    scene : with its triangles cut. refinement : the cuts. order (V,) : for each vertex of `refinement` its index in the
    meshes of `scene`, one after the other. added : number of vertices added for non-linear indirect light. corners,
    sites, triangles : of `scene`, scaled as `Sites`; triangles in float32, as traced.
    """

    scene: Scene
    refinement: Halving
    order: Int[np.ndarray, " V"]
    added: int
    corners: Corners
    sites: Sites
    triangles: Float[np.ndarray, "F 3 3"]

    def traced(
        self, rays: int = RAYS, progress: Callable[[int, int, str], None] = lambda done, total, what: None
    ) -> Hits:
        """Trace rays from each site; `ray_cache.kept_hits` caches them on disk.

        progress : called with (sites done, number of sites, name of the work).

        Raises
        ------
        InputError : it would not fit into memory.
        """
        check_rays_fit(len(self.sites), rays)
        return traced_hits(self.sites, self.corners, self.triangles, rays, progress)


def placed(scene: Scene, longest_edge: float | None = None, most: float = MOST) -> PlacedSites:
    """Subdivide large triangles of a scene (`refined`), and those on which indirect light is not linear.

    Sites are vertices, welded by position and normal (`visibility.sites`), and the midpoints at which triangles are
    cut.

    most : largest number of added sites, relative to the original number; 0 adds none.
    """
    fine, refinement, order = refined(scene, longest_edge)
    faces = faces_of(scene, pieces_of(scene))
    corners = faces.cut(fine, refinement.of)
    triangles = corners.triangles.astype(np.float32)
    occluders = Occluders(triangles)
    where = sites_at(corners, occluders)
    room, total = int(most * len(where)), len(order)
    if not room:
        return PlacedSites(fine, refinement, order, 0, corners, where, triangles)
    probed = _Probed.of(where, corners, triangles, occluders)
    world, fronts, backs = Vertices.of(fine).at(order), where.fronts[order], where.backs[order]
    asked = edges_between(refinement.pieces, fronts)
    for _ in range(ROUNDS):
        asked = asked[dot(world.facing[asked[:, 0]], world.facing[asked[:, 1]]) > 0.0]
        asked = asked[np.maximum(probed.apart(fronts[asked]), probed.apart(backs[asked])) > 2.0 * ALLOWED]
        if not len(asked) or room <= 0:
            break
        tried = world.with_middles(asked).scaled(*scene.bounds)
        _, there = middle_sites(faces, refinement, tried, fronts, asked, occluders)
        middles = [np.where(one >= 0, one + len(probed), -1) for one in (there.fronts, there.backs)]
        more = probed.with_sites(there)
        off = np.maximum(more.missed(fronts[asked], middles[0]), more.missed(backs[asked], middles[1]))
        wanted = np.flatnonzero(off > ALLOWED)
        wanted = wanted[np.argsort(-off[wanted], kind="stable")]
        # A sheet has a site on each side.
        wanted = np.sort(wanted[np.cumsum(np.where(middles[1][wanted] >= 0, 2, 1)) <= room])
        if not len(wanted):
            break
        before = len(fronts)
        pairs = _with_twins(asked[wanted], edges_between(refinement.pieces, fronts), world.places)
        world = world.with_middles(pairs)
        refinement, there = middle_sites(faces, refinement, world.scaled(*scene.bounds), fronts, pairs, occluders)
        fronts, backs = (
            np.append(one, np.where(other >= 0, other + len(probed), -1))
            for one, other in ((fronts, there.fronts), (backs, there.backs))
        )
        probed, room = probed.with_sites(there), room - len(there)
        # All other edges have been tested.
        asked = edges_between(refinement.pieces[(refinement.pieces >= before).any(axis=1)], fronts)
        asked = asked[(asked >= before).any(axis=1)]
    if len(fronts) == total:
        return PlacedSites(fine, refinement, order, 0, corners, where, triangles)
    fine, order = divided(scene, refinement, world)
    corners = faces.cut(fine, refinement.of)
    triangles = corners.triangles.astype(np.float32)
    where = sites_at(corners, Occluders(triangles))
    return PlacedSites(fine, refinement, order, len(fronts) - total, corners, where, triangles)


def _with_twins(
    chosen: Int[np.ndarray, "n 2"], edges: Int[np.ndarray, "E 2"], places: Float[np.ndarray, "V 3"]
) -> Int[np.ndarray, "m 2"]:
    """Find all edges that coincide with the chosen ones: both sides of a crease are cut, so that the mesh stays
    closed.
    """
    number, pack = welded(places)[1].astype(np.int64), np.array([len(places), 1])
    return edges[np.isin(np.sort(number[edges], axis=1) @ pack, np.sort(number[chosen], axis=1) @ pack)]


@dataclass(frozen=True, eq=False)
class BetweenSites:
    """Irradiance of n points by sites, F fields: traced, and interpolated from the points' own sites.

    sites, shares (n, 3) : of the triangle of each point. Points are uniform in area; a point and its sites use the same
    ray directions.
    """

    sites: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]
    traced: Float[np.ndarray, "n F"]
    mixed: Float[np.ndarray, "n F"]


def between_sites(scene: Scene, hits: Hits, sent: Float[np.ndarray, "S F"]) -> BetweenSites:
    """Trace random points between sites.

    scene : with the triangles of the sites, as in `PlacedSites`. sent : radiosity of all sites.
    """
    triangles, rng = scaled_triangles(scene), np.random.default_rng(0)
    edges = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    face = np.sort(rng.choice(len(area), POINTS, p=area / area.sum()))
    square = rng.random((POINTS, 2))
    square = np.where(square.sum(axis=1, keepdims=True) > 1.0, 1.0 - square, square)
    shares = np.column_stack([1.0 - square.sum(axis=1), square])
    meshes = [part.mesh for part in scene.parts]
    plane = np.concatenate([mesh.face_normals for mesh in meshes])
    normals = np.concatenate([mesh.normals[mesh.faces] for mesh in meshes])[face]
    where = Sites(
        np.einsum("nc,nci->ni", shares, triangles[face]) + OFFSET * plane[face],
        unit(np.einsum("nc,nci->ni", shares, normals)),
        face[:0],
        face[:0],
    )
    single = triangles.astype(np.float32)
    solid = np.concatenate([each.solid[each.of_face] for each in pieces_of(scene)])
    sites = hits.corners[face]
    seen = np.flatnonzero((sites >= 0).all(axis=1) & ~shut_sites(where, Occluders(single), plane, solid))
    sites, shares = sites[seen], hits.open_shares(sites[seen], shares[seen])
    tracer = RayTracer(single, plane)
    there, back = np.unique(sites, return_inverse=True)
    own = _received(hits, tracer, where.starts[seen], where.normals[seen], sent, RAYS_OF_POINT)[1]
    of_sites = _received(hits, tracer, hits.sites.starts[there], hits.sites.normals[there], sent, RAYS_OF_POINT)[1]
    mixed = np.einsum("nc,ncf->nf", shares, of_sites[back.reshape(sites.shape)])
    return BetweenSites(sites, shares, own, mixed)


@dataclass(frozen=True, eq=False)
class _Probed:
    """Irradiance of n sites under the standard lighting, relative to its white.

    hits : of the initial S sites. sent : radiosity of these. straight (n,), by_others (n,3) : direct and indirect
    irradiance. shut (n,) : see `shut_sites`.
    """

    hits: Hits
    tracer: RayTracer
    occluders: Occluders
    corners: Corners
    sent: Float[np.ndarray, "S 3"]
    straight: Float[np.ndarray, " n"]
    by_others: Float[np.ndarray, "n 3"]
    shut: Bool[np.ndarray, " n"]

    @classmethod
    def of(cls, where: Sites, corners: Corners, triangles: Float[np.ndarray, "F 3 3"], occluders: Occluders) -> _Probed:
        tracer, count = RayTracer(triangles, corners.face_normals), len(where)
        triangle = np.empty((count, _RAYS), dtype=np.int32)
        place = np.empty((count, _RAYS, 2), dtype=np.uint16)
        for start in range(0, count, _BLOCK):
            rows = slice(start, start + _BLOCK)
            triangle[rows], place[rows] = tracer.met(where.starts[rows], _alike(where.normals[rows], _RAYS))
        hits = hits_of(where, corners, triangles, triangle, place)
        operator, straight = irradiance_operator(hits), (triangle < 0).mean(axis=1)
        hue = _HUE * hits.part_of_site
        lab = np.stack([np.full(count, _LIGHTNESS), _CHROMA * np.cos(hue), _CHROMA * np.sin(hue)], axis=1)
        colour = xyz_from_lab(lab, _WHITE)
        received = np.maximum(straight, _AT_LEAST)[:, None]
        sent = colour * (received + operator @ (colour * received))
        shut = shut_sites(where, occluders, corners.face_normals, corners.solid)
        return cls(hits, tracer, occluders, corners, sent, straight, operator @ sent, shut)

    def __len__(self) -> int:
        return len(self.straight)

    def with_sites(self, where: Sites) -> _Probed:
        """Append further sites, which send no light."""
        straight, by_others = _received(self.hits, self.tracer, where.starts, where.normals, self.sent, _RAYS)
        shut = shut_sites(where, self.occluders, self.corners.face_normals, self.corners.solid)
        return replace(
            self,
            straight=np.concatenate([self.straight, straight]),
            by_others=np.concatenate([self.by_others, by_others]),
            shut=np.concatenate([self.shut, shut]),
        )

    def apart(self, ends: Int[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
        """Return the ΔE94 of exchanging the indirect irradiance of both ends, the larger of the two: infinite if one of
        them is blocked, since nothing is known in between; 0 if both are, or without a site.
        """
        one, other = np.maximum(ends.T, 0)
        found = np.maximum(self._difference(one, self.by_others[other]), self._difference(other, self.by_others[one]))
        shut, both = self.shut[one] | self.shut[other], self.shut[one] & self.shut[other]
        return np.where((ends >= 0).all(axis=1) & ~both, np.where(shut, np.inf, found), 0.0)

    def missed(self, ends: Int[np.ndarray, "n 2"], middle: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return the ΔE94 of interpolating the irradiance at midpoints from both ends, or from the open end alone; 0
        where the midpoint is blocked.
        """
        there = (ends >= 0).all(axis=1) & (middle >= 0)
        ends, middle = np.maximum(ends, 0), np.maximum(middle, 0)
        weights = np.where(self.shut[ends], 1e-6, 1.0)
        weights /= weights.sum(axis=1, keepdims=True)
        mixed = np.einsum("ne,nec->nc", weights, self.by_others[ends])
        return np.where(there & ~self.shut[middle], self._difference(middle, mixed), 0.0)

    def _difference(self, sites: Int[np.ndarray, " n"], instead: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        straight = self.straight[sites, None]
        own, other = (_RECEIVES * (straight + by_others) for by_others in (self.by_others[sites], instead))
        return delta_e_xyz(own, other, _WHITE)


def _received(
    hits: Hits,
    tracer: RayTracer,
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    sent: Float[np.ndarray, "S F"],
    rays: int,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n F"]]:
    """Return the share of rays that escape, and the irradiance at points by the radiosity of sites."""
    straight, by_others = np.empty(len(starts)), np.empty((len(starts), sent.shape[1]))
    for start in range(0, len(starts), _BLOCK):
        rows = slice(start, start + _BLOCK)
        triangle, place = tracer.met(starts[rows], _alike(normals[rows], rays))
        straight[rows] = (triangle < 0).mean(axis=1)
        by_others[rows] = gathering_rows(hits, triangle, place) @ sent
    return straight, by_others


def _alike(normals: Float[np.ndarray, "n 3"], rays: int) -> Float[np.ndarray, "n N 3"]:
    """Return ray directions that depend on the normal alone."""
    return ray_directions(normals, np.zeros(len(normals), dtype=np.int64), rays)
