"""A family's members as sums of few functions of both directions: what light that is passed on is reflected by.

Sun et al. 2007 (sections 3.1 and 4.3): light that bounces needs neither light nor view apart, so that no disc and no
product of factors stands between; P principal components of the members are tabulated as they are, narrow highlights
and all. The paper takes four, beside a matt one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .families import Family

#: Components of the highlight; the matt one is no member of the family.
COMPONENTS = 4
# Nodes along the half angle, the difference angle, and how far the plane of both is turned.
_NODES = (96, 14, 7)
# Cosine of the flattest light and view: flatter ones are as this.
_FLATTEST = 0.02


@dataclass(frozen=True, eq=False)
class Components:
    """P functions that members are sums of.

    table (A,B,C,P) : float32, over a = (1 - cos theta_h)^(1/4), b = 1 - cos theta_d and c = |cos phi_d|, evenly from 0
    to 1: f_r, 1/sr, where the family depends on theta_h alone, so that B = C = 1; else f_r cos(theta_i) cos(theta_o),
    which stays finite at the horizon. by_member (N,P) : what each member takes of each. error : squared, relative.
    """

    table: Float[np.ndarray, "A B C P"]
    by_member: Float[np.ndarray, "N P"]
    error: float

    def values(self, wi: Float[np.ndarray, "*n 3"], wo: Float[np.ndarray, "*#n 3"]) -> Float[np.ndarray, "*n P"]:
        """Return all functions at pairs of unit directions above the horizon, 1/sr; float32, linear between nodes."""
        sizes = self.table.shape[:3]
        places = coordinates(wi, wo)
        lows, shares = [], []
        for place, size in zip(places, sizes, strict=True):
            scaled = place * (size - 1)
            low = np.minimum(scaled.astype(np.int64), max(size - 2, 0))
            lows.append(low)
            shares.append((scaled - low).astype(np.float32)[..., None])
        flat = self.table.reshape(-1, self.table.shape[3])
        first = (lows[0] * sizes[1] + lows[1]) * sizes[2] + lows[2]
        steps = (sizes[1] * sizes[2], sizes[2], 1)
        found = np.zeros((*first.shape, flat.shape[1]), dtype=np.float32)
        for corner in range(8):
            up = [corner >> axis & 1 for axis in range(3)]
            # Along an axis of one node there is nothing to mix.
            if any(one and size == 1 for one, size in zip(up, sizes, strict=True)):
                continue
            share = np.float32(1.0)
            for one, size, part in zip(up, sizes, shares, strict=True):
                share = share * (1.0 if size == 1 else part if one else 1.0 - part)
            found += share * flat[first + sum(one * step for one, step in zip(up, steps, strict=True))]
        if sizes[1] > 1:
            found /= (np.maximum(wi[..., 2], _FLATTEST) * np.maximum(wo[..., 2], _FLATTEST)).astype(np.float32)[
                ..., None
            ]
        return found


def components_of(family: Family, count: int = COMPONENTS) -> Components:
    """Return the principal components of all members, as the cosines of light and view weigh them on a sphere.

    Their own singular values are in `by_member`; the sign of each function's largest number is positive.
    """
    nodes = tuple(1 if axis and family.half_only else size for axis, size in enumerate(_NODES))
    a, b, c = np.meshgrid(*(np.linspace(0.0, 1.0, size) if size > 1 else np.zeros(1) for size in nodes), indexing="ij")
    cosine, sine = 1.0 - a**4, np.sqrt(np.maximum(1.0 - (1.0 - a**4) ** 2, 0.0))
    difference, apart = 1.0 - b, np.sqrt(np.maximum(1.0 - (1.0 - b) ** 2, 0.0))
    # The difference vector about the half vector, which leans from the normal in the x-z plane.
    along, across = apart * c, apart * np.sqrt(np.maximum(1.0 - c * c, 0.0))
    pairs = []
    for sign in (1.0, -1.0):
        x, y, z = sign * along, sign * across, difference
        pairs.append(np.stack([x * cosine + z * sine, y, z * cosine - x * sine], axis=-1).reshape(-1, 3))
    wi, wo = pairs
    cosines = np.maximum(wi[:, 2], 0.0) * np.maximum(wo[:, 2], 0.0)
    above = np.flatnonzero(cosines > 0.0)
    values = np.zeros((len(family), len(wi)))
    values[:, above] = family.values(wi[above], wo[above])
    # Solid angle of the half vector, sin(theta_h) d theta_h = 4 a^3 da; that of the difference vector is even in b.
    root = np.sqrt(4.0 * a.ravel() ** 3 * cosines)
    used = root > 0.0
    seen = values[:, used] * root[used]
    # Each member counts alike: those that are narrow or bright would rule over all others.
    length = np.linalg.norm(seen, axis=1)
    left, size, _ = np.linalg.svd(seen / length[:, None], full_matrices=False)
    count = min(count, len(size))
    mixed = left[:, :count].T / size[:count, None] / length
    table = mixed @ (values if family.half_only else values * cosines)
    sign = np.sign(table[np.arange(count), np.abs(table).argmax(axis=1)])
    error = float(np.sum(size[count:] ** 2) / np.sum(size**2))
    table = (table * sign[:, None]).T.reshape(*nodes, count).astype(np.float32)
    return Components(np.ascontiguousarray(table), length[:, None] * left[:, :count] * (size[:count] * sign), error)


def coordinates(
    wi: Float[np.ndarray, "*n 3"], wo: Float[np.ndarray, "*#n 3"]
) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """(1 - cos theta_h)^(1/4), 1 - cos theta_d and |cos phi_d|, none of which needs an angle."""
    half, apart = wi + wo, wi - wo
    long = np.sqrt(np.sum(half * half, axis=-1))
    sine = np.minimum(0.5 * np.sqrt(np.sum(apart * apart, axis=-1)), 1.0)
    cosine = np.clip(half[..., 2] / long, 0.0, 1.0)
    # cos theta_i - cos theta_o = -2 sin(theta_h) sin(theta_d) cos(phi_d): where either sine is 0, no phi_d counts.
    most = 2.0 * np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)) * sine
    turned = np.divide(np.abs(apart[..., 2]), most, out=np.zeros_like(most), where=most > 0.0)
    return np.sqrt(np.sqrt(1.0 - cosine)), 1.0 - 0.5 * long, np.minimum(turned, 1.0)
