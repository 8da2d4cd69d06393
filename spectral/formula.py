"""Colour difference formulas by their usual names: of XYZ pairs under one white."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..runtime.errors import ComparisonError, InputError, UnknownNameError
from . import difference
from .axis_letters import XYZ, Lab, White
from .difference import delta_e_cmc, lab_from_xyz
from .measurement import geometry_in

#: Names of the formulas, beside CMC of any l:c.
NAMES = ("CIE 1976", "CIE 1994", "CIE 2000", "CMC 1:1", "CMC 2:1", "CAM16-UCS")
#: Names of those for samples read at several angles alone.
NAMES_AT_ANGLES = ("DIN 6175-2",)
#: Viewing conditions of CAM16: a grey surround of 20 % in a booth of 1000 lx, cd/m^2 as C. Li et al. 2017 take it.
ADAPTING_LUMINANCE, BACKGROUND = 1000.0 / np.pi * 0.2, 20.0
# Suffix of a name in a report, which a person may hand back.
_AS_PUBLISHED = "(as published in software)"
#: Name of the formula in all outputs: it has not been checked against the standard.
DIN_6175_2 = f"DIN 6175-2 {_AS_PUBLISHED}"
# As people write them, folded and without what stands between.
_ALSO = {
    "76": "CIE 1976",
    "1976": "CIE 1976",
    "ab": "CIE 1976",
    "94": "CIE 1994",
    "1994": "CIE 1994",
    "00": "CIE 2000",
    "2000": "CIE 2000",
    "cam16ucs": "CAM16-UCS",
    "cam16": "CAM16-UCS",
    "din6175": DIN_6175_2,
    "din61752": DIN_6175_2,
}
# Pairs at once in CAM16: some 30 MB.
_BLOCK = 1 << 16


@dataclass(frozen=True)
class Formula:
    """A colour difference formula.

    name : as in colour-science; of CMC with its l:c. cmc : l and c. aspecular : angle of both readings in degrees, for
    formulas that depend on it.
    """

    name: str
    cmc: tuple[float, float] | None = None
    aspecular: float | None = None

    def at(self, geometry: str) -> Formula:
        """Return the formula for a pair read at an angle, such as "45as15"; itself if the angle is irrelevant."""
        if self.name != DIN_6175_2:
            return self
        angle = geometry_in(geometry) if geometry else None
        return replace(self, aspecular=None if angle is None or angle.kind != "multi-angle" else angle.second)

    def __call__(self, reference_xyz: XYZ, sample_xyz: XYZ, white_xyz: White) -> Float[np.ndarray, "*batch"]:
        """Compute ΔE (...) of pairs (...,3), Y of the white (3,) being 1; NaN where a pixel has no colour.

        CIE 1994 and CMC are weighted by the reference, hence not symmetric.

        Raises
        ------
        ComparisonError : the formula depends on an angle, and the pair was read at none.
        """
        if self.name == "CAM16-UCS":
            off = _cam16_ucs(sample_xyz, white_xyz) - _cam16_ucs(reference_xyz, white_xyz)
            return np.asarray(np.linalg.norm(off, axis=-1))
        reference, sample = lab_from_xyz(reference_xyz, white_xyz), lab_from_xyz(sample_xyz, white_xyz)
        if self.name == DIN_6175_2:
            if self.aspecular is None:
                raise ComparisonError(f"{self.name} is for samples that were read at several angles")
            return np.asarray(delta_e_din_6175_2(reference, sample, self.aspecular))
        if self.cmc is not None:
            return delta_e_cmc(reference, sample, *self.cmc)
        return difference.delta_e_lab(reference, sample, self.name)  # type: ignore[arg-type]

    @property
    def words(self) -> str:
        """Name, with the parameters of the formula if it has any."""
        if self.name == "CIE 1994":
            return "CIE 1994 (graphic arts, kL = 1)"
        if self.name == "CAM16-UCS":
            return f"CAM16-UCS (L_A {ADAPTING_LUMINANCE:.0f} cd/m2, Y_b {BACKGROUND:g}, average surround)"
        return self.name


def formula(text: str) -> Formula:
    """Return the named formula: "CIE 2000", "94", "dE00", "CMC 2:1", "CMC(1.5:1)", "CAM16-UCS".

    Raises
    ------
    InputError : an l:c that is no pair of numbers above 0. UnknownNameError : another name.

    >>> formula("ΔE00").name, formula("cmc (2:1)").name
    ('CIE 2000', 'CMC 2:1')
    """
    if not isinstance(text, str):
        raise InputError("no name of a formula", field="formula", found=repr(text)[:80], expected='such as "CIE 2000"')
    bare = text.casefold().removesuffix(_AS_PUBLISHED)
    folded = re.sub(r"[\s_*()-]", "", bare)
    if folded.startswith("cmc"):
        return _cmc(text, re.sub(r"^[\s_*()-]*c[\s_*()-]*m[\s_*()-]*c", "", bare))
    for before in ("cie", "deltae", "δe", "de"):
        folded = folded.removeprefix(before)
    if folded not in _ALSO:
        raise UnknownNameError("colour difference", text, (*NAMES, *NAMES_AT_ANGLES))
    return Formula(_ALSO[folded])


def delta_e(
    reference_lab: Float[np.ndarray, "*#batch 3"], sample_lab: Float[np.ndarray, "*#batch 3"], method: str = "CIE 1994"
) -> Float[np.ndarray, "*batch"]:
    """Compute the colour difference (...) of CIELAB pairs, by a formula in any usual spelling.

    CIE 1994 and CMC are weighted by the reference, hence not symmetric: do not swap the sides.

    Parameters
    ----------
    reference_lab, sample_lab : (...,3) the standard, and the sample.
    method : as of `formula`: "CIE 2000", "dE00", "ciede2000", "CMC(2:1)".

    Raises
    ------
    UnknownNameError : another formula. ComparisonError : one that requires more than CIELAB, such as CAM16-UCS.
    InputError : no formula, weights that are not above 0, or arrays that are not (...,3) or do not fit each other.

    >>> delta_e(np.array([50.0, 20.0, 10.0]), np.array([53.0, 20.0, 10.0]), "dE 76")
    array(3.)
    """
    asked = formula(method)
    reference_lab, sample_lab = _pairs(reference_lab, sample_lab)
    if asked.cmc is not None:
        return delta_e_cmc(reference_lab, sample_lab, *asked.cmc)
    if not asked.name.startswith("CIE"):
        raise ComparisonError(
            f"{asked.name} is no formula of CIELAB alone: `metamer.match` has it, which knows the light and the angle"
        )
    return difference.delta_e_lab(reference_lab, sample_lab, asked.name)  # type: ignore[arg-type]


def _pairs(reference_lab: Any, sample_lab: Any) -> tuple[Lab, Lab]:
    """Both sides as arrays (...,3) of one shape."""
    sides: dict[str, np.ndarray] = {}
    for field, given in (("reference_lab", reference_lab), ("sample_lab", sample_lab)):
        try:
            lab = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            lab = np.asarray(0.0)
        if not lab.ndim or lab.shape[-1] != 3:
            found = f"shape {lab.shape}" if lab.ndim else repr(given)[:80]
            raise InputError(
                "not CIELAB",
                field=field,
                found=found,
                expected="L*, a*, b* as an array (...,3)",
                hint="a spectrum has them as spectrum.lab()" if hasattr(given, "lab") else None,
            )
        sides[field] = lab
    reference, sample = sides.values()
    try:
        reference, sample = np.broadcast_arrays(reference, sample)
    except ValueError:
        found, expected = f"shapes {reference.shape} and {sample.shape}", "as many on both sides, or one on one of them"
        raise InputError(
            "sides that do not fit each other", field="sample_lab", found=found, expected=expected
        ) from None
    return reference, sample


def _cmc(text: str, weights: str) -> Formula:
    # A hyphen would be a minus, and what stands between two digits parts two numbers.
    found = re.fullmatch(r"[\s_*(]*(\d+(?:\.\d+)?)\s*:\s*(\d+(?:\.\d+)?)[\s_*)]*", weights)
    pair = (0.0, 0.0) if found is None else (float(found[1]), float(found[2]))
    if min(pair) <= 0.0:
        raise InputError(
            "CMC needs its weights of lightness and chroma",
            field="formula",
            found=text,
            expected='"CMC l:c", both above 0',
            hint='"CMC 2:1" tells whether a difference is accepted, "CMC 1:1" whether it is seen',
        )
    return Formula(f"CMC {pair[0]:g}:{pair[1]:g}", pair)


def _cam16_ucs(xyz: XYZ, white_xyz: White) -> Float[np.ndarray, "*batch 3"]:
    """Compute J', a', b' (C. Li et al., Color Research and Application 42, 2017), by colour-science.

    Negative lightness is undefined in CAM16: such colours become NaN.
    """
    from .colour_library import colour_science

    colour = colour_science()
    flat = np.asarray(xyz, dtype=np.float64).reshape(-1, 3)
    found = np.empty_like(flat)
    white = 100.0 * np.asarray(white_xyz, dtype=np.float64) / white_xyz[1]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for start in range(0, len(flat), _BLOCK):
            rows = slice(start, start + _BLOCK)
            seen = colour.appearance.XYZ_to_CAM16(
                100.0 * flat[rows] / white_xyz[1], white, ADAPTING_LUMINANCE, BACKGROUND
            )
            found[rows] = colour.models.JMh_CAM16_to_CAM16UCS(np.stack([seen.J, seen.M, seen.h], axis=-1))
    return found.reshape(np.shape(xyz))


def delta_e_din_6175_2(reference: Lab, sample: Lab, aspecular: float) -> Float[np.ndarray, "*batch"]:
    """Compute ΔE of CIELAB pairs (...,3) at an aspecular angle, degrees, as public paint software has DIN 6175-2.

    Weights depend on the angle: tolerances are wider near the mirror direction. Greys are judged by Δa* and Δb*,
    colours by ΔC* and ΔH*, those between by both, with L and C the geometric means of both sides, so that it is
    symmetric:

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
    return np.asarray(share * grey + (1.0 - share) * coloured)


def _logistic(x: np.ndarray | np.float64) -> np.ndarray | np.float64:
    """Compute 1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
