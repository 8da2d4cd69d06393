"""CIELAB and colour differences over whole images.

Values are never clipped. Negative tristimulus values pass through the linear branch of CIELAB; NaN in gives NaN out,
and an infinite value gives NaN or infinity, without a warning.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError, UnknownNameError
from .axis_letters import XYZ, Lab, White

#: Share of white, in X, Y or Z, below which CIELAB is linear (CIE 015:2018, equation 8.5).
KNEE = (24.0 / 116.0) ** 3
FormulaName = Literal["CIE 1976", "CIE 1994", "CIE 2000", "CMC 1:1", "CMC 2:1"]

# Y added before differentiating L*: what a dark surface reflects anyway, so that the darkest decades do not rule.
_DARK = 0.01


def lab_from_xyz(xyz: XYZ, white_xyz: White) -> Lab:
    """Convert XYZ (...,3) to CIELAB relative to a white (3,) in the same scale (CIE 015:2018 eq. 8.3-8.5)."""
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
    """Convert CIELAB to XYZ (...,3) (CIE 015:2018 eq. 8.3-8.5 solved for XYZ), unclipped."""
    y = (lab[..., 0] + 16.0) / 116.0
    f = np.stack([y + lab[..., 1] / 500.0, y, y - lab[..., 2] / 200.0], axis=-1)
    return white_xyz * np.where(f > 24.0 / 116.0, f**3, (f - 16.0 / 116.0) * 108.0 / 841.0)


def delta_e_lab(reference_lab: Lab, sample_lab: Lab, method: FormulaName = "CIE 1994") -> Float[np.ndarray, "*batch"]:
    """Compute the colour difference (...) of CIELAB pairs.

    CIE 1994 and CMC are weighted by the reference, hence not symmetric: do not swap the sides.

    Parameters
    ----------
    reference_lab : (...,3) the standard, the truth.
    sample_lab : (...,3) the trial, the approximation.
    method : "CIE 1976", "CIE 1994" (graphic arts: kL = 1, K1 = 0.045, K2 = 0.015), "CIE 2000" (kL = kC = kH = 1), "CMC
        1:1" (is it seen) or "CMC 2:1" (is it accepted).

    >>> delta_e_lab(np.array([50.0, 20.0, 10.0]), np.array([53.0, 20.0, 10.0]))
    array(3.)
    """
    formulas = {
        "CIE 1976": _delta_e_1976,
        "CIE 1994": _delta_e_1994,
        "CIE 2000": _delta_e_2000,
        "CMC 1:1": partial(_delta_e_cmc, 1.0, 1.0),
        "CMC 2:1": partial(_delta_e_cmc, 2.0, 1.0),
    }
    if method not in formulas:
        raise UnknownNameError("colour difference", method, get_args(FormulaName))
    # One leading axis more, so that a single pair is an array too.
    reference, sample = (
        np.moveaxis(np.asarray(lab, dtype=np.float64)[None], -1, 0) for lab in (reference_lab, sample_lab)
    )
    with np.errstate(invalid="ignore", over="ignore"):  # pixels that hold no colour come out as NaN
        return np.asarray(formulas[method](reference, sample)[0])


def delta_e_cmc(reference_lab: Lab, sample_lab: Lab, lightness: float, chroma: float) -> Float[np.ndarray, "*batch"]:
    """Compute CMC(l:c) of CIELAB pairs (...,3), l and c above 0; 1:1 and 2:1 as in `delta_e_lab`."""
    reference, sample = (
        np.moveaxis(np.asarray(lab, dtype=np.float64)[None], -1, 0) for lab in (reference_lab, sample_lab)
    )
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(_delta_e_cmc(lightness, chroma, reference, sample)[0])


def delta_e_xyz(
    reference_xyz: XYZ, sample_xyz: XYZ, white_xyz: White, method: FormulaName = "CIE 1994"
) -> Float[np.ndarray, "*batch"]:
    """Compute the colour difference (...) of XYZ pairs, both relative to the same white."""
    return delta_e_lab(lab_from_xyz(reference_xyz, white_xyz), lab_from_xyz(sample_xyz, white_xyz), method)


@dataclass(frozen=True, eq=False)
class Differences:
    """Differences of a sample from its standard, sample minus standard, each (...) (CIE 015:2018, 8.2.1).

    lightness, a, b, chroma : ΔL*, Δa*, Δb*, ΔC*ab. hue : ΔH*ab, positive where the sample's hue angle is the larger by
    less than half a turn; lightness, chroma and hue squared add up to ΔE of 1976 squared.
    """

    lightness: Float[np.ndarray, "*batch"]
    a: Float[np.ndarray, "*batch"]
    b: Float[np.ndarray, "*batch"]
    chroma: Float[np.ndarray, "*batch"]
    hue: Float[np.ndarray, "*batch"]


def differences(standard_lab: Lab, sample_lab: Lab) -> Differences:
    """Compute the differences of CIELAB pairs (...,3).

    >>> differences(np.array([50.0, 20.0, 0.0]), np.array([51.0, 0.0, 20.0])).hue.round(2).item()
    28.28
    """
    standard, sample = (np.moveaxis(np.asarray(lab, dtype=np.float64), -1, 0) for lab in (standard_lab, sample_lab))
    lightness, a, b = (np.asarray(one) for one in sample - standard)
    return Differences(lightness, a, b, np.asarray(_chroma(sample) - _chroma(standard)), _hue(standard, sample))


def _chroma(lab: np.ndarray) -> np.ndarray:
    return np.asarray(np.hypot(lab[1], lab[2]))


def _hue(standard: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """Compute CIE 015:2018 eq. (8.20), 2 sqrt(C1 C2) sin(Δh / 2), with Δh from cross and dot product.

    This avoids differences of angles, and roots of differences.
    """
    (_, a_1, b_1), (_, a_2, b_2) = standard, sample
    turn = np.arctan2(a_1 * b_2 - a_2 * b_1, a_1 * a_2 + b_1 * b_2)
    return np.asarray(2.0 * np.sqrt(_chroma(standard) * _chroma(sample)) * np.sin(0.5 * turn))


def _delta_e_cmc(
    lightness_weight: float, chroma_weight: float, reference: np.ndarray, sample: np.ndarray
) -> np.ndarray:
    """CMC(l:c): F. J. J. Clarke, R. McDonald and B. Rigg, Journal of the Society of Dyers and Colourists 100, 1984."""
    lightness, chroma = reference[0], _chroma(reference)
    hue = np.degrees(np.arctan2(reference[2], reference[1])) % 360.0
    scale_lightness = np.where(lightness < 16.0, 0.511, 0.040975 * lightness / (1.0 + 0.01765 * lightness))
    scale_chroma = 0.0638 * chroma / (1.0 + 0.0131 * chroma) + 0.638
    blue = (hue >= 164.0) & (hue <= 345.0)
    t = np.where(
        blue,
        0.56 + np.abs(0.2 * np.cos(np.radians(hue + 168.0))),
        0.36 + np.abs(0.4 * np.cos(np.radians(hue + 35.0))),
    )
    f = np.sqrt(chroma**4 / (chroma**4 + 1900.0))
    scale_hue = scale_chroma * (f * t + 1.0 - f)
    off = sample - reference
    along = _chroma(sample) - chroma
    hue_squared = np.maximum(off[1] ** 2 + off[2] ** 2 - along**2, 0.0)
    return np.sqrt(
        (off[0] / (lightness_weight * scale_lightness)) ** 2
        + (along / (chroma_weight * scale_chroma)) ** 2
        + hue_squared / scale_hue**2
    )


def _delta_e_1976(reference: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """CIE 015:2018 eq. (8.21)."""
    return np.sqrt(np.sum((sample - reference) ** 2, axis=0))


def _delta_e_1994(reference: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """Compute CIE 116-1995. The hue term is the remainder of the distance, which rounding may make negative."""
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
    """Compute dL*/dY of a surface of this Y, at least a dark floor (CIE 015:2018 eq. 8.3, its cube-root branch)."""
    return 116.0 / 3.0 * (np.maximum(luminance, 0.0) + _DARK) ** (-2.0 / 3.0)
