"""Quantisation of lobes: two bytes an axis, half a byte an exponent, a byte an amplitude.

Axes are points of an octahedron that is unfolded into a square (Meyer et al. 2010), the normal and the axes of the
frame exactly; exponents are 2^(i/2), as the prefiltered environments of Meseth, Mueller and Klein 2003 (section 5.2)
are; amplitudes follow a square law, finer where they are small, each relative to the largest of its kind.
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
    """Unit vectors as two bytes."""
    flat = axes / np.abs(axes).sum(axis=-1, keepdims=True)
    place = np.where(flat[..., 2:] < 0.0, _turned_out(flat[..., :2]), flat[..., :2])
    return (np.rint(place * _SQUARE) + _SQUARE).astype(np.uint8)


def decoded_axes(codes: UInt8[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 3"]:
    """Unit vectors of two bytes; float32."""
    place = (codes.astype(np.float32) - _SQUARE) / np.float32(_SQUARE)
    up = 1.0 - np.abs(place).sum(axis=-1, keepdims=True)
    axes = np.concatenate([np.where(up < 0.0, _turned_out(place), place), up], axis=-1)
    return axes / np.linalg.norm(axes, axis=-1, keepdims=True)


def _turned_out(place: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
    """Return the lower half of the octahedron outside the upper one, and back."""
    return (1.0 - np.abs(place[..., ::-1])) * np.where(place < 0.0, -1.0, 1.0).astype(place.dtype)


def coded_exponents(exponents: Float[np.ndarray, "*n k"]) -> UInt8[np.ndarray, "*n k2"]:
    """Exponents, two to a byte, the first of them lower; the last byte of an odd number is half empty."""
    index = np.rint((np.log2(exponents) - _FIRST) * 2.0).astype(np.uint8)
    if index.shape[-1] % 2:
        index = np.concatenate([index, np.zeros_like(index[..., :1])], axis=-1)
    return index[..., ::2] | index[..., 1::2] << 4


def decoded_exponents(codes: UInt8[np.ndarray, "*n k2"], count: int) -> Float[np.ndarray, "*n k"]:
    """`count` exponents of bytes; float32."""
    index = np.stack([codes & 15, codes >> 4], axis=-1).reshape(*codes.shape[:-1], 2 * codes.shape[-1])
    return np.exp2(index[..., :count].astype(np.float32) * np.float32(0.5) + np.float32(_FIRST))


def coded_amplitudes(
    amplitudes: Float[np.ndarray, "..."], largest: Float[np.ndarray, "..."]
) -> Int8[np.ndarray, "..."]:
    """Amplitudes of either sign; the largest are along the last axes, and none is beyond."""
    share = np.divide(np.abs(amplitudes), largest, out=np.zeros_like(amplitudes), where=largest > 0.0)
    return (np.rint(np.sqrt(share) * _AMPLITUDE) * np.sign(amplitudes)).astype(np.int8)


def decoded_amplitudes(codes: Int8[np.ndarray, "..."], largest: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Amplitudes of bytes, in the precision of the largest."""
    share = codes.astype(largest.dtype) / _AMPLITUDE
    return share * np.abs(share) * largest
