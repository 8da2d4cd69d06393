"""Facets that are spread more along one axis than along the other, as several that are spread alike and lean that way.

Slopes of GGX whose widths are rho and 1 are nearly those of a few of its like that are as wide along as across, with
their middles on the wide axis. For each rho, middles, shares and widths are those of least Kullback-Leibler divergence,
over 3600 slopes that all count the same: what is left of it is a seventh (rho = 2) to a third (rho = 6) of what one
alone leaves. At rho = 1 one alone is exact.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

#: One in the middle, two near it and two farther off.
PARTS = 5
# Logarithms of rho.
_RATIOS = np.log([1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0])
# Of the near ones and the far ones: where their middles are, over the wide width.
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


def axes_of(
    spread: Float[np.ndarray, "N 3"],
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, "N 2"]]:
    """The wide and the narrow alpha of S (`facets`), and the unit direction of the wide one."""
    a, b, c = np.moveaxis(spread, -1, 0)
    half = np.hypot(0.5 * (a - c), b)
    wide = 0.5 * (a + c) + half
    # From the determinant: the difference would lose the digits of what is narrow. Rounding may take it below zero.
    narrow = np.divide(a * c - b * b, wide, out=np.zeros_like(wide), where=wide > 0.0)
    narrow = np.clip(narrow, 0.0, wide)
    # Of what is as wide along as across any direction will do.
    turn = 0.5 * np.arctan2(np.where(half > 0.0, 2.0 * b, 0.0), np.where(half > 0.0, a - c, 1.0))
    return np.sqrt(wide), np.sqrt(narrow), np.stack([np.cos(turn), np.sin(turn)], axis=1)


def parts_of(
    spread: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N P 3"], Float[np.ndarray, "N P"], Float[np.ndarray, "N P"]]:
    """Normals of the parts that lean (unit), their alphas, and what share of what is seen each of them is.

    spread : in the frame of `normal`, whose x is the surface's, made level (`facets.turned_to`). wo : towards the
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
