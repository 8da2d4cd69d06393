"""Shaded surface: a matt body under facets, at points with a normal and a viewer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...materials.core.spherical_gaussian import Gaussians
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM

#: Cosines below which the smooth factor is not followed: a lobe's axis may lie under the horizon.
LEAST_COSINE = 1e-2


def schlick_shares(cosine: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n 2"]:
    """Shares of normal incidence and of grazing: 1 - s and s, s = (1 - h.o)^5 (Schlick 1994)."""
    rise = (1.0 - cosine) ** 5
    return np.stack([1.0 - rise, rise], axis=-1)


def masked_by(
    one_sided: Callable[[np.ndarray, float], np.ndarray],
    roughness: float,
    wi: Float[np.ndarray, "*n 3"],
    wo: Float[np.ndarray, "*m 3"],
) -> Float[np.ndarray, "*k"]:
    """Smith's masking over 4 cos i cos o, as the product of two factors `one_sided` (directions (N, 3), roughness)."""
    wi, wo = np.broadcast_arrays(wi, wo)
    each = [one_sided(w.reshape(-1, 3), roughness).reshape(w.shape[:-1]) for w in (wi, wo)]
    return each[0] * each[1]


@dataclass(frozen=True, eq=False)
class GlossySurface:
    """f_r = body/pi + sum over r [a_r(h.o) facets_r] D(h) V(i, o), with spectra on `wavelengths_nm`.

    body (L,), facets (R, L) : reflectances. density : D of half vectors (..., 3) in the surface's frame, 1/sr; it
    may be None where there is a body alone. masked : V, the masking over 4 cos i cos o, of (..., 3) and (..., 3).
    lobes : the distribution as that many Gaussians. shares : a_r of h.o, (...) to (..., R); Schlick's between a
    spectrum at normal incidence and one at grazing, where nothing else is said.
    """

    name: str
    body: Float[np.ndarray, " L"]
    facets: Float[np.ndarray, "R L"]
    density: Callable[[np.ndarray], np.ndarray] | None
    masked: Callable[[np.ndarray, np.ndarray], np.ndarray]
    lobes: Callable[[int], Gaussians]
    shares: Callable[[np.ndarray], np.ndarray] = schlick_shares

    wavelengths_nm = WORKING_WAVELENGTHS_NM

    @property
    def spectra(self) -> Float[np.ndarray, "T L"]:
        """Spectra that the terms are multiplied by: the body's, then the facets'."""
        return np.concatenate([self.body[None], self.facets])

    def smooth(self, wi: Float[np.ndarray, "... 3"], wo: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... R"]:
        """M_o of eq. 9, of the facets' terms."""
        wi, wo = np.broadcast_arrays(wi, wo)
        inside = wi.copy()
        inside[..., 2] = np.maximum(wi[..., 2], LEAST_COSINE)
        half = wi + wo
        return self.masked(inside, wo)[..., None] * self.shares(np.minimum(0.5 * np.linalg.norm(half, axis=-1), 1.0))

    def terms(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N T"]:
        """f_r cos i of the terms, exact; 0 below the horizon."""
        lit = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
        found = np.zeros((len(wi), 1 + len(self.facets)))
        found[lit, 0] = wi[lit, 2] / np.pi
        if self.density is not None:
            half = wi[lit] + wo[lit]
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            value = self.density(half) * self.masked(wi[lit], wo[lit]) * wi[lit, 2]
            found[lit, 1:] = value[:, None] * self.shares(np.minimum(np.sum(half * wo[lit], axis=1), 1.0))
        return found


@dataclass(frozen=True, eq=False)
class ShadedPoints:
    """N points: `world_from_local` (N, 3, 3), its columns tangent, bitangent, normal; `viewer` (N, 3) local."""

    world_from_local: Float[np.ndarray, "N 3 3"]
    viewer: Float[np.ndarray, "N 3"]

    @classmethod
    def of_sphere(cls, across: int) -> ShadedPoints:
        """Return a sphere seen from +z, `across` points wide, tangents along its parallels; not its last edge."""
        middles = (np.arange(across) + 0.5) / across * 2.0 - 1.0
        x, y = np.meshgrid(middles, middles)
        seen = x * x + y * y < 0.995
        x, y = x[seen], y[seen]
        normal = np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], axis=1)
        tangent = np.stack([normal[:, 2], np.zeros_like(x), -x], axis=1)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        world = np.stack([tangent, np.cross(normal, tangent), normal], axis=2)
        return cls(world, world[:, 2, :].copy())

    @classmethod
    def facing(cls, normals: Float[np.ndarray, "N 3"], viewer: Float[np.ndarray, "N 3"]) -> ShadedPoints:
        """Points with these normals, seen from directions of the world; tangents lie flat."""
        tangent = np.stack([normals[:, 2], np.zeros(len(normals)), -normals[:, 0]], axis=1)
        length = np.linalg.norm(tangent, axis=1, keepdims=True)
        tangent = np.where(length > 1e-6, tangent / np.maximum(length, 1e-6), [1.0, 0.0, 0.0])
        world = np.stack([tangent, np.cross(normals, tangent), normals], axis=2)
        return cls(world, np.einsum("nji,nj->ni", world, viewer))

    def __len__(self) -> int:
        return len(self.viewer)

    def world(self, local: Float[np.ndarray, "N *n 3"]) -> Float[np.ndarray, "N *n 3"]:
        """Directions of each point's frame in the world."""
        return np.einsum("nij,n...j->n...i", self.world_from_local, local)

    def local(self, world: Float[np.ndarray, "N *n 3"]) -> Float[np.ndarray, "N *n 3"]:
        """Directions of the world in each point's frame."""
        return np.einsum("nji,n...j->n...i", self.world_from_local, world)

    @property
    def positions(self) -> Float[np.ndarray, "N 3"]:
        """Positions in the world: the sphere's radius is 1, its middle the origin."""
        return self.normals

    @property
    def normals(self) -> Float[np.ndarray, "N 3"]:
        """Normals in the world."""
        return self.world_from_local[:, :, 2]
