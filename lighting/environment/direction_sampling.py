"""Importance sampling of a latitude-longitude map, exact for luminance that is linear between texel centres.

A map that is linear between texels is a sum of tents, one about each texel centre. Sampling chooses a texel by its
flux, then a place under its tent; the density is linear between texels too, and luminance over density is almost
constant. The texel is found by halving the map repeatedly, along rows and columns in turn, so that stratified points of
the unit square become stratified directions in each bright part of the map (Clarberg, Jarosz, Akenine-Moeller and
Jensen, "Wavelet importance sampling", ACM Transactions on Graphics 24(3), 2005, section 4.2).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from . import latlong

# A sine of the angle to a pole that no direction's density is divided by less than.
_LEAST_SINE = 1e-12


class MapDrawing:
    """Importance sampler of directions in a map's own frame.

    Parameters
    ----------
    luminance : (H, W), finite, not negative; a black map is sampled uniformly.
    """

    def __init__(self, luminance: Float[np.ndarray, "H W"]) -> None:
        sends = luminance * latlong.solid_angles(*luminance.shape)[:, None]
        if not sends.any():
            sends = np.broadcast_to(latlong.solid_angles(*luminance.shape)[:, None], luminance.shape)
        self._shares = sends / sends.sum()
        height, width = luminance.shape
        padded = np.zeros((_power_of_two(height), _power_of_two(width)))
        padded[:height, :width] = self._shares
        self._levels = [padded]
        while self._levels[-1].size > 1:
            finer = self._levels[-1]
            rows, columns = finer.shape
            across = finer.reshape(rows, -1, 2).sum(axis=2) if columns >= rows else None
            self._levels.append(finer.reshape(-1, 2, columns).sum(axis=1) if across is None else across)
        self._levels.reverse()

    def drawn(self, uniform: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
        """Sample a unit direction for each pair of numbers in [0, 1)."""
        height, width = self._shares.shape
        row, column = np.zeros((2, len(uniform)), dtype=np.int64)
        down, right = uniform[:, 0], uniform[:, 1]
        for coarse, fine in zip(self._levels[:-1], self._levels[1:], strict=True):
            if fine.shape[1] > coarse.shape[1]:
                beyond, right = _halved(right, fine[row, 2 * column], fine[row, 2 * column + 1])
                column = 2 * column + beyond
            else:
                beyond, down = _halved(down, fine[2 * row, column], fine[2 * row + 1, column])
                row = 2 * row + beyond
        # Beyond a pole a tent folds back: the map is held constant there.
        rows = np.abs((row + 0.5 + _under_tent(down)) / height)
        return latlong.directions(np.where(rows > 1.0, 2.0 - rows, rows), (column + 0.5 + _under_tent(right)) / width)

    def density(self, to: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Return the probability density of `drawn` for unit directions, 1/sr."""
        return self.density_at(latlong.TexelWeights(to, *self._shares.shape), to)

    def density_at(self, places: latlong.TexelWeights, to: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Return the same, for directions whose places in the map are known."""
        sine = np.maximum(np.hypot(to[:, 0], to[:, 2]), _LEAST_SINE)
        return places.of(self._shares[None])[:, 0] * (self._shares.size / (2.0 * np.pi**2)) / sine


def _power_of_two(count: int) -> int:
    """Return the least power of two that is not below `count`."""
    return 1 << (count - 1).bit_length()


def _halved(
    place: Float[np.ndarray, " n"], near: Float[np.ndarray, " n"], far: Float[np.ndarray, " n"]
) -> tuple[np.ndarray, Float[np.ndarray, " n"]]:
    """Choose between two shares for each place in [0, 1): whether it falls to the far one, and its place within."""
    both = near + far
    border = near / np.where(both > 0.0, both, 1.0)
    beyond = (place >= border) & (far > 0.0)
    width = np.where(beyond, 1.0 - border, border)
    return beyond, np.where(beyond, place - border, place) / np.where(width > 0.0, width, 1.0)


def _under_tent(place: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Map uniform places in [0, 1] to [-1, 1] with the density 1 - |x|."""
    place = np.clip(place, 0.0, 1.0)
    return np.where(place < 0.5, np.sqrt(2.0 * place) - 1.0, 1.0 - np.sqrt(2.0 - 2.0 * place))
