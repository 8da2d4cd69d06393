"""Facets about a normal other than the surface's: GGX whose width is a matrix, which can be rotated and summed.

The facets' slopes m, against the plane of the normal, have the spread S = ((a, b), (b, c)); for isotropic roughness S =
alpha^2 times 1. D = 1 / (pi sqrt(det S) cos(theta_h)^4 (1 + m S^-1 m)^2), which for a diagonal S is GGX with two axes
(Burley 2012, eq. 13; Heitz 2014, eq. 85).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def turned_to(
    normal: Float[np.ndarray, "N 3"], *directions: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N 3"], ...]:
    """Transform directions from the surface's frame to that of a unit normal, whose x is the surface's, made level.

    Along (1, 0, 0) itself, where x cannot be made level, x is downwards: the limit of normals that lean so.
    """
    x, y, z = np.moveaxis(normal, -1, 0)
    across = np.hypot(y, z)
    leans = across > 0
    cos = np.divide(z, across, out=np.ones_like(x), where=leans)
    sin = np.divide(y, across, out=np.zeros_like(x), where=leans)
    found = []
    for w in directions:
        # The normal leans in the plane of y and z first: `up` is what is left of w along it.
        up = sin * w[:, 1] + cos * w[:, 2]
        level = across * w[:, 0] - x * up
        found.append(np.stack([level, cos * w[:, 1] - sin * w[:, 2], x * w[:, 0] + across * up], axis=-1))
    return tuple(found)


def upright(lean: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 3"]:
    """Complete x and y to unit normals."""
    up = np.sqrt(np.maximum(1.0 - np.sum(lean**2, axis=1, keepdims=True), 0.0))
    return np.concatenate([lean, up], axis=1)


def spread_of(alpha: Float[np.ndarray, "N 2"], turn: Float[np.ndarray, " N"] | None = None) -> Float[np.ndarray, "N 3"]:
    """Compute (a, b, c) of S from the roughness along x and along y, rotated by `turn` radians from x towards y."""
    along, across = np.moveaxis(alpha * alpha, -1, 0)
    if turn is None:
        return np.stack([along, np.zeros_like(along), across], axis=-1)
    cos, sin = np.cos(turn), np.sin(turn)
    return np.stack(
        [along * cos**2 + across * sin**2, (along - across) * cos * sin, along * sin**2 + across * cos**2], axis=-1
    )


def facets(
    wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"], spread: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, " N"]:
    """Evaluate D G / (4 cos(theta_i) cos(theta_o)) for directions above the horizon, in the facets' frame.

    G is the product of Smith's two one-sided terms (Walter et al. 2007, eq. 23; Heitz 2014, eq. 86).
    """
    a, b, c = np.moveaxis(spread, -1, 0)
    hx, hy, hz = np.moveaxis(wi + wo, -1, 0)
    length2 = hx * hx + hy * hy + hz * hz
    determinant = a * c - b * b
    level = (c * hx * hx - 2.0 * b * hx * hy + a * hy * hy) / determinant
    density = length2 * length2 / (np.pi * np.sqrt(determinant) * (hz * hz + level) ** 2)
    return density / (_seen(wi, a, b, c) * _seen(wo, a, b, c))


def _seen(w: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(w, -1, 0)
    return z + np.sqrt(z * z + a * x * x + 2.0 * b * x * y + c * y * y)
