"""Anisotropic facets, spread more along one axis, as a sum of several isotropic ones that lean along it.

GGX slopes of widths rho and 1 are approximated by a few isotropic GGX with centres on the wide axis. For each rho,
centres, shares and widths minimise the Kullback-Leibler divergence over 3600 slopes of equal weight: a seventh (rho =
2) to a third (rho = 6) of the divergence of a single one remains. At rho = 1 a single one is exact.

Leaning parts shadow each other less than the surface does, and the total reflection depends on the viewer: both are
corrected (`shadowed`, `sent_on`). Seen at 10 to 80 degrees, metals of alpha 0.49 and 0.09, 0.25 and 0.49, and 0.16 and
0.04 have ΔE94 1.00 on average and 2.9 at the 95th percentile, down from 1.38 and 4.0; at 80 degrees averages of 2.7,
0.9 and 1.5, down from 3.8, 1.5 and 2.8.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

#: Number of parts: one in the middle, two near it and two farther off.
PARTS = 5
# Logarithms of rho.
_RATIOS = np.log([1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0])
# Middles of the near and the far parts, over the wide width.
_MIDDLES = np.array(
    [
        [0.0, 0.62, 0.663, 0.671, 0.647, 0.596, 0.563, 0.521, 0.497, 0.467, 0.451],
        [0.0, 2.3, 2.259, 2.07, 1.866, 1.663, 1.554, 1.432, 1.364, 1.287, 1.245],
    ]
)
# The share of each near and of each far one; what is left is the middle one's.
_SHARES = np.array(
    [
        [0.17, 0.17, 0.1831, 0.2205, 0.2347, 0.2322, 0.2273, 0.2197, 0.2144, 0.2076, 0.2032],
        [0.02, 0.02, 0.0274, 0.0509, 0.083, 0.1164, 0.1341, 0.1543, 0.1663, 0.1809, 0.1895],
    ]
)
# Widths of the middle one, the near ones and the far ones, over the narrow width.
_WIDTHS = np.array(
    [
        [1.0, 0.93, 0.9, 0.854, 0.826, 0.858, 0.923, 1.076, 1.234, 1.554, 1.872],
        [1.0, 1.04, 1.057, 1.021, 0.999, 1.041, 1.12, 1.306, 1.501, 1.895, 2.291],
        [1.0, 1.9, 2.203, 2.15, 2.16, 2.348, 2.613, 3.221, 3.874, 5.24, 6.651],
    ]
)
#: For shaders: by rho two middles, two shares; three widths, and the logarithm of rho.
TABLE = np.concatenate([_MIDDLES, _SHARES, _WIDTHS, _RATIOS[None]]).T


# Height of a direction below which shadows are those there: a Gaussian about it reaches higher.
LEAST_HEIGHT = 0.02
# Half vectors that the viewer sees, as points of a disc: rings at Gauss' nodes for functions that end as a root does
# (Jacobi's polynomials in the root of 1 - r^2), and their weights; then the number of points on a ring.
RINGS = np.array(
    [
        [0.9990034, 0.9895243, 0.9579831, 0.8905868, 0.7781586, 0.6186185, 0.4175012, 0.1877331],
        [0.0065904, 0.0356858, 0.0908786, 0.1583992, 0.2120947, 0.2250116, 0.1822380, 0.0891016],
    ]
)
ROUND = 8


def axes_of(
    spread: Float[np.ndarray, "N 3"],
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, "N 2"]]:
    """Return the wide and the narrow alpha of S (`facets`), and the unit direction of the wide one."""
    a, b, c = np.moveaxis(spread, -1, 0)
    half = np.hypot(0.5 * (a - c), b)
    wide = 0.5 * (a + c) + half
    # From the determinant: the difference would lose the digits of the narrow width. Rounding may take it below zero.
    narrow = np.divide(a * c - b * b, wide, out=np.zeros_like(wide), where=wide > 0.0)
    narrow = np.clip(narrow, 0.0, wide)
    # A spread as wide along as across has no axis: any direction will do.
    turn = 0.5 * np.arctan2(np.where(half > 0.0, 2.0 * b, 0.0), np.where(half > 0.0, a - c, 1.0))
    return np.sqrt(wide), np.sqrt(narrow), np.stack([np.cos(turn), np.sin(turn)], axis=1)


def parts_of(
    spread: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N P 3"], Float[np.ndarray, "N P"], Float[np.ndarray, "N P"]]:
    """Compute the unit normals of the leaning parts, their alphas, and each one's share of the visible area.

    spread : in the frame of `normal`, whose x is the surface's, projected level (`facets.turned_to`). wo : towards the
    viewer; as `normal`, in the surface's frame.
    """
    wide, narrow, axis = axes_of(spread)
    ratio = np.minimum(np.log(wide / narrow), _RATIOS[-1])
    found = np.stack([np.interp(ratio, _RATIOS, column) for column in TABLE[:, :7].T], axis=1)
    near, far, of_near, of_far, *widths = found.T
    x, y, z = np.moveaxis(normal, -1, 0)
    across = np.hypot(y, z)
    leans = across > 0
    cos = np.divide(z, across, out=np.ones_like(x), where=leans)
    sin = np.divide(y, across, out=np.zeros_like(x), where=leans)
    level = axis[:, :1] * np.stack([across, -x * sin, -x * cos], axis=1)
    level += axis[:, 1:] * np.stack([np.zeros_like(x), cos, -sin], axis=1)
    slope = np.stack([np.zeros_like(near), near, -near, far, -far], axis=1) * wide[:, None]
    length = np.sqrt(1.0 + slope**2)
    normals = (normal[:, None] + slope[..., None] * level[:, None]) / length[..., None]
    shares = np.stack([1.0 - 2.0 * (of_near + of_far), of_near, of_near, of_far, of_far], axis=1)
    # A slope narrows as it leans; an area that leans is larger than its projection.
    alphas = np.stack([widths[0], widths[1], widths[1], widths[2], widths[2]], axis=1) * narrow[:, None] / length
    seen = shares * length * np.maximum(np.einsum("npi,ni->np", normals, wo), 0.0)
    whole = seen.sum(axis=1, keepdims=True)
    return normals, alphas, np.divide(seen, whole, out=np.zeros_like(seen), where=whole > 0.0)


def shadowed(w: Float[np.ndarray, "*#n 3"], spread: Float[np.ndarray, "*#n 3"]) -> Float[np.ndarray, "*_"]:
    """Evaluate Smith's one-sided term (Heitz 2014, eq. 43) in the facets' frame, from `LEAST_HEIGHT` upwards."""
    a, b, c = np.moveaxis(spread, -1, 0)
    x, y, z = np.moveaxis(w, -1, 0)
    z = np.maximum(z, LEAST_HEIGHT)
    return 2.0 * z / (z + np.sqrt(z * z + a * x * x + 2.0 * b * x * y + c * y * y))


def sent_on(
    wide: Float[np.ndarray, " N"],
    narrow: Float[np.ndarray, " N"],
    axis: Float[np.ndarray, "N 2"],
    wo: Float[np.ndarray, "N 3"],
) -> Float[np.ndarray, "N 2"]:
    """Approximate the fractions of 1 - fall and of the fall that facets of these alphas reflect, in their frame.

    The mean of Smith's term of the light, over visible half vectors (Heitz, "Sampling the GGX distribution of visible
    normals", JCGT 7(4), 2018).
    """
    x = axis[:, 0] * wo[:, 0] + axis[:, 1] * wo[:, 1]
    y = axis[:, 0] * wo[:, 1] - axis[:, 1] * wo[:, 0]
    to = np.stack([x, y, np.maximum(wo[:, 2], 1e-4)], axis=1)
    alphas = np.stack([wide, narrow], axis=1)
    up = np.concatenate([alphas * to[:, :2], to[:, 2:]], axis=1)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    across = np.hypot(up[:, 0], up[:, 1])
    leans = across > 1e-6
    flat = np.where(leans, across, 1.0)
    first = np.stack(
        [np.where(leans, -up[:, 1] / flat, 1.0), np.where(leans, up[:, 0] / flat, 0.0), 0.0 * flat], axis=1
    )
    second, half = np.cross(up, first), 0.5 * (1.0 + up[:, 2:])
    total = np.zeros((len(wo), 2))
    for radius, share in RINGS.T:
        for turn in (np.arange(ROUND) + 0.5) * 2.0 * np.pi / ROUND:
            along, over = radius * np.cos(turn), radius * np.sin(turn)
            over = (1.0 - half) * np.sqrt(1.0 - along * along) + half * over
            rest = np.sqrt(np.maximum(1.0 - along * along - over * over, 0.0))
            h = along * first + over * second + rest * up
            h = np.concatenate([alphas * h[:, :2], np.maximum(h[:, 2:], 1e-6)], axis=1)
            h /= np.linalg.norm(h, axis=1, keepdims=True)
            cosine = np.clip(np.sum(h * to, axis=1), 0.0, 1.0)
            wi = 2.0 * cosine[:, None] * h - to
            z = np.maximum(wi[:, 2], 0.0)
            level = np.sum((alphas * wi[:, :2]) ** 2, axis=1)
            seen = 2.0 * z / np.maximum(z + np.sqrt(z * z + level), 1e-12)
            fall = (1.0 - cosine) ** 5
            total += share / ROUND * np.stack([seen * (1.0 - fall), seen * fall], axis=1)
    return total
