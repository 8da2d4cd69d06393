"""Polygon of uniform luminance seen from a point: its share of a Gaussian, and the moments of its light on a surface.

Both are integrals over the polygon's edges. By Stokes' theorem the integral over a spherical polygon of a function that
is symmetric about an axis p is an integral over its edges (Arvo 1995 for powers of the cosine). For a spherical
Gaussian of sharpness lambda, minus its mean over the sphere, with t the angle along the great circle of each edge, d
the elevation of p above that circle and c = v . p = cos(d) cos(t),

    integral of G  =  Omega m  +  1 / lambda  sum over edges  sin(d) int h(c) / (1 - c^2) dt,
    m = (1 - exp(-2 lambda)) / (2 lambda),    h(c) = 1 - exp(-lambda (1 - c)) - (1 - exp(-2 lambda)) (1 - c) / 2,

where h(c) / (1 - c^2) is smooth everywhere, including at p and -p. The moments of light on a surface are the irradiance
tensors of Arvo 1995 (section 4), of degree one to three, in closed form.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from ..vectors import dot, unit

#: Nodes an edge: the share of a polygon under a Gaussian is good to 3e-4 of the Gaussian, on average to 3e-5.
NODES = 8
AT, WEIGHTS = np.polynomial.legendre.leggauss(NODES)
# 1 + c below which h(c) / (1 - c^2) has its value opposite the axis: its digits would be lost.
_OPPOSITE = 1e-6


def solid_angle(corners: Float[np.ndarray, "N C 3"]) -> Float[np.ndarray, " N"]:
    """Compute the solid angle of convex polygons, sr, positive for counter-clockwise corners: Van Oosterom and Strackee
    1983, eq. 8.

    corners : relative to the point, of any non-zero length.
    """
    to = unit(corners)
    first, total = to[:, 0], np.zeros(len(to))
    for k in range(1, to.shape[1] - 1):
        one, other = to[:, k], to[:, k + 1]
        volume = dot(first, np.cross(one, other))
        total += 2.0 * np.arctan2(volume, 1.0 + dot(first, one) + dot(one, other) + dot(other, first))
    return total


def gaussian_shares(
    corners: Float[np.ndarray, "N C 3"], axes: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
) -> Float[np.ndarray, "N Q"]:
    """Integrate normalised Gaussians over a convex polygon: 0 to 1.

    Parameters
    ----------
    corners : relative to each point, counter-clockwise as seen from it, of any non-zero length.
    axes, sharpness : unit directions, lambda > 0.
    """
    omega = solid_angle(corners)[:, None]
    whole = -np.expm1(-2.0 * sharpness)
    total, nearest = np.zeros_like(sharpness), np.full_like(sharpness, 2.0)
    for here, there in _edges(corners):
        cross = np.cross(here, there)
        length = np.linalg.norm(cross, axis=1)
        # An edge that points at the viewpoint spans no plane, and no angle.
        pole = cross / np.where(length > 0.0, length, 1.0)[:, None]
        spanned = np.arctan2(length, dot(here, there))[:, None]
        sine = np.clip(np.einsum("nqi,ni->nq", axes, pole), -1.0, 1.0)
        cosine = np.sqrt(1.0 - sine * sine)
        # Angle at which the edge begins on its great circle, from the point nearest to the axis.
        ahead = np.cross(pole, here)
        first = -np.arctan2(np.einsum("nqi,ni->nq", axes, ahead), np.einsum("nqi,ni->nq", axes, here))
        last = first + spanned
        # 1 - c, without cancellation.
        low = sine * sine / (1.0 + cosine)
        off = np.where((first <= 0.0) & (last >= 0.0), 0.0, np.minimum(np.abs(first), np.abs(last)))
        nearest = np.minimum(nearest, low + 2.0 * cosine * np.sin(0.5 * off) ** 2)
        # Nodes even in angle about the axis, or as even as its width allows: the integrand is about as broad.
        broad = np.sqrt(sine * sine + 1.0 / sharpness)
        from_, to = np.arctan(first / broad), np.arctan(last / broad)
        half, middle = 0.5 * (to - from_), 0.5 * (to + from_)
        found = np.zeros_like(total)
        for at, weight in zip(AT, WEIGHTS, strict=True):
            slope = np.tan(middle + half * at)
            y = low + 2.0 * cosine * np.sin(0.5 * broad * slope) ** 2
            found += weight * (1.0 + slope * slope) * _smooth(y, sharpness, whole)
        total += half * broad * sine * found
    share = omega / (4.0 * np.pi) + total / (2.0 * np.pi * whole)
    # At most the solid angle times the Gaussian's maximum on the polygon; this matters if the axis lies outside.
    inside = np.all([np.einsum("nqi,ni->nq", axes, np.cross(a, b)) >= 0.0 for a, b in _edges(corners)], axis=0)
    highest = np.where(inside, 1.0, np.exp(-sharpness * nearest))
    most = omega * highest * sharpness / (2.0 * np.pi * whole)
    return np.clip(share, 0.0, np.minimum(most, 1.0))


def _smooth(y: Float[np.ndarray, "N Q"], sharpness: Float[np.ndarray, "N Q"], whole: np.ndarray) -> np.ndarray:
    """Evaluate h(c) / (1 - c^2) at y = 1 - c."""
    fall = np.where(y > 0.0, -np.expm1(-sharpness * y) / np.where(y > 0.0, y, 1.0), sharpness)
    other = 2.0 - y
    opposite = (whole - 2.0 * sharpness * np.exp(-2.0 * sharpness)) / 4.0
    near = other > _OPPOSITE
    return np.where(near, (fall - 0.5 * whole) / np.where(near, other, 1.0), opposite)


def surface_moments(corners: Float[np.ndarray, "N C 3"]) -> Float[np.ndarray, "N 9"]:
    """Integrate cos(theta) times each of `materials.core.environment_form.bends` over the part of a convex polygon
    above a surface's horizon, sr: the moments for luminance 1.

    corners : relative to each point, in the surface's axes, the normal last; counter-clockwise as seen from the point.

    With m the inward normal of an edge's plane, and T0 and T1 the tensors of degree zero and one,
    3 T2_zj = delta_zj T0 + sum m_z int v_j dt and 4 T3_zjk = delta_zj T1_k + delta_zk T1_j + sum m_z int v_j v_k dt,
    each edge an arc v(t): Arvo 1995, section 4.
    """
    first = np.take_along_axis(corners, corners[..., 2].argmax(axis=1)[:, None, None], axis=1)[:, 0]
    t0, t1 = np.zeros(len(corners)), np.zeros((len(corners), 3))
    lines, squares = np.zeros((len(corners), 3)), np.zeros((len(corners), 3, 3))
    for start, end, there in _above_horizon(corners):
        cross = np.cross(start, end)
        length = np.linalg.norm(cross, axis=1)
        pole = (
            np.where(there & (length > 0.0), 1.0, 0.0)[:, None] * cross / np.where(length > 0.0, length, 1.0)[:, None]
        )
        angle = np.arctan2(length, dot(start, end))
        # The arc: along * cos(t) + ahead * sin(t).
        along = unit(np.where(there[:, None], start, 1.0))
        ahead = np.cross(pole, along)
        sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
        t0 += np.where(there, solid_angle(np.stack([first, start, end], axis=1)), 0.0)
        t1 += 0.5 * angle[:, None] * pole
        lines += pole[:, 2:] * (sine * along + (1.0 - cosine) * ahead)
        both = 0.5 * (angle[:, None] + sine * cosine), 0.5 * (angle[:, None] - sine * cosine), 0.5 * sine * sine
        mixed = along[:, :, None] * ahead[:, None]
        squares += pole[:, 2:, None] * (
            both[0][..., None] * along[:, :, None] * along[:, None]
            + both[1][..., None] * ahead[:, :, None] * ahead[:, None]
            + both[2][..., None] * (mixed + mixed.transpose(0, 2, 1))
        )
    z = np.array([0.0, 0.0, 1.0])
    square = (t0[:, None] * z + lines) / 3.0
    cube = (z[:, None] * t1[:, None] + t1[..., None] * z + squares) / 4.0
    xx, yy, zz = cube[:, 0, 0], cube[:, 1, 1], cube[:, 2, 2]
    columns = (t1[:, 2], square[:, 0], square[:, 1], square[:, 2], cube[:, 0, 1], cube[:, 1, 2], cube[:, 0, 2])
    return np.stack([*columns, xx - yy, 3.0 * zz - t1[:, 2]], axis=1)


def _edges(corners: Float[np.ndarray, "N C 3"]) -> list[tuple[np.ndarray, np.ndarray]]:
    count = corners.shape[1]
    return [(corners[:, k], corners[:, (k + 1) % count]) for k in range(count)]


def _above_horizon(corners: Float[np.ndarray, "N C 3"]) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield the edges of polygons clipped to z > 0: start, end, and a mask of the polygons that have it; the edge on
    the horizon comes last.
    """
    leaves, enters, crossed = np.ones((len(corners), 3)), np.ones((len(corners), 3)), np.zeros(len(corners), dtype=bool)
    for here, there in _edges(corners):
        up, next_up = here[:, 2] > 0.0, there[:, 2] > 0.0
        fall = here[:, 2] - there[:, 2]
        cut = here + (here[:, 2] / np.where(fall != 0.0, fall, 1.0))[:, None] * (there - here)
        cut[:, 2] = 0.0
        leaves = np.where((up & ~next_up)[:, None], cut, leaves)
        enters = np.where((~up & next_up)[:, None], cut, enters)
        crossed |= up != next_up
        yield np.where(up[:, None], here, cut), np.where(next_up[:, None], there, cut), up | next_up
    yield leaves, enters, crossed
