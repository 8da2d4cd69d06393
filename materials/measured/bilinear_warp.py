"""Bilinear densities on the unit square, and the map from each to the uniform one.

A density d(x, y) at a grid of nodes defines a map of the square onto itself: y maps to the fraction of the density
below it, x to the fraction to its left within its own row. Both are integrals of a piecewise linear function: up to the
last node sums of trapezia, within the cell a quadratic. So the map is evaluated in closed form, without a search, and
to rounding error.

A family of densities over parameters (here the direction of the light) is interpolated linearly after each has been
normalised; fractions of an interpolated density are then the interpolated fractions.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

Slices = list[tuple[Int[np.ndarray, " N"], Float[np.ndarray, " N"]]]


class BilinearWarp:
    """Map of a family of densities.

    density : (S, H, W) at uniform nodes of [0, 1] x [0, 1]: H rows over y, W columns over x. Not negative, nowhere all
        zero; any scale.
    """

    def __init__(self, density: Float[np.ndarray, "S H W"]) -> None:
        density = density.astype(np.float64)
        left = _shares(density)
        below = _shares(left[..., -1])
        scale = 1.0 / below[:, -1]
        self.shape = density.shape[1:]
        self._density = (density * scale[:, None, None]).ravel()
        self._left = (left * scale[:, None, None]).ravel()
        self._row = (left[..., -1] * scale[:, None]).ravel()
        self._below = (below * scale[:, None]).ravel()

    def uniform(
        self, x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"], slices: Slices
    ) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
        """Warp (x, y) in [0, 1]^2; `slices` are densities of the family and their weights."""
        height, width = self.shape
        column, across = cell(x, width)
        row, up = cell(y, height)

        def mixed(table: np.ndarray, index: np.ndarray, stride: int) -> np.ndarray:
            return sum((share * table.take(which * stride + index) for which, share in slices), np.zeros(len(x)))

        corner, size = row * width + column, height * width
        near = (1.0 - up) * mixed(self._density, corner, size) + up * mixed(self._density, corner + width, size)
        far = (1.0 - up) * mixed(self._density, corner + 1, size) + up * mixed(self._density, corner + width + 1, size)
        left = (1.0 - up) * mixed(self._left, corner, size) + up * mixed(self._left, corner + width, size)
        left += across * (near + 0.5 * across * (far - near))
        lower, upper = mixed(self._row, row, height), mixed(self._row, row + 1, height)
        whole = (1.0 - up) * lower + up * upper
        # A row without any density has no shares: any place in it will do.
        share = np.divide(left, whole, out=x.astype(np.float64), where=whole > 0)
        below = mixed(self._below, row, height) + up * (lower + 0.5 * up * (upper - lower))
        return np.clip(share, 0.0, 1.0), np.clip(below, 0.0, 1.0)


def bilinear(
    table: Float[np.ndarray, "S H W C"], x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"], slices: Slices
) -> Float[np.ndarray, "N C"]:
    """Interpolate `table` between its nodes over the unit square, weighted over `slices`."""
    _, height, width, channels = table.shape
    flat = table.reshape(-1, channels)
    column, across = cell(x, width)
    row, up = cell(y, height)
    out = np.zeros((len(x), channels))
    for which, share in slices:
        corner = (which * height + row) * width + column
        out += (share * (1.0 - up) * (1.0 - across))[:, None] * flat.take(corner, axis=0)
        out += (share * (1.0 - up) * across)[:, None] * flat.take(corner + 1, axis=0)
        out += (share * up * (1.0 - across))[:, None] * flat.take(corner + width, axis=0)
        out += (share * up * across)[:, None] * flat.take(corner + width + 1, axis=0)
    return out


def cell(x: Float[np.ndarray, " N"], size: int) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return the node at or below x in [0, 1] of `size` uniform nodes (never the last), and the fraction beyond it."""
    place = np.clip(x, 0.0, 1.0) * (size - 1)
    node = np.minimum(place.astype(np.intp), size - 2)
    return node, place - node


def _shares(values: np.ndarray) -> np.ndarray:
    """Integrate from the first node to each along the last axis, by trapezia of width 1."""
    steps = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
    return np.concatenate([np.zeros_like(steps[..., :1]), steps], axis=-1)
