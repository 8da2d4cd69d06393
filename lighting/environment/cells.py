"""Partition of an environment into a few hundred cells of directions: small where it is bright, large where it is dark.

A quadtree over an octahedral map, from `COARSEST` to `FINEST` squares a side: a square is divided while its light times
its angular width exceeds a bound, which is chosen to give the wanted number of cells. Occlusion is then evaluated for
each cell, and no light is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from . import latlong, octahedral
from .environment import EnvironmentLight

#: Squares along a side of the map: of the largest cells and of the smallest, 1.4 degrees wide. A power of 2 apart.
COARSEST, FINEST = 8, 128
# Halvings of the bound's logarithm, from a billionth of all light.
_STEPS = 30


@dataclass(frozen=True, eq=False)
class Cells:
    """P cells of directions of the world.

    directions (P, 3) : unit, the centroid of the light in a cell. solid_angles (P,) : sr, 4 pi in all.
    of (texels,) : the cell of each texel of the environment's map, row by row.
    """

    directions: Float[np.ndarray, "P 3"]
    solid_angles: Float[np.ndarray, " P"]
    of: Int[np.ndarray, " texels"]

    def sums(self, values: Float[np.ndarray, "texels K"]) -> Float[np.ndarray, "P K"]:
        """Sum the texels of each cell."""
        count = len(self.solid_angles)
        return np.stack([np.bincount(self.of, weights=one, minlength=count) for one in values.T], axis=1)


def cells_of(environment: EnvironmentLight, count: int) -> Cells:
    """Divide an environment into at most `count` cells, or the `COARSEST`^2 minimum; each has at least one texel."""
    height, width = environment.fields.shape[1:]
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ environment.world_from_map.T
    angles = np.repeat(latlong.solid_angles(height, width), width)
    light = environment.fields.sum(axis=0).ravel() * angles
    column, row = (
        np.minimum(((each + 1.0) * (0.5 * FINEST)).astype(np.int64), FINEST - 1) for each in octahedral.places(to)
    )
    square = row * FINEST + column
    levels = [np.stack([np.bincount(square, weights=each, minlength=FINEST**2) for each in (light, angles)], axis=1)]
    levels = [levels[0].reshape(FINEST, FINEST, 2)]
    while len(levels[-1]) > COARSEST:
        half = len(levels[-1]) // 2
        levels.append(levels[-1].reshape(half, 2, half, 2, 2).sum(axis=(1, 3)))
    worth = [level[..., 0] * np.sqrt(level[..., 1]) for level in levels[::-1]]

    high = float(worth[0].max())
    low = 1e-9 * high
    for _ in range(_STEPS):
        middle = float(np.sqrt(low * high))
        if sum(int(whole.sum()) for whole in _whole(worth, middle)) > count:
            low = middle
        else:
            high = middle
    labels, first = np.full((FINEST, FINEST), -1), 0
    for whole in _whole(worth, high):
        numbers = np.where(whole, first - 1 + np.cumsum(whole).reshape(whole.shape), -1)
        labels, first = np.maximum(labels, _finer(numbers, FINEST // len(whole))), first + int(whole.sum())
    # Squares between the texels of a coarse map hold none, and get no number.
    of = np.unique(labels.ravel()[square], return_inverse=True)[1].reshape(-1)
    # A dark cell is centred on its texels, by solid angle.
    weight = light + 1e-6 * (light.sum() or 1.0) * angles
    middles = np.stack([np.bincount(of, weights=each * weight) for each in to.T], axis=1)
    return Cells(middles / np.linalg.norm(middles, axis=1, keepdims=True), np.bincount(of, weights=angles), of)


def _whole(worth: list[np.ndarray], bound: float) -> list[Bool[np.ndarray, "side side"]]:
    """Select the squares of each level that are cells, coarsest level first."""
    there, found = np.ones(worth[0].shape, dtype=bool), []
    for number, each in enumerate(worth):
        last = number == len(worth) - 1
        whole = there if last else there & (each <= bound)
        found.append(whole)
        if not last:
            there = _finer(there & ~whole, 2)
    return found


def _finer(values: np.ndarray, times: int) -> np.ndarray:
    return np.repeat(np.repeat(values, times, axis=0), times, axis=1)
