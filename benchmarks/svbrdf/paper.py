"""The paper's rendering of points (Wang et al. 2009, eqs. 36 to 43): lobes warped, multiplied, and looked up.

Terms come out, cd/m^2 under each of the light's K spectra: of the body, and of the facets at normal incidence and at
grazing. Spectra multiply them afterwards; the paper's own colours are RGB.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ...lighting.environment.brights import BrightParts
from ...materials.gaussians.gaussian import Gaussians, sphere_integral
from ...materials.gaussians.warp import warped
from .light import Gamma
from .surface import GlossySurface, ShadedPoints

#: What of a Gaussian about a direction a point sees: (points' numbers (M,), directions (M, 3) of the world, sharpness
#: (M,)) -> (M,) in [0, 1].
FreeShare = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
#: The clamped cosine as one lobe about the normal (eq. 40).
COSINE_SHARPNESS, COSINE_AMPLITUDE = 2.133, 1.170


def specular(
    surface: GlossySurface, points: ShadedPoints, gamma: Gamma, free_share: FreeShare | None, lobes: int
) -> Float[np.ndarray, "N K 2"]:
    """R_s (eq. 41): for each lobe the cosine, the slice and the visibility as one Gaussian, looked up in the light."""
    viewer = points.viewer[:, None, :]
    turned = warped(surface.lobes(lobes), viewer)
    smooth = surface.smooth(turned.axis, viewer)
    seen = turned.product(_cosine(np.array([0.0, 0.0, 1.0])))
    to, sharpness = points.world(seen.axis).reshape(-1, 3), seen.sharpness.ravel()
    number = np.repeat(np.arange(len(points)), seen.sharpness.shape[1])
    weight = seen.integral.ravel()
    if free_share is not None:
        weight = weight * free_share(number, to, sharpness)
    arrives = (gamma(to, sharpness) * weight[:, None]).reshape(*seen.sharpness.shape, -1)
    return np.einsum("nlk,nlr->nkr", arrives, smooth)


def diffuse(
    points: ShadedPoints, lights: BrightParts, free_share: FreeShare | None
) -> Float[np.ndarray, "N K"]:
    """R_d (eq. 39): the cosine's lobe times each of the light's, times what is free of the product; over pi."""
    cosine = _cosine(points.normals[:, None, :])
    product = cosine.product(Gaussians(lights.axis, lights.sharpness, np.ones(len(lights.sharpness))))
    weight = product.amplitude * sphere_integral(product.sharpness)
    if free_share is not None:
        number = np.repeat(np.arange(len(points)), len(lights.sharpness))
        free = free_share(number, product.axis.reshape(-1, 3), product.sharpness.ravel())
        weight = weight * free.reshape(weight.shape)
    return weight @ lights.amplitude / np.pi


def _cosine(normal: np.ndarray) -> Gaussians:
    one = np.ones(normal.shape[:-1])
    return Gaussians(normal, COSINE_SHARPNESS * one, COSINE_AMPLITUDE * one)
