"""Transfer matrices: from spherical harmonics of light around a scene to those of what arrives at each of its sites.

Mueller, Meseth and Klein 2004 (section 4.2) light a BTF by M_p a: a are harmonics of the light around, M_p turns them
into the frame of point p and holds "large scale shadows and inter-reflections", as Sloan, Kautz and Snyder 2002 have
it. What arrives directly is harmonics in that frame of the light that is not hidden; what other surfaces send is theirs
as matt ones, bounce by bounce, until next to nothing is left. It is linear in the light around, and in the spectra that
it meets: coefficients in a basis relative to the light's own spectrum, where the direct part is the basis's white.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ....lighting.transfer.edge_refinement import PlacedSites
from ....lighting.transfer.hits import Hits, RayTracer, shifted_pattern
from ....lighting.transfer.regions import Regions
from ....runtime.errors import InputError
from ..harmonics import BANDS, COUNT, harmonics

#: Rays of a site, as dense in all directions above it.
RAYS = 256
#: Bounces end where one adds less than this share of all light so far.
ENOUGH, MOST = 1e-3, 500
# Rays at once: harmonics of each, of what it meets and of where it goes, some 100 MB.
_AT_ONCE = 1 << 15


@dataclass(frozen=True, eq=False)
class HarmonicTransfer:
    """matrices (S, J, 25, 25) : row by row a harmonic in the frame of each site, column by column one of the world.

    frames (S, 3, 3) : rows are the axes of a site, its normal last. rays : of each site.
    """

    matrices: Float[np.ndarray, "S J B B"]
    frames: Float[np.ndarray, "S 3 3"]
    rays: int

    @property
    def nbytes(self) -> int:
        """Bytes of the stored matrices."""
        return self.matrices.nbytes

    def lit(self, light: Float[np.ndarray, "K B"]) -> Float[np.ndarray, "S K J B"]:
        """Harmonics of what arrives at each site, of each of K fields of light around the scene, cd/m^2 sr^(1/2)."""
        return np.einsum("sjab,kb->skja", self.matrices, light, optimize=True)


def harmonic_transfer(
    bodies: PlacedSites,
    hits: Hits,
    regions: Regions,
    frames: Float[np.ndarray, "S 3 3"],
    operator: Any,
    rays: int = RAYS,
) -> HarmonicTransfer:
    """Return the matrices of all sites of a scene.

    Parameters
    ----------
    bodies, hits, operator : of the scene; `irradiance_operator(hits)`. regions : what its matt sites reflect.
    frames : rows are the axes that directions at each site are told in, its normal last. rays : of each site.

    Raises
    ------
    InputError : light that does not end.
    """
    count, size = len(hits.sites), regions.basis.size
    radiosity = _radiosity(hits, regions, operator)
    white = regions.basis.project(np.ones(len(regions.basis.wavelengths_nm)))
    tracer = RayTracer(bodies.triangles, bodies.corners.face_normals)
    found = np.empty((count, size, COUNT, COUNT), dtype=np.float32)
    step = max(1, _AT_ONCE // rays)
    for start in range(0, count, step):
        rows = slice(start, min(start + step, count))
        local = _even(np.arange(rows.start, rows.stop), rays)
        to = local @ frames[rows]
        triangle, place = tracer.met(hits.sites.starts[rows], to)
        free = triangle < 0
        there = _of(local) * (2.0 * np.pi / rays)
        direct = np.swapaxes(there * free[..., None], 1, 2) @ _of(to)
        numbers, shares = hits.about(triangle, place)
        # Luminance is radiosity over pi.
        sent = np.einsum("nrc,nrcbj->nrjb", shares / np.pi, radiosity[numbers], optimize=True)
        passed = np.swapaxes(there, 1, 2) @ sent.reshape(len(sent), rays, -1)
        passed = passed.reshape(len(sent), COUNT, size, COUNT).swapaxes(1, 2)
        found[rows] = direct[:, None] * white[:, None, None] + passed
    return HarmonicTransfer(found, frames, rays)


def _even(numbers: np.ndarray, rays: int) -> Float[np.ndarray, "n N 3"]:
    """Directions above each of some sites, evenly over the hemisphere, each set turned and shifted by its own."""
    square = shifted_pattern(numbers, rays)
    z, turn = square[..., 0], 2.0 * np.pi * square[..., 1]
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=-1)


def _of(to: Float[np.ndarray, "n N 3"]) -> Float[np.ndarray, "n N B"]:
    return harmonics(to.reshape(-1, 3), BANDS).reshape(*to.shape[:2], COUNT)


def _radiosity(hits: Hits, regions: Regions, operator: Any) -> Float[np.ndarray, "S B J"]:
    """Compute what each site sends out of each harmonic of the light around, all bounces together."""
    received = np.empty((len(hits.sites), COUNT))
    step = max(1, _AT_ONCE // hits.rays)
    for start in range(0, len(hits.sites), step):
        rows = slice(start, start + step)
        free = hits.triangle[rows] < 0
        # As dense as the cosine: the integral is pi times the mean.
        received[rows] = np.pi * np.mean(_of(hits.directions(rows)) * free[..., None], axis=1)
    now = regions.first(received)
    total = now.copy()
    for _ in range(MOST):
        now = regions.reflected(np.asarray(operator @ now.reshape(len(now), -1)).reshape(now.shape))
        total += now
        if np.linalg.norm(now) <= ENOUGH * np.linalg.norm(total):
            return total
    words = f"a share of {np.linalg.norm(now) / np.linalg.norm(total):.2g} is added by bounce {MOST}"
    raise InputError("light that does not end", found=words, expected=f"at most {ENOUGH:g}")
