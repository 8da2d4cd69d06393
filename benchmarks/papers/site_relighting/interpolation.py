"""Interpolation of outgoing indirect light at points between sites.

What arrives is linear on triangles. A matt surface folds it; a glossy one has a normal and a view of its own there, of
which what its sites send is no mean: on a coarse ring highlights lie between sites. So the rays of all three sites
about a point are taken, each with the BRDF at the point, and as dense as they are together (the balance heuristic of
Veach and Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ....lighting.vectors import LEAST_COSINE, unit
from ....spectral.spectrum import Spectrum
from .relighting import Relighting

# Points at once.
_BLOCK = 64


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of surfaces that are seen.

    part (n,). sites, shares (n,3) : of the triangle there. frame (n,3,3) : from the world to the surface's own.
    wo (n,3) : to the viewer, in that frame. plane (n,3) : normal of the triangle there, in the world, on the side that
    is seen: nothing comes from below it, whatever `frame` says.
    """

    part: Int[np.ndarray, " n"]
    sites: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]
    frame: Float[np.ndarray, "n 3 3"]
    wo: Float[np.ndarray, "n 3"]
    plane: Float[np.ndarray, "n 3"]


def exits_between(
    state: Relighting, points: SurfacePoints, illuminants: Sequence[Spectrum | None] = (None,)
) -> Float[np.ndarray, "n M3"]:
    """XYZ that points send to the viewer, as `Relighting.exits` has it of sites."""
    if each := state.excited(illuminants):
        return np.concatenate([exits_between(one, points) for one in each], axis=1)
    found = np.zeros((len(points.part), 3 * len(illuminants)), dtype=state.dtype)
    arriving = state.arriving.reshape(len(state.arriving), -1)
    for number in np.unique(points.part).tolist():
        mine = np.flatnonzero(points.part == number)
        here = np.einsum("nc,ncf->nf", points.shares[mine], arriving[points.sites[mine]])
        found[mine] = here @ state.matt_fold(number, illuminants).astype(state.dtype)
    if state.bounces == 0:
        return found
    for number in np.flatnonzero(state.glossy).tolist():
        mine = np.flatnonzero(points.part == number)
        fold = state.glossy_fold(number, illuminants)
        for start in range(0, len(mine), _BLOCK):
            some = mine[start : start + _BLOCK]
            found[some] += _glossy(state, points, some, number, fold)
    return found


def _glossy(
    state: Relighting,
    points: SurfacePoints,
    some: Int[np.ndarray, " m"],
    number: int,
    fold: Float[np.ndarray, "R F M3"],
) -> Float[np.ndarray, "m M3"]:
    rays, hits = state.rays, state.prepared.hits
    shares, sites = points.shares[some], points.sites[some]
    there, back = np.unique(sites, return_inverse=True)
    back = back.reshape(sites.shape)
    to = np.concatenate([hits.directions(slice(site, site + 1)) for site in there])
    part = next(one for one in rays.parts if one.part == number)
    brought = state.sources.brought(part, rays.within[rays.number[there]])
    wi = np.einsum("mij,mcrj->mcri", points.frame[some], to[back]).reshape(len(some), -1, 3)
    # Density of all rays together in each direction, beside the cosine at the point.
    cosines = np.maximum(np.einsum("msi,mcri->mcrs", hits.sites.normals[sites], to[back]), 0.0)
    density = np.einsum("ms,mcrs->mcr", shares, cosines)
    weight = 3.0 * shares[:, :, None] * np.divide(1.0, density, out=np.zeros_like(density), where=density > 0.0)
    weight = weight.reshape(len(some), -1) * np.maximum(wi[..., 2], 0.0)
    wo = points.wo[some].copy()
    wo[:, 2] = np.maximum(wo[:, 2], LEAST_COSINE)
    wo, reflection = unit(wo), state.reflections[number]
    f_r = reflection.scalars(wi.reshape(-1, 3), np.repeat(wo, wi.shape[1], axis=0)).reshape(*wi.shape[:2], -1)
    f_r = f_r * weight[:, :, None]
    f_r *= reflection.correction(f_r, wo[:, 2])[:, None]
    f_r[np.einsum("mi,mcri->mcr", points.plane[some], to[back]).reshape(wi.shape[:2]) <= 0.0] = 0.0
    by_term = np.einsum("mrt,mrk->mtk", f_r, brought[back].reshape(len(some), wi.shape[1], -1), optimize=True)
    return np.einsum("mtk,tkx->mx", by_term, fold * (np.pi / wi.shape[1]), optimize=True)
