"""Convolution of an environment's fields with a rotationally symmetric kernel: rows by summation, columns by Fourier
transform.

Between two rows of a latitude-longitude map a kernel of the angle alone is a circular convolution along columns. So a
map costs (rows within the kernel's reach) x (rows) products of spectra, and positive weights stay positive.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.fft import dct
from scipy.ndimage import map_coordinates, spline_filter

from ..vectors import Number
from . import latlong

#: Kernel: its value at cosines of the angle to its axis. Its scale does not matter, since results are normalised.
Kernel = Callable[[np.ndarray], np.ndarray]
#: Rows and columns of padding around a map before splines are fitted; their response to the edge has decayed there.
MARGIN = 12


def convolved(
    fields: Float[np.ndarray, "K H W"], kernel: Kernel, reach: float, rows: int
) -> Float[np.ndarray, "K rows columns"]:
    """Return the mean of each field under the kernel, at the texel centres of a map of `rows` x 2 `rows`.

    reach : rad; beyond it the kernel is 0. Texels are sampled at their centres and weighted by solid angle.
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
    """Interpolate smooth fields in directions, by cubic splines through texel centres and over the poles; W is even.

    Results of non-negative fields that undershoot 0, by the splines' error, are clamped to 0.
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
    """Average two by two texels, weighted by solid angle."""
    height, width = fields.shape[1:]
    weights = latlong.solid_angles(height, width)[:, None]
    sums = (fields * weights).reshape(len(fields), height // 2, 2, width // 2, 2).sum(axis=(2, 4))
    return sums / latlong.solid_angles(height // 2, width // 2)[:, None]


def _finer(fields: Float[np.ndarray, "K H W"], factor: int) -> Float[np.ndarray, "K h w"]:
    """Upsample to `factor` times as many rows and columns, linear between texel centres."""
    height, width = (factor * side for side in fields.shape[1:])
    to = latlong.texel_directions(height, width)
    return np.moveaxis(latlong.between_texels(fields, to.reshape(-1, 3)), -1, 0).reshape(len(fields), height, width)


class Resolutions:
    """Resolutions of a map; each is made once, on demand."""

    def __init__(self, fields: Float[np.ndarray, "K H W"]) -> None:
        self._halves = [fields]
        while not any(side % 2 for side in self._halves[-1].shape[1:]):
            self._halves.append(half_size(self._halves[-1]))
        self._finer: dict[int, np.ndarray] = {}

    def at_least(self, rows: Number) -> Float[np.ndarray, "K h w"]:
        """Return the coarsest resolution with at least `rows` rows: the map halved or enlarged by a power of two."""
        fields = self._halves[0]
        factor = 1 << max(0, int(np.ceil(np.log2(rows / fields.shape[1]))))
        if factor == 1:
            return next(half for half in reversed(self._halves) if half.shape[1] >= rows)
        # Not by doubling twice: that is another curve between the texels than the map's own.
        if factor not in self._finer:
            self._finer[factor] = _finer(fields, factor)
        return self._finer[factor]
