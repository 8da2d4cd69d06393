"""What glossy sites send out of the light that they receive straight away, towards the rays that meet them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from ...spectral.basis import SpectralBasis
from ...spectral.memory import check_room, gigabytes
from ..vectors import dot, unit
from .glossy_rays import GlossyRays
from .prepared import Prepared
from .received import Received
from .reflection import Reflection

# Rays at once.
_BLOCK = 1 << 15


def cell_radiosity(
    rays: GlossyRays,
    reflections: Sequence[Reflection],
    part: Int[np.ndarray, " G"],
    got: Received,
    basis: SpectralBasis,
    dtype: type = np.float32,
) -> Float[np.ndarray, "GO KJ"]:
    """pi times the radiance that glossy sites send into each cell, of lights that spread; without their matt terms.

    part : of each glossy site.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    size, spectra = len(rays.cells), got.incoming.shape[2]
    needed = len(rays.sites) * size * spectra * basis.size * np.dtype(dtype).itemsize
    words = f"{len(rays.sites):,} glossy sites, {spectra} spectra, {basis.size} coefficients: {gigabytes(needed)}"
    check_room(needed, "what glossy parts send out does not fit into memory", words, "ask for fewer sites")
    found = np.zeros((len(rays.sites), size, spectra, basis.size), dtype=dtype)
    if not got.incoming.any():
        return found.reshape(-1, spectra * basis.size)
    for number in np.unique(part):
        mine, reflection = np.flatnonzero(part == number), reflections[number]
        terms = basis.project(np.pi * reflection.spectra).astype(dtype)
        for k in range(spectra):
            arriving = got.incoming[mine, :, k]
            for table, coefficients in zip(reflection.table, terms, strict=True):
                found[mine, :, k] += (arriving @ table.T)[:, :, None] * coefficients
    return found.reshape(-1, spectra * basis.size)


def ray_radiosity(
    prepared: Prepared,
    rays: GlossyRays,
    reflections: Sequence[Reflection],
    got: Received,
    basis: SpectralBasis,
    dtype: type = np.float32,
) -> Float[np.ndarray, "n KJ"]:
    """pi times the radiance that each ray that ends on a glossy part brings, of lights from one direction: their BRDF
    at the very end of the ray. How much of the light is hidden there is mixed of the sites about it.
    """
    found = np.zeros((len(rays.ray), got.lux.shape[1], basis.size), dtype=dtype)
    if not got.free:
        return found.reshape(len(found), found.shape[1] * basis.size)
    hits, frames, starts = prepared.hits, prepared.frames, prepared.hits.sites.starts
    centre, radius = prepared.centre_and_radius
    of_ray = hits.part[hits.triangle.ravel()[rays.ray] % len(hits.part)]
    terms = [basis.project(np.pi * one.spectra) for one in reflections]
    for start in range(0, len(found), _BLOCK):
        block = slice(start, start + _BLOCK)
        about, share = rays.about[block], rays.share[block]
        axes = np.einsum("nc,ncij->nij", share, frames[about])
        normal = unit(axes[:, 2])
        along = unit(axes[:, 0] - dot(axes[:, 0], normal)[:, None] * normal)
        # Mirrored frames stay so.
        hand = np.sign(dot(np.cross(normal, along), axes[:, 1]))
        frame = np.stack([along, hand[:, None] * np.cross(normal, along), normal], axis=1)
        wo = np.einsum("nij,nj->ni", frame, -_directions(prepared, rays.ray[block]))
        points = np.einsum("nc,nci->ni", share, starts[about]) * radius + centre
        for k, light, free in got.free:
            arriving = light.arrivals(points)
            wi = np.einsum("nij,nj->ni", frame, arriving.directions)
            lux = arriving.illuminance_lux * np.maximum(wi[:, 2], 0.0) * np.sum(share * free[about], axis=1)
            lit = np.flatnonzero((lux > 0.0) & (wo[:, 2] > 0.0))
            for number in np.unique(of_ray[block][lit]):
                mine = lit[of_ray[block][lit] == number]
                scattered = reflections[number].scalars(wi[mine], wo[mine]) * lux[mine, None]
                found[start + mine, k] = scattered @ terms[number]
    return found.reshape(len(found), found.shape[1] * basis.size)


def _directions(prepared: Prepared, ray: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    """Of ascending ray numbers."""
    rays = prepared.hits.rays
    first, last = int(ray[0]) // rays, int(ray[-1]) // rays + 1
    return prepared.hits.directions(slice(first, last)).reshape(-1, 3)[ray - first * rays]
