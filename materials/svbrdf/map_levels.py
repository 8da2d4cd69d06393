"""Mip levels of surfaces of maps: the joint scattering of many texels.

Colours and normals are averaged. The variation of normals widens the highlight of their mean (Toksvig 2005; Olano and
Baker 2010) by 1.5 times their covariance: 2 would be right for Beckmann's facets, GGX has its tails already. Along the
axis of largest variation two highlights, one standard deviation to either side, replace a wider one: a few normals
resemble two more than many. On brick, over 8 x 8 texels with alpha 0.2, ΔE94 is 0.07 on average and 0.76 at the 99th
percentile, against 0.22 and 2.07 with one highlight. Roughness is averaged in the logarithm, since the narrow
highlights among many are the visible ones.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from .facets import facets, turned_to
from .stretched import axes_of
from .texels import levels_of

#: Factor of the covariance of normals. Measured on brick, as it is and made smoother: 1 to 2 are alike, less leaves out
#: sparkles and more blurs.
WIDENED = 1.5


def normals_from_afar(lean: Float[np.ndarray, "H W 2"]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Compute for each level the mean of unit normals (H,W,3), and how much it widens the spread (H,W,3)."""
    x, y = lean[..., 0], lean[..., 1]
    up = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    levels = levels_of(np.stack([x, y, up, x * x, x * y, y * y], axis=-1))
    means = [level[..., :3] for level in levels]
    return means, [
        np.zeros_like(means[0]),
        *(wider(level.reshape(-1, 6)).reshape(*level.shape[:2], 3) for level in levels[1:]),
    ]


def wider(moments: Float[np.ndarray, "N 6"]) -> Float[np.ndarray, "N 3"]:
    """Compute how much the variation of normals widens the spread about their mean, in its frame.

    moments : means of x, y, z, xx, xy and yy.
    """
    x, y, z, xx, xy, yy = np.moveaxis(moments, -1, 0)
    mean = np.stack([x, y, z], axis=-1)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    # A step (dx, dy) of the normal takes it along its own tangent plane.
    flat = np.maximum(mean[:, 2], 1e-3)
    one, zero = np.ones(len(mean)), np.zeros(len(mean))
    (along,) = turned_to(mean, np.stack([one, zero, -mean[:, 0] / flat], axis=-1))
    (across,) = turned_to(mean, np.stack([zero, one, -mean[:, 1] / flat], axis=-1))
    turn = np.stack([along[:, :2], across[:, :2]], axis=-1)
    covariance = np.stack([np.stack([xx - x * x, xy - x * y], -1), np.stack([xy - x * y, yy - y * y], -1)], -1)
    found = WIDENED * turn @ covariance @ turn.swapaxes(1, 2)
    # Equal normals leave rounding, which may be negative.
    a, b, c = np.maximum(found[:, 0, 0], 0.0), found[:, 0, 1], np.maximum(found[:, 1, 1], 0.0)
    most = np.sqrt(a * c)
    return np.stack([a, np.clip(b, -most, most), c], axis=-1)


def facets_apart(
    wi: Float[np.ndarray, "N 3"],
    wo: Float[np.ndarray, "N 3"],
    spread: Float[np.ndarray, "N 3"],
    differ: Float[np.ndarray, "N 3"],
) -> Float[np.ndarray, " N"]:
    """Evaluate `facets` times cos(theta_i) about varying normals, for directions above their mean, in its frame.

    differ : `wider` of the normals.
    """
    wide, narrow, axis = axes_of(differ)
    along, across = np.moveaxis(axis, -1, 0)
    rest = (narrow**2)[:, None] * np.stack([across * across, -along * across, along * along], axis=1)
    total = np.zeros(len(wi))
    for side in (1.0, -1.0):
        slope = side * wide / np.sqrt(WIDENED)
        normal = np.stack([slope * along, slope * across, np.ones_like(slope)], axis=1)
        to_light, to_viewer = turned_to(normal / np.linalg.norm(normal, axis=1, keepdims=True), wi, wo)
        lit = (to_light[:, 2] > 0.0) & (to_viewer[:, 2] > 0.0)
        to_light, to_viewer = (np.where(lit[:, None], w, (0.0, 0.0, 1.0)) for w in (to_light, to_viewer))
        total += 0.5 * lit * facets(to_light, to_viewer, spread + rest) * to_light[:, 2]
    return total


def spread_from_afar(spread: Float[np.ndarray, "H W 3"]) -> list[Float[np.ndarray, "_ _ 3"]]:
    """Compute for each level the mean of S in the matrix logarithm."""
    levels = levels_of(_function_of(spread, np.log))
    return [spread, *(_function_of(level, np.exp) for level in levels[1:])]


def coat_from_afar(
    spread: Float[np.ndarray, "H W 1"], coat: Float[np.ndarray, "H W 1"]
) -> list[Float[np.ndarray, "_ _ 1"]]:
    """Compute for each level the logarithmic mean of a coat's alpha^2, texels weighted by their share of a coat."""
    levels = levels_of(np.concatenate([coat * np.log(spread), coat, np.log(spread)], axis=-1))
    found = [spread]
    for level in levels[1:]:
        some = level[..., 1:2] > 0.0
        # Placeholder without a coat, where its weight is 0.
        mean = np.where(some, level[..., :1], level[..., 2:]) / np.where(some, level[..., 1:2], 1.0)
        found.append(np.exp(mean))
    return found


def _function_of(spread: np.ndarray, function: np.ufunc) -> np.ndarray:
    """Apply a function to symmetric matrices (a, b, c), by their eigenvalues."""
    a, b, c = np.moveaxis(spread, -1, 0)
    middle, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    # The smaller one by the determinant, since the difference loses its digits.
    smaller = (a * c - b * b) / (middle + half) if function is np.log else middle - half
    high, low = function(middle + half), function(smaller)
    slope = np.divide(high - low, 2.0 * half, out=np.zeros_like(half), where=half > 0)
    level = 0.5 * (high + low)
    return np.stack([level + slope * 0.5 * (a - c), slope * b, level - slope * 0.5 * (a - c)], axis=-1)
