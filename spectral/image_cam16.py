"""CAM16-UCS of many pixels in single precision, with hue as a vector, and powers by logarithms."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .adaptation import CONE_FROM_XYZ
from .axis_letters import White
from .formula import ADAPTING_LUMINANCE, BACKGROUND

# Average surround (C. Li et al., Color Research and Application 42, 2017, table A1).
_F, _C, _N_C = 1.0, 0.69, 1.0
_HALF_RESPONSE = np.float32(27.13)
# J' and M' (M. R. Luo, G. Cui and C. Li, Color Research and Application 31, 2006, eq. 4-6).
_C_1, _C_2 = 0.007, np.float32(0.0228)
# c_2 M' of 100, either way: beyond, single precision was off by up to 1.8; and of 10, where J' is below 1: 0.05.
_STEEP, _STEEP_IN_DARK = _C_2 * np.float32(100.0), _C_2 * np.float32(10.0)
_COS, _SIN = np.float32(np.cos(2.0)), np.float32(np.sin(2.0))


class Cam16(NamedTuple):
    """Constants of CAM16 for a white and viewing conditions, computed once (Li et al. 2017, step 0).

    cones_from_share (3, 3) : from XYZ over white to the base of the response's power. brightest : achromatic response
    of the white. exponent : of lightness. colourful : factor of chroma, M by C included. induction : of chroma, a
    quarter for the eccentricity.
    """

    cones_from_share: Float[np.ndarray, "3 3"]
    brightest: float
    exponent: float
    colourful: float
    induction: float


def cam16_constants(white_xyz: White) -> Cam16:
    """Compute the constants of CAM16 for a white (3,) of any scale, in the viewing conditions of `formula`."""
    white = 100.0 * np.asarray(white_xyz, dtype=np.float64) / white_xyz[1]
    cone_from_xyz = CONE_FROM_XYZ["CAT16"]
    k = 1.0 / (5.0 * ADAPTING_LUMINANCE + 1.0)
    level = 0.2 * k**4 * 5.0 * ADAPTING_LUMINANCE + 0.1 * (1.0 - k**4) ** 2 * (5.0 * ADAPTING_LUMINANCE) ** (1.0 / 3.0)
    n = BACKGROUND / 100.0
    adapted = np.clip(_F * (1.0 - np.exp((-ADAPTING_LUMINANCE - 42.0) / 92.0) / 3.6), 0.0, 1.0)
    gain = adapted * 100.0 / (cone_from_xyz @ white) + 1.0 - adapted
    cones_from_share = gain[:, None] * cone_from_xyz * white * (level / 100.0)
    brightest = _achromatic(_responses(cones_from_share.astype(np.float32).sum(axis=1)[:, None]))[0]
    return Cam16(
        cones_from_share,
        float(brightest),
        _C * (1.48 + np.sqrt(n)),
        (1.64 - 0.29**n) ** 0.73 * level**0.25,
        50000.0 / 13.0 * _N_C * 0.725 * n**-0.2 / 4.0,
    )


def cam16_block(white_xyz: White) -> Callable[[Float[np.ndarray, "2 3 n"]], Float[np.ndarray, " n"]]:
    """Return the formula for one white: ΔE (n) of planes of CIELAB, reference and sample, which it overwrites.

    Infinity marks colours for which single precision is insufficient: impossible ones, near a division by 0 in the
    formula. Elsewhere ΔE is some 1e-4 from double precision, and at most 0.02 where it was measured. The viewing
    conditions, and signed powers outside the spectral locus, are those of `formula`.
    """
    of_white = cam16_constants(white_xyz)
    from_share = of_white.cones_from_share.astype(np.float32)
    brightest, exponent, colourful = of_white.brightest, of_white.exponent, np.float32(of_white.colourful)
    by_induction = np.float32(of_white.induction)

    def appearance(lab: Float[np.ndarray, "3 n"]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Compute J', a', b', and the mask of those beyond single precision."""
        share = _shares(lab)
        response = _responses(np.stack([x * share[0] + y * share[1] + z * share[2] for x, y, z in from_share]))
        red, green, blue = response
        a = red - np.float32(12.0 / 11.0) * green + blue * np.float32(1.0 / 11.0)
        b = (red + green - blue - blue) * np.float32(1.0 / 9.0)
        length = np.sqrt(a * a + b * b)
        bright = _achromatic(response) / brightest
        # The 0.1 that CAM16 adds to each response cancels everywhere but here.
        below = red + green + np.float32(1.05) * blue + np.float32(0.305)
        turned = (a * _COS - b * _SIN + np.float32(3.8) * length) * by_induction / below
        log_bright = np.log(np.abs(bright))
        lightness = np.copysign(np.exp(np.float32(exponent) * log_bright), bright)
        chroma = colourful * np.exp(np.float32(0.9) * np.log(np.abs(turned)) + np.float32(0.5 * exponent) * log_bright)
        np.copysign(chroma, turned * np.sign(bright), out=chroma)
        log_chroma = np.log1p(_C_2 * chroma)
        # Without a length there is no hue, and no chroma either.
        scale = log_chroma / (_C_2 * np.maximum(length, np.float32(1e-30)))
        j = np.float32(100.0 + 1e4 * _C_1) * lightness / (np.float32(1.0) + np.float32(100.0 * _C_1) * lightness)
        steep = np.abs(log_chroma) > np.where(np.abs(j) < np.float32(1.0), _STEEP_IN_DARK, _STEEP)
        return j, scale * a, scale * b, steep

    def block(lab: Float[np.ndarray, "2 3 n"]) -> Float[np.ndarray, " n"]:
        *first, steep = appearance(lab[0])
        *second, also = appearance(lab[1])
        j, a, b = (x - y for x, y in zip(first, second, strict=True))
        found = np.sqrt(j * j + a * a + b * b)
        found[steep | also] = np.inf
        return found

    return block


def _shares(lab: Float[np.ndarray, "3 n"]) -> Float[np.ndarray, "3 n"]:
    """Compute X, Y and Z over those of the white (CIE 015:2018 eq. 8.3-8.5 solved for XYZ), in place."""
    y, a, b = lab
    # f less 16/116, which the dark would drown in.
    y *= np.float32(1.0 / 116.0)
    step = np.stack([y + a * np.float32(1.0 / 500.0), y, y - b * np.float32(1.0 / 200.0)])
    f = step + np.float32(16.0 / 116.0)
    return np.where(step > np.float32(8.0 / 116.0), f * f * f, step * np.float32(108.0 / 841.0))


def _responses(cones: Float[np.ndarray, "3 n"]) -> Float[np.ndarray, "3 n"]:
    """Compute Li et al. 2017, step 3, without the 0.1."""
    power = np.exp(np.float32(0.42) * np.log(np.abs(cones)))
    return np.copysign(np.float32(400.0) * power / (power + _HALF_RESPONSE), cones)


def _achromatic(response: Float[np.ndarray, "3 n"]) -> Float[np.ndarray, " n"]:
    return np.float32(2.0) * response[0] + response[1] + np.float32(0.05) * response[2]
