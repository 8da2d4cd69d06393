"""Haar wavelets on the faces of cube maps: numbers most of which are small (Ng, Ramamoorthi and Hanrahan 2003)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def transformed(values: Float[np.ndarray, "*n D"], across: int) -> Float[np.ndarray, "*n D"]:
    """Orthonormal, non-standard two-dimensional Haar coefficients of each face; `across` is a power of 2.

    The inner product of two maps is that of their coefficients.
    """
    faces = np.array(values, dtype=np.float64).reshape(*values.shape[:-1], 6, across, across)
    size = across
    while size > 1:
        half = size // 2
        block = faces[..., :size, :size]
        a, b = block[..., 0::2, 0::2], block[..., 0::2, 1::2]
        c, d = block[..., 1::2, 0::2], block[..., 1::2, 1::2]
        parts = [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]
        parts = [0.5 * part for part in parts]
        block[..., :half, :half], block[..., :half, half:] = parts[0], parts[1]
        block[..., half:, :half], block[..., half:, half:] = parts[2], parts[3]
        size = half
    return faces.reshape(values.shape)
