"""The paper's rendering of points (Wang et al. 2009, eqs. 36 to 43): lobes warped, multiplied, and looked up.

Terms come out, cd/m^2 under each of the light's K spectra: of the body, and of the facets.
Spectra multiply them afterwards; the paper's own colours are RGB.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ...lighting.environment.brights import BrightParts
from ...materials.core.spherical_gaussian import Gaussians
from ..papers.gaussian_lobes.warp import warped
from .light import Gamma
from .surface import GlossySurface, ShadedPoints

#: Share of Gaussians visible from each point: (directions (N, Q, 3) of the world, sharpness (N, Q)) -> (N, Q) in [0,
#: 1].
FreeShare = Callable[[np.ndarray, np.ndarray], np.ndarray]
#: The clamped cosine as one lobe about the normal (eq. 40).
COSINE_SHARPNESS, COSINE_AMPLITUDE = 2.133, 1.170


def specular(
    surface: GlossySurface, points: ShadedPoints, gamma: Gamma, free_share: FreeShare | None, lobes: int
) -> Float[np.ndarray, "N K R"]:
    """R_s (eq. 41): for each lobe the cosine, the slice and the visibility as one Gaussian, looked up in the light."""
    seen, smooth = _slice(surface, points, lobes)
    to = points.world(seen.axis)
    weight = seen.integral * _free(free_share, to, seen.sharpness)
    arrives = gamma(to.reshape(-1, 3), seen.sharpness.ravel()).reshape(*weight.shape, -1)
    return np.einsum("nl,nlk,nlr->nkr", weight, arrives, smooth)


def local_specular(
    surface: GlossySurface, points: ShadedPoints, light: Gaussians, free_share: FreeShare | None, lobes: int
) -> Float[np.ndarray, "N 1 R"]:
    """R_s of a light that is one lobe (N,) at each point (eq. 43): the inner product of it and what eq. 41 looks up."""
    seen, smooth = _slice(surface, points, lobes)
    local = Gaussians(points.local(light.axis)[:, None], light.sharpness[:, None], light.amplitude[:, None])
    product = seen.product(local)
    free = _free(free_share, points.world(product.axis), product.sharpness)
    return np.einsum("nl,nlr->nr", product.integral * free, smooth)[:, None, :]


def local_diffuse(points: ShadedPoints, light: Gaussians, free_share: FreeShare | None) -> Float[np.ndarray, "N 1"]:
    """R_d of a light that is one lobe (N,) at each point (eq. 42), over pi."""
    product = _cosine(points.normals).product(light)
    free = _free(free_share, product.axis[:, None], product.sharpness[:, None])
    return product.integral[:, None] * free / np.pi


def diffuse(points: ShadedPoints, lights: BrightParts, free_share: FreeShare | None) -> Float[np.ndarray, "N K"]:
    """R_d (eq. 39): the cosine's lobe times each of the light's, times what is free of the product; over pi."""
    light = Gaussians(lights.axis, lights.sharpness, np.ones(len(lights.sharpness)))
    product = _cosine(points.normals[:, None, :]).product(light)
    free = _free(free_share, product.axis, product.sharpness)
    return (product.integral * free) @ lights.amplitude / np.pi


def _slice(surface: GlossySurface, points: ShadedPoints, lobes: int) -> tuple[Gaussians, np.ndarray]:
    """C* and rho* multiplied, (N, n) in each point's frame, and M_o at the slice's own axes, (N, n, R)."""
    viewer = points.viewer[:, None, :]
    turned = warped(surface.lobes(lobes), viewer)
    return turned.product(_cosine(np.array([0.0, 0.0, 1.0]))), surface.smooth(turned.axis, viewer)


def _free(free_share: FreeShare | None, to: np.ndarray, sharpness: np.ndarray) -> np.ndarray:
    return np.ones(sharpness.shape) if free_share is None else free_share(to, sharpness)


def _cosine(normal: np.ndarray) -> Gaussians:
    shape = normal.shape[:-1]
    return Gaussians(normal, np.full(shape, COSINE_SHARPNESS), np.full(shape, COSINE_AMPLITUDE))
