"""Direction pairs distributed as in pictures, and all over the hemispheres: quasi-random, even, reproducible by seed.

Points all over spheres, orthographic, under lights at every angle from the view.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..core.directions import spherical

#: Lights stand at most this far from the view, radians.
FARTHEST_LIGHT = np.radians(150.0)
#: Lights beyond this angle from the view light a surface from behind, radians.
BEHIND = np.radians(117.0)
# Weight of a pair lit from behind: surfaces show few such points, and an error may be larger there.
_BACK_SHARE = 0.25
# The least cosine of the light's angle from the normal.
_LEAST_LIGHT_COSINE = 0.003
# The least cosine of the view's angle from the normal.
_LEAST_VIEW_COSINE = 1e-4
# Views with a smaller cosine than this, the outermost 0.3 % of a sphere's picture, count by the square of their cosine
# over it: measured radiance rises as its reciprocal there, and errors that no percentile shows would rule the fit.
_LIMB_COSINE = 0.05
# Share of the pairs that crowd about the mirror direction.
_MIRROR = 0.35
# Share of the pairs that crowd towards the edge of the sphere.
_EDGE = 0.25
# The least that a pair counts.
_LEAST_IMPORTANCE = 0.01
# Pairs drawn all over the hemispheres, as a share of the others; each counts four times the least. Pictures show them
# so rarely that nothing else would keep terms from cancelling there, and one that does not is a speck of any colour.
_ANYWHERE = 0.15
# Polar angles end this far before the horizon, radians.
_HORIZON_MARGIN = 1e-3


def seen_pairs(
    count: int, seed: int, isotropic: bool
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """Generate wi, wo and weights of points on spheres under lights at every angle from the view.

    Of `count` pairs drawn, those above the horizon; then some all over both hemispheres (`anywhere_pairs`).

    Some pairs crowd about the mirror direction, on a square-root scale of theta_h, and some towards the edge, with
    lower weights: this covers highlights of few pixels and grazing views too. `seed` determines the first point; none
    is ever a pixel of the protocol.
    """
    u = _even_points(count, 5, seed)
    away, turn = FARTHEST_LIGHT * u[:, 0], 2.0 * np.pi * u[:, 3]
    light = np.stack([np.sin(away), np.zeros(count), np.cos(away)], axis=-1)
    middle = np.stack([np.sin(0.5 * away), np.zeros(count), np.cos(0.5 * away)], axis=-1)
    across = np.stack([middle[:, 2], np.zeros(count), -middle[:, 0]], axis=-1)
    around = 2.0 * np.pi * u[:, 2]
    cosine, sine = np.cos(around)[:, None], np.sin(around)[:, None]
    # Uniform over the disk, or over the hemisphere above it.
    edge = (u[:, 4] > 1.0 - _EDGE)[:, None]
    radius = np.where(edge, np.sqrt(1.0 - u[:, 1:2] ** 2), np.sqrt(u[:, 1:2]))
    anywhere = np.hstack([radius * cosine, radius * sine, np.sqrt(1.0 - radius**2)])
    theta = (0.5 * np.pi * u[:, 1] ** 2)[:, None]
    mirror = np.cos(theta) * middle + np.sin(theta) * (cosine * across + sine * np.array([0.0, 1.0, 0.0]))
    normal = np.where((u[:, 4] < _MIRROR)[:, None], mirror, anywhere)
    importance = _importance(normal, middle) * np.where(away > BEHIND, _BACK_SHARE, 1.0)
    lit = (np.sum(normal * light, axis=-1) > _LEAST_LIGHT_COSINE) & (normal[:, 2] > _LEAST_VIEW_COSINE)
    normal, light, turn = normal[lit], light[lit], turn[lit]
    tangent = np.stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]], axis=-1)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    other = np.cross(normal, tangent)
    if not isotropic:
        cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
        tangent, other = cosine * tangent + sine * other, cosine * other - sine * tangent
    frame = np.stack([tangent, other, normal], axis=1)
    wi, wo = anywhere_pairs(int(_ANYWHERE * count), seed, isotropic)
    wo = np.concatenate([frame[:, :, 2], wo])
    importance = np.concatenate([importance[lit], np.full(len(wi), 4.0 * _LEAST_IMPORTANCE)])
    limb = np.minimum(wo[:, 2] / _LIMB_COSINE, 1.0) ** 2
    return np.concatenate([np.einsum("nij,nj->ni", frame, light), wi]), wo, limb * importance


def everywhere_angles(
    count: int, seed: int, isotropic: bool
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Generate theta_i, theta_o, phi_o - phi_i and phi_i (0 if isotropic) all over both hemispheres, in radians.

    Even in theta_i and theta_o, denser towards the plane of incidence on either side; a third of them denser towards
    the mirror direction, and a third towards the horizon.
    """
    u = _even_points(count, 5, seed)
    right = 0.5 * np.pi
    theta_i, theta_o = right * u[:, 0], right * u[:, 1]
    phi = right * (1.0 - np.cos(2.0 * np.pi * u[:, 2]))
    mirror, grazing = u[:, 4] < 1.0 / 3.0, u[:, 4] > 2.0 / 3.0
    theta_o = np.where(mirror, theta_i + right * (2.0 * u[:, 1] - 1.0) ** 3, theta_o)
    phi = np.where(mirror, np.pi * (1.0 - u[:, 2] ** 3), phi)
    theta_i, theta_o = (np.where(grazing, right * (1.0 - u[:, k] ** 2), t) for k, t in ((0, theta_i), (1, theta_o)))
    theta_i, theta_o = (np.clip(theta, 0.0, right - _HORIZON_MARGIN) for theta in (theta_i, theta_o))
    phi = np.where(u[:, 2] < 0.5, phi, -phi)
    return theta_i, theta_o, phi, np.zeros(count) if isotropic else 2.0 * np.pi * u[:, 3]


def anywhere_pairs(count: int, seed: int, isotropic: bool) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Generate at most `count` wi and wo, even in theta_i and theta_o, denser towards the plane of incidence.

    Pairs of lights that no sample has (`FARTHEST_LIGHT`) are left out: there packs only keep within bounds.
    """
    u = _even_points(count, 4, seed)
    theta_i, theta_o = (np.minimum(0.5 * np.pi * u[:, k], 0.5 * np.pi - _HORIZON_MARGIN) for k in (0, 1))
    phi = 0.5 * np.pi * (1.0 - np.cos(2.0 * np.pi * u[:, 2]))
    phi = np.where(u[:, 2] < 0.5, phi, -phi)
    phi_i = np.zeros(count) if isotropic else 2.0 * np.pi * u[:, 3]
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_i + phi)
    near = np.sum(wi * wo, axis=-1) > np.cos(FARTHEST_LIGHT)
    return wi[near], wo[near]


def _importance(normal: Float[np.ndarray, "N 3"], middle: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Divide the density of a picture's normals by that of all three ways to draw them."""
    sine = np.linalg.norm(np.cross(normal, middle), axis=-1)
    theta = np.arctan2(sine, np.sum(normal * middle, axis=-1))
    shown = np.maximum(normal[:, 2], 0.0) / np.pi
    # theta = pi/2 u^2 has the density (2 pi theta)^(-1/2); over the circle that this leaves.
    circle = 2.0 * np.pi * np.maximum(sine, 1e-12)
    mirror = np.where(theta < 0.5 * np.pi, 1.0 / np.sqrt(2.0 * np.pi * np.maximum(theta, 1e-12)) / circle, 0.0)
    edge = np.where(normal[:, 2] > 0.0, 0.5 / np.pi, 0.0)
    drawn = (1.0 - _MIRROR - _EDGE) * shown + _MIRROR * mirror + _EDGE * edge
    return np.maximum(np.divide(shown, drawn, out=np.zeros_like(shown), where=drawn > 0), _LEAST_IMPORTANCE)


def _even_points(count: int, dimensions: int, seed: int) -> Float[np.ndarray, "n d"]:
    """Generate even points of the unit cube from a random first one, in powers of 1/g, g^(d+1) = g + 1.

    Roberts' sequence, a Kronecker sequence of the generalised golden ratio.
    """
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return np.mod(np.random.default_rng(seed).random(dimensions) + np.outer(np.arange(1, count + 1), steps), 1.0)
