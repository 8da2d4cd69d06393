"""Directions and their angles: spherical, incident/outgoing ("io") and half/difference ("hd").

z is the normal, wi points to the light, wo to the viewer, all unit vectors of shape (..., 3). Angles come from atan2 of
lengths, never from acos of a dot product, which loses half the digits near the pole. At a pole, where the azimuth is
undefined, it is 0.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

Angle = Float[np.ndarray, "..."]
AngleLike = Angle | float | int
Direction = Float[np.ndarray, "... 3"]

TAU = 2.0 * np.pi


def spherical(theta: AngleLike, phi: AngleLike) -> Direction:
    """Compute the unit vector of polar angle `theta` from the normal and azimuth `phi` from x towards y, radians.

    >>> spherical(0.0, 0.0).tolist()
    [0.0, 0.0, 1.0]
    """
    theta, phi = np.broadcast_arrays(np.asarray(theta, dtype=float), np.asarray(phi, dtype=float))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def angles(w: Direction) -> tuple[Angle, Angle]:
    """Compute theta in [0, pi] and phi in [0, 2 pi) of `w`, of any length."""
    return _polar(w), _turn(np.arctan2(w[..., 1], w[..., 0]))


def azimuth_difference(wi: Direction, wo: Direction) -> Angle:
    """Compute phi_o - phi_i in [0, 2 pi), which an anisotropic io table needs beside phi_i."""
    return _turn(_signed_azimuth_difference(wi, wo))


def io_angles(wi: Direction, wo: Direction) -> tuple[Angle, Angle, Angle]:
    """Compute theta_i, theta_o and |phi_o - phi_i| folded into [0, pi].

    >>> wi, wo = spherical(0.3, 6.0), spherical(0.8, 0.25)
    >>> [round(float(angle), 9) for angle in io_angles(wi, wo)]
    [0.3, 0.8, 0.533185307]
    """
    return _polar(wi), _polar(wo), np.asarray(np.abs(_signed_azimuth_difference(wi, wo)))


def half_difference(wi: Direction, wo: Direction) -> tuple[Angle, Angle, Angle, Angle]:
    """Compute theta_h, theta_d, phi_d in [0, 2 pi) and phi_h in [0, 2 pi) (Rusinkiewicz 1998, section 3).

    h = normalise(wi + wo); the difference vector is wi rotated by -phi_h about the normal and by -theta_h about the
    bi-normal, so that h becomes the pole. Above the horizon theta_h < pi/2 and theta_d < pi/2.
    """
    h, d = wi + wo, wi - wo
    theta_h, phi_h = angles(h)
    # h and d are the diagonals of a rhombus: exact for near-retro and near-opposite pairs alike.
    theta_d = np.arctan2(_length(d), _length(h))
    tangent, binormal = _half_frame(theta_h, phi_h)
    # wi's part across h is d/2; taking d keeps phi_d exact where theta_d is small.
    phi_d = np.arctan2(np.sum(d * binormal, axis=-1), np.sum(d * tangent, axis=-1))
    return theta_h, np.asarray(theta_d), _turn(phi_d), phi_h


def io_from_half_difference(
    theta_h: AngleLike, theta_d: AngleLike, phi_d: AngleLike, phi_h: AngleLike = 0.0
) -> tuple[Direction, Direction]:
    """Compute the pair (wi, wo) of half/difference angles; either may be below the horizon.

    The angles broadcast. Exchanging wi and wo adds pi to phi_d; mirroring in the plane of h and the normal negates it.
    """
    theta_h, theta_d, phi_d, phi_h = np.broadcast_arrays(
        *(np.asarray(angle, dtype=float) for angle in (theta_h, theta_d, phi_d, phi_h))
    )
    tangent, binormal = _half_frame(theta_h, phi_h)
    along = np.cos(theta_d)[..., None] * spherical(theta_h, phi_h)
    across = np.cos(phi_d)[..., None] * tangent + np.sin(phi_d)[..., None] * binormal
    across *= np.sin(theta_d)[..., None]
    return along + across, along - across


def folded(phi: Angle) -> Angle:
    """Fold an azimuth in [0, 2 pi) into [0, pi], identifying the two sides of a mirror plane."""
    return np.asarray(np.minimum(phi, TAU - phi))


def _half_frame(theta_h: Angle, phi_h: Angle) -> tuple[Direction, Direction]:
    """Return the directions of increasing theta and phi at the half vector: x and y of the hd frame."""
    zero = np.zeros_like(phi_h)
    binormal = np.stack([-np.sin(phi_h), np.cos(phi_h), zero], axis=-1)
    return spherical(theta_h + 0.5 * np.pi, phi_h), binormal


def _polar(w: Direction) -> Angle:
    return np.asarray(np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2]))


def _signed_azimuth_difference(wi: Direction, wo: Direction) -> Angle:
    sine = wi[..., 0] * wo[..., 1] - wi[..., 1] * wo[..., 0]
    cosine = wi[..., 0] * wo[..., 0] + wi[..., 1] * wo[..., 1]
    return np.asarray(np.arctan2(sine, cosine))


def _length(v: Direction) -> Angle:
    return np.asarray(np.sqrt(np.sum(v * v, axis=-1)))


def _turn(phi: AngleLike) -> Angle:
    """Map an atan2 angle to [0, 2 pi); a tiny negative one, which would round to 2 pi, becomes 0."""
    turned = np.where(np.less(phi, 0), phi + TAU, phi)
    return np.where(turned >= TAU, 0.0, turned)
