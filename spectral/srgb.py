"""Transfer function of sRGB (IEC 61966-2-1); its primaries are in `upsampling.xyz_from_rgb`."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

# Codes and light up to which the curve is straight, and the slope there.
_STRAIGHT_CODES, _STRAIGHT_LIGHT, _SLOPE = 0.04045, 0.0031308, 12.92


def srgb_to_linear(codes: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Decode codes to linear light, both from 0 to 1.

    >>> srgb_to_linear(np.array([0.0, 0.04045, 1.0])).round(6).tolist()
    [0.0, 0.003131, 1.0]
    """
    return np.where(codes <= _STRAIGHT_CODES, codes / _SLOPE, ((codes + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(light: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Encode linear light, 0 or more, to codes.

    >>> linear_to_srgb(np.array([0.0, 0.0031308, 1.0])).round(6).tolist()
    [0.0, 0.04045, 1.0]
    """
    return np.where(light <= _STRAIGHT_LIGHT, _SLOPE * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
