"""First bounce: direct light that glossy sites reflect along the rays that hit them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...runtime.memory import check_room, gigabytes
from ..vectors import dot, unit
from .coefficients import Coefficients
from .direct_irradiance import Received
from .glossy_part import GlossyPart
from .glossy_rays import GlossyRays
from .operator import columns_times
from .precomputation import Precomputation
from .reflection import Reflection

#: Reflections by part index; those of glossy parts must be present.
OfParts = Sequence[Reflection] | Mapping[int, Reflection]
# Rays per block.
_BLOCK = 1 << 15


@dataclass(frozen=True, eq=False)
class CellLight:
    """Outgoing light of the cells of one glossy part: `values.T @ spread` is pi times their radiance in coefficients.

    values (C, G_p O), spread (C, F) : by spectrum and term, or by field, whichever are fewer.
    """

    part: GlossyPart
    values: Float[np.ndarray, "C GO"]
    spread: Float[np.ndarray, "C F"]

    @property
    def irradiance(self) -> Float[np.ndarray, "n F"]:
        """Irradiance of sites `GlossyPart.rows` by these cells."""
        return columns_times(self.part.emission, self.values).T @ self.spread


def cell_radiosity(
    rays: GlossyRays,
    originals: OfParts,
    reflections: OfParts,
    got: Received,
    coefficients: Coefficients,
    dtype: type = np.float32,
) -> tuple[CellLight, ...]:
    """Compute the light of area and environment lights that glossy sites reflect into each cell, without their diffuse
    terms.

    originals, reflections : of each part, at their own wavelengths and at those of the basis.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    size, spectra, count = len(rays.cells), len(got.incoming), coefficients.basis.size
    most = max((len(reflections[one.part].spectra) + count for one in rays.parts), default=0)
    needed = len(rays.sites) * size * spectra * most * np.dtype(dtype).itemsize
    words = f"{len(rays.sites):,} glossy sites, {spectra} spectra, {count} coefficients: {gigabytes(needed)}"
    check_room(needed, "what glossy parts send out does not fit into memory", words, "ask for fewer sites")
    if not got.incoming.any():
        return ()
    found = []
    for one in rays.parts:
        values = got.scattered(one, originals[one.part]).astype(dtype, copy=False)
        spread = coefficients.rows(coefficients.sent(np.pi * reflections[one.part].spectra)).astype(dtype)
        if spread.shape[0] > spread.shape[1]:
            values, spread = spread.T @ values, np.eye(spread.shape[1], dtype=dtype)
        found.append(CellLight(one, values, spread))
    return tuple(found)


def ray_radiosity(
    prepared: Precomputation,
    rays: GlossyRays,
    reflections: OfParts,
    got: Received,
    coefficients: Coefficients,
    dtype: type = np.float32,
) -> Float[np.ndarray, "n F"]:
    """Compute pi times the radiance along each ray that hits a glossy part, of delta lights: the BRDF is evaluated at
    the hit point, and visibility is interpolated between the sites around it.
    """
    found = np.zeros((len(rays.ray), coefficients.kinds, coefficients.basis.size), dtype=dtype)
    if not got.free:
        return found.reshape(len(found), coefficients.fields)
    hits, frames, starts = prepared.hits, prepared.frames, prepared.hits.sites.starts
    centre, radius = prepared.centre_and_radius
    of_ray = hits.part[hits.triangle.ravel()[rays.ray] % len(hits.part)]
    terms = {one.part: coefficients.sent(np.pi * reflections[one.part].spectra) for one in rays.parts}
    for start in range(0, len(found), _BLOCK):
        block = slice(start, start + _BLOCK)
        about, share = rays.about[block], rays.share[block]
        axes = np.einsum("nc,ncij->nij", share, frames[about])
        normal = unit(axes[:, 2])
        along = unit(axes[:, 0] - dot(axes[:, 0], normal)[:, None] * normal)
        # Mirrored frames stay mirrored.
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
                # Several lights may share a spectrum.
                found[start + mine, k % coefficients.kinds] += scattered @ terms[number][k]
    return found.reshape(len(found), coefficients.fields)


def _directions(prepared: Precomputation, ray: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    """Return the directions of rays given by ascending indices."""
    rays = prepared.hits.rays
    first, last = int(ray[0]) // rays, int(ray[-1]) // rays + 1
    return prepared.hits.directions(slice(first, last)).reshape(-1, 3)[ray - first * rays]
