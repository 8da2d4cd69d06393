"""Quantisation of lobes: two bytes per axis, half a byte per exponent, a byte per amplitude.

Axes are stored by an octahedral map (Meyer et al. 2010), exact for the normal and the axes of the frame; exponents are
2^(i/2), as in the prefiltered environments of Meseth, Mueller and Klein 2003 (section 5.2); amplitudes follow a square
law, finer near 0, each relative to the largest of its kind.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int8, UInt8

# Steps from the middle of the square to its edge, and of an amplitude from 0 to the largest.
_SQUARE, _AMPLITUDE = 127, 127
# The first of the exponents' binary logarithms, which are half a unit apart.
_FIRST = -1.0
#: Exponents that can be kept; any lies between these.
EXPONENTS = tuple(2.0 ** (_FIRST + 0.5 * index) for index in range(16))
LEAST, MOST = EXPONENTS[0], EXPONENTS[-1]


def coded_axes(axes: Float[np.ndarray, "*n 3"]) -> UInt8[np.ndarray, "*n 2"]:
    """Encode unit vectors in two bytes each."""
    flat = axes / np.abs(axes).sum(axis=-1, keepdims=True)
    place = np.where(flat[..., 2:] < 0.0, _turned_out(flat[..., :2]), flat[..., :2])
    return (np.rint(place * _SQUARE) + _SQUARE).astype(np.uint8)


def decoded_axes(codes: UInt8[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 3"]:
    """Decode unit vectors of two bytes each; float32."""
    place = (codes.astype(np.float32) - _SQUARE) / np.float32(_SQUARE)
    up = 1.0 - np.abs(place).sum(axis=-1, keepdims=True)
    axes = np.concatenate([np.where(up < 0.0, _turned_out(place), place), up], axis=-1)
    return axes / np.linalg.norm(axes, axis=-1, keepdims=True)


def _turned_out(place: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
    """Fold the lower half of the octahedron outside the upper one, or back."""
    return (1.0 - np.abs(place[..., ::-1])) * np.where(place < 0.0, -1.0, 1.0).astype(place.dtype)


def coded_exponents(exponents: Float[np.ndarray, "*n k"]) -> UInt8[np.ndarray, "*n k2"]:
    """Encode exponents, two to a byte, the first in the lower half; an odd number leaves the last byte half empty."""
    index = np.rint((np.log2(exponents) - _FIRST) * 2.0).astype(np.uint8)
    if index.shape[-1] % 2:
        index = np.concatenate([index, np.zeros_like(index[..., :1])], axis=-1)
    return index[..., ::2] | index[..., 1::2] << 4


def decoded_exponents(codes: UInt8[np.ndarray, "*n k2"], count: int) -> Float[np.ndarray, "*n k"]:
    """Decode `count` exponents; float32."""
    index = np.stack([codes & 15, codes >> 4], axis=-1).reshape(*codes.shape[:-1], 2 * codes.shape[-1])
    return np.exp2(index[..., :count].astype(np.float32) * np.float32(0.5) + np.float32(_FIRST))


def coded_amplitudes(
    amplitudes: Float[np.ndarray, "..."], largest: Float[np.ndarray, "..."]
) -> Int8[np.ndarray, "..."]:
    """Encode amplitudes of either sign; `largest` belongs to the last axes, and no magnitude exceeds it."""
    share = np.divide(np.abs(amplitudes), largest, out=np.zeros_like(amplitudes), where=largest > 0.0)
    return (np.rint(np.sqrt(share) * _AMPLITUDE) * np.sign(amplitudes)).astype(np.int8)


def decoded_amplitudes(codes: Int8[np.ndarray, "..."], largest: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Decode amplitudes, in the precision of `largest`."""
    share = codes.astype(largest.dtype) / _AMPLITUDE
    return share * np.abs(share) * largest
