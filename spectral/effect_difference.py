"""Colour differences of effect coatings, angle by angle."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..runtime.errors import ComparisonError
from .axis_letters import Lab

#: What the formula is called wherever it stands: nobody here has checked it against the standard.
DIN_6175_2 = "DIN 6175-2 (as published in software)"


def delta_e_din_6175_2(reference: Lab, sample: Lab, aspecular: float) -> Float[np.ndarray, "*batch"]:
    """ΔE of pairs (...,3) of CIELAB read at an aspecular angle in degrees, as public paint software has DIN 6175-2.

    Weights follow the angle: near the mirror direction more is accepted. Greys are told by Δa* and Δb*, colours by ΔC*
    and ΔH*, and what lies between by both, with L and C the geometric means of both sides, so that it is symmetric:

        S_L = 0.15 sqrt L + 31.5 / gamma
        S_C = max(0.7, 0.48 sqrt C - 0.35 sqrt L + 42 / gamma)
        S_H = max(0.7, 0.14 sqrt C - 0.20 sqrt L + 21 / gamma + 0.7)            S_a = S_b = 0.7
        ΔE  = s ΔE_ab + (1 - s) ΔE_CH,   s = 1 / (1 + exp(C - C_0)),   C_0 = 10 + 8 / (1 + exp(27 - L))

    Raises
    ------
    ComparisonError : an angle of 0, the mirror direction itself.

    >>> round(float(delta_e_din_6175_2(np.array([50.0, 0.0, 0.0]), np.array([51.0, 0.0, 0.0]), 45.0)), 4)
    0.5663
    """
    gamma = abs(aspecular)
    if gamma == 0.0:
        raise ComparisonError("DIN 6175-2 has no colour difference at 0 degrees from the mirror direction")
    off = np.asarray(sample, dtype=np.float64) - np.asarray(reference, dtype=np.float64)
    light = [np.maximum(side[..., 0], 0.0) for side in (reference, sample)]
    chroma = [np.hypot(side[..., 1], side[..., 2]) for side in (reference, sample)]
    level, colourful = np.sqrt(light[0] * light[1]), np.sqrt(chroma[0] * chroma[1])
    root_l, root_c = np.sqrt(level), np.sqrt(colourful)
    lightness = (off[..., 0] / (0.15 * root_l + 31.5 / gamma)) ** 2
    change = chroma[1] - chroma[0]
    across = off[..., 1] ** 2 + off[..., 2] ** 2
    # ΔH*^2 is what ΔC* leaves of Δa*^2 + Δb*^2: never below 0 but by rounding.
    hue = np.maximum(across - change**2, 0.0)
    weight_c = np.maximum(0.7, 0.48 * root_c - 0.35 * root_l + 42.0 / gamma)
    weight_h = np.maximum(0.7, 0.14 * root_c - 0.20 * root_l + 21.0 / gamma + 0.7)
    grey = np.sqrt(lightness + across / 0.7**2)
    coloured = np.sqrt(lightness + (change / weight_c) ** 2 + hue / weight_h**2)
    share = _logistic(10.0 + 8.0 * _logistic(level - 27.0) - colourful)
    return share * grey + (1.0 - share) * coloured


def _logistic(x: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """1 / (1 + exp(-x)), which no x overflows."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
