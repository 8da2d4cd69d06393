"""An environment's fields under a kernel that turns about each direction: rows against rows, columns by Fourier.

A kernel of the angle alone is, between two rows of a latitude-longitude map, a circular convolution along columns. So a
map costs (rows within the kernel's reach) x (rows) products of spectra, and every weight stays as positive as it was.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.fft import dct
from scipy.ndimage import map_coordinates, spline_filter

from ..vectors import Number
from . import latlong

#: A kernel: its value at cosines of the angle to its axis. It may be scaled as it likes: means are taken.
Kernel = Callable[[np.ndarray], np.ndarray]
#: Rows and columns that a map is continued by before splines are fitted to it; their response has died away by then.
MARGIN = 12


def convolved(
    fields: Float[np.ndarray, "K H W"], kernel: Kernel, reach: float, rows: int
) -> Float[np.ndarray, "K rows columns"]:
    """Return the mean of each field under the kernel about the middles of the texels of a map of `rows` and 2 `rows`
    columns.

    reach : rad, beyond which the kernel counts as 0. Texels count at their middles, by their solid angle.
    """
    number, height, width = fields.shape
    if width % 2:
        # An even kernel's spectrum needs both halves of the circle to be alike.
        fields, width = np.repeat(fields, 2, axis=2), 2 * width
    columns = 2 * rows
    weights = latlong.solid_angles(height, width)
    kept = min(width, columns) // 2 + 1
    waves = (np.fft.rfft(fields, axis=2) * weights[:, None])[:, :, :kept]
    # Real and imaginary parts as fields of their own: the kernel's spectrum is real.
    parts = np.stack([waves.real, waves.imag], axis=1).reshape(2 * number, height, kept)
    polar = np.pi * (np.arange(height) + 0.5) / height
    cosine, sine = np.cos(polar), np.sin(polar)
    around = np.cos(2.0 * np.pi * np.arange(width // 2 + 1) / width)
    # Middles of texels lie half a texel from the edge in both maps.
    shift = np.exp(1j * np.arange(kept) * np.pi * (1.0 / columns - 1.0 / width)) * (columns / width)
    means = np.empty((2 * number, rows, kept))
    for row in range((rows + 1) // 2):
        angle = np.pi * (row + 0.5) / rows
        first, last = np.searchsorted(polar, [angle - reach, angle + reach])
        # At least the two rows beside: a kernel narrower than a texel still finds one.
        first, last = max(0, min(first, last - 2)), min(height, max(last, first + 2))
        near = slice(first, last)
        cosines = np.cos(angle) * cosine[near, None] + np.sin(angle) * sine[near, None] * around
        spectrum = np.asarray(dct(kernel(cosines), type=1, axis=1))
        total = spectrum[:, 0] @ weights[near]
        spectrum = spectrum[:, :kept] / total
        means[:, row] = np.einsum("bm,kbm->km", spectrum, parts[:, near])
        # South as north: the same kernel over the rows counted from the other end.
        means[:, rows - 1 - row] = np.einsum("bm,kbm->km", spectrum, parts[:, ::-1][:, near])
    found = np.zeros((number, rows, columns // 2 + 1), dtype=np.complex128)
    found[:, :, :kept] = (means[::2] + 1j * means[1::2]) * shift
    return np.fft.irfft(found, n=columns, axis=2)


def smooth_between_texels(
    fields: Float[np.ndarray, "K H W"], to: Float[np.ndarray, "*n 3"]
) -> Float[np.ndarray, "*n K"]:
    """Smooth fields in directions, by cubic splines through the middles of texels and over the poles; W is even.

    Where fields that are nowhere negative come out below 0, by the splines' own error, 0 is taken.
    """
    height, width = fields.shape[1:]
    over = min(MARGIN, height)
    turned = np.roll(fields, width // 2, axis=2)
    tall = np.concatenate([turned[:, :over][:, ::-1], fields, turned[:, -over:][:, ::-1]], axis=1)
    tall = np.pad(tall, ((0, 0), (0, 0), (MARGIN, MARGIN)), mode="wrap")
    rows, columns = latlong.places(to)
    at = np.stack([rows * height - 0.5 + over, columns * width - 0.5 + MARGIN])
    smooth = [map_coordinates(spline_filter(field), at, prefilter=False, mode="nearest") for field in tall]
    least = np.where(fields.min(axis=(1, 2)) < 0.0, -np.inf, 0.0)
    return np.maximum(np.stack(smooth, axis=-1), least)


def half_size(fields: Float[np.ndarray, "K H W"]) -> Float[np.ndarray, "K h w"]:
    """Means of two by two texels, by solid angle."""
    height, width = fields.shape[1:]
    weights = latlong.solid_angles(height, width)[:, None]
    sums = (fields * weights).reshape(len(fields), height // 2, 2, width // 2, 2).sum(axis=(2, 4))
    return sums / latlong.solid_angles(height // 2, width // 2)[:, None]


def _finer(fields: Float[np.ndarray, "K H W"], factor: int) -> Float[np.ndarray, "K h w"]:
    """`factor` times as many rows and columns, linear between the middles of texels."""
    height, width = (factor * side for side in fields.shape[1:])
    to = latlong.texel_directions(height, width)
    return np.moveaxis(latlong.between_texels(fields, to.reshape(-1, 3)), -1, 0).reshape(len(fields), height, width)


class Resolutions:
    """A map at as many rows as are asked for; each resolution is made once."""

    def __init__(self, fields: Float[np.ndarray, "K H W"]) -> None:
        self._halves = [fields]
        while not any(side % 2 for side in self._halves[-1].shape[1:]):
            self._halves.append(half_size(self._halves[-1]))
        self._finer: dict[int, np.ndarray] = {}

    def at_least(self, rows: Number) -> Float[np.ndarray, "K h w"]:
        """Return the coarsest resolution that has so many rows, of the map, its halves and its powers of two."""
        fields = self._halves[0]
        factor = 1 << max(0, int(np.ceil(np.log2(rows / fields.shape[1]))))
        if factor == 1:
            return next(half for half in reversed(self._halves) if half.shape[1] >= rows)
        # Not by doubling twice: that is another curve between the texels than the map's own.
        if factor not in self._finer:
            self._finer[factor] = _finer(fields, factor)
        return self._finer[factor]
