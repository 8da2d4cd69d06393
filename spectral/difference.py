"""CIELAB and colour differences over whole images.

Values are never clipped. Negative tristimulus values pass through the linear branch of CIELAB; NaN in gives NaN out,
and an infinite value gives NaN or infinity, without a warning.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from .axis_letters import XYZ, Lab, White
from .errors import InputError, UnknownNameError

#: Share of white, in X, Y or Z, below which CIELAB is linear (CIE 015:2018, equation 8.5).
KNEE = (24.0 / 116.0) ** 3
Formula = Literal["CIE 1976", "CIE 1994", "CIE 2000"]

# Y added before differentiating L*: what a dark surface reflects anyway, so that the darkest decades do not rule.
_DARK = 0.01


def lab_from_xyz(xyz: XYZ, white_xyz: White) -> Lab:
    """CIELAB (...,3) of XYZ (...,3) relative to a white (3,) in the same scale (CIE 015:2018 eq. 8.3-8.5)."""
    white = np.asarray(white_xyz, dtype=np.float64)
    if not (np.isfinite(white).all() and (white > 0).all()):
        raise InputError(
            "a white needs positive tristimulus values",
            field="white_xyz",
            found=str(white),
            expected="X, Y, Z > 0",
        )
    ratio = np.asarray(xyz, dtype=np.float64) / white
    with np.errstate(invalid="ignore"):  # infinity less infinity
        f = np.where(ratio > KNEE, np.cbrt(ratio), ratio * (841 / 108) + 16 / 116)
        lab = np.empty_like(f)
        lab[..., 0] = 116 * f[..., 1] - 16
        lab[..., 1] = 500 * (f[..., 0] - f[..., 1])
        lab[..., 2] = 200 * (f[..., 1] - f[..., 2])
    return lab


def xyz_from_lab(lab: Lab, white_xyz: White) -> XYZ:
    """XYZ (...,3) of CIELAB (CIE 015:2018 eq. 8.3-8.5 solved for XYZ), unclipped."""
    y = (lab[..., 0] + 16.0) / 116.0
    f = np.stack([y + lab[..., 1] / 500.0, y, y - lab[..., 2] / 200.0], axis=-1)
    return white_xyz * np.where(f > 24.0 / 116.0, f**3, (f - 16.0 / 116.0) * 108.0 / 841.0)


def delta_e(reference_lab: Lab, sample_lab: Lab, method: Formula = "CIE 1994") -> Float[np.ndarray, "*batch"]:
    """Colour difference (...) of CIELAB pairs.

    CIE 1994 weighs by the chroma of the reference and is not symmetric: mind which side is which.

    Parameters
    ----------
    reference_lab : (...,3) the standard, the truth.
    sample_lab : (...,3) the trial, the approximation.
    method : "CIE 1976", "CIE 1994" (graphic arts: kL = 1, K1 = 0.045, K2 = 0.015) or "CIE 2000" (kL = kC = kH = 1).

    >>> delta_e(np.array([50.0, 20.0, 10.0]), np.array([53.0, 20.0, 10.0]))
    array(3.)
    """
    formulas = {"CIE 1976": _delta_e_1976, "CIE 1994": _delta_e_1994, "CIE 2000": _delta_e_2000}
    if method not in formulas:
        raise UnknownNameError("colour difference", method, get_args(Formula))
    # One leading axis more, so that a single pair is an array too.
    reference, sample = (
        np.moveaxis(np.asarray(lab, dtype=np.float64)[None], -1, 0) for lab in (reference_lab, sample_lab)
    )
    with np.errstate(invalid="ignore", over="ignore"):  # pixels that hold no colour come out as NaN
        return np.asarray(formulas[method](reference, sample)[0])


def delta_e_xyz(
    reference_xyz: XYZ, sample_xyz: XYZ, white_xyz: White, method: Formula = "CIE 1994"
) -> Float[np.ndarray, "*batch"]:
    """Colour difference (...) of XYZ pairs, both relative to the same white."""
    return delta_e(lab_from_xyz(reference_xyz, white_xyz), lab_from_xyz(sample_xyz, white_xyz), method)


def _delta_e_1976(reference: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """CIE 015:2018 eq. (8.21)."""
    return np.sqrt(np.sum((sample - reference) ** 2, axis=0))


def _delta_e_1994(reference: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """CIE 116-1995. The hue term is what is left of the distance; rounding may leave it a hair below zero."""
    lightness, a, b = sample - reference
    chroma_reference = np.hypot(reference[1], reference[2])
    chroma = np.hypot(sample[1], sample[2]) - chroma_reference
    hue_squared = np.maximum(a**2 + b**2 - chroma**2, 0.0)
    return np.sqrt(
        lightness**2
        + (chroma / (1 + 0.045 * chroma_reference)) ** 2
        + hue_squared / (1 + 0.015 * chroma_reference) ** 2
    )


def _delta_e_2000(reference: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """CIE 142-2001 in the notation of Sharma, Wu and Dalal 2005, eq. (2)-(22)."""
    lightness_1, a_1, b_1 = reference
    lightness_2, a_2, b_2 = sample
    mean_chroma_7 = (0.5 * (np.hypot(a_1, b_1) + np.hypot(a_2, b_2))) ** 7
    g = 0.5 * (1 - np.sqrt(mean_chroma_7 / (mean_chroma_7 + 25.0**7)))
    a_1, a_2 = (1 + g) * a_1, (1 + g) * a_2
    chroma_1, chroma_2 = np.hypot(a_1, b_1), np.hypot(a_2, b_2)
    hue_1, hue_2 = (np.degrees(np.arctan2(b, a)) % 360 for a, b in ((a_1, b_1), (a_2, b_2)))

    coloured = chroma_1 * chroma_2 != 0  # without two hues there is no hue difference
    turn = hue_2 - hue_1
    turn = np.where(coloured, turn - 360 * np.round(turn / 360 - 1e-15 * np.sign(turn)), 0.0)
    hue_term = 2 * np.sqrt(chroma_1 * chroma_2) * np.sin(np.radians(turn) / 2)

    total = hue_1 + hue_2
    apart = np.abs(hue_1 - hue_2) > 180
    mean_hue = np.where(~coloured, total, 0.5 * np.where(apart, np.where(total < 360, total + 360, total - 360), total))
    mean_lightness, mean_chroma = 0.5 * (lightness_1 + lightness_2), 0.5 * (chroma_1 + chroma_2)
    t = (
        1
        - 0.17 * np.cos(np.radians(mean_hue - 30))
        + 0.24 * np.cos(np.radians(2 * mean_hue))
        + 0.32 * np.cos(np.radians(3 * mean_hue + 6))
        - 0.20 * np.cos(np.radians(4 * mean_hue - 63))
    )
    mean_chroma_7 = mean_chroma**7
    offset = (mean_lightness - 50) ** 2
    scale_lightness = 1 + 0.015 * offset / np.sqrt(20 + offset)
    scale_chroma, scale_hue = 1 + 0.045 * mean_chroma, 1 + 0.015 * mean_chroma * t
    rotation = (
        -2
        * np.sqrt(mean_chroma_7 / (mean_chroma_7 + 25.0**7))
        * np.sin(np.radians(60 * np.exp(-(((mean_hue - 275) / 25) ** 2))))
    )
    lightness = (lightness_2 - lightness_1) / scale_lightness
    chroma, hue = (chroma_2 - chroma_1) / scale_chroma, hue_term / scale_hue
    return np.sqrt(np.maximum(lightness**2 + chroma**2 + hue**2 + rotation * chroma * hue, 0.0))


def lightness_slope(luminance: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """dL*/dY of a surface of this Y over a dark floor (CIE 015:2018 eq. 8.3, its cube-root branch)."""
    return 116.0 / 3.0 * (np.maximum(luminance, 0.0) + _DARK) ** (-2.0 / 3.0)
