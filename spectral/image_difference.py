"""Colour differences of large images: in single precision, in blocks that stay in the cache, on all cores.

The formulas of `difference` and `formula`, without angles if possible: hues are vectors, and sines and cosines of
multiples are products of their components. Within 1e-3 of double precision everywhere, some 1e-5 for similar colours;
CAM16-UCS within 0.05, some 1e-4 for similar colours.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError, UnknownNameError
from ..runtime.worker_pool import usable_cores
from .axis_letters import Lab, White
from .difference import delta_e_lab, xyz_from_lab
from .formula import Formula
from .image_cam16 import cam16_block

ImageFormula = Literal["CIE 1994", "CIE 2000", "CAM16-UCS"]
# Pixels at once: a plane of them is 512 KB. Fewer cost more calls than they save in cache.
_BLOCK = 131072
# Blocks that one thread takes at once.
_RUN = 4
_TO_25_7 = np.float32(25.0**7)
_ANGLES = np.radians([6.0, 30.0, 63.0, 275.0])
# Cosine and sine of each.
_HUE = tuple(zip(np.cos(_ANGLES).astype(np.float32), np.sin(_ANGLES).astype(np.float32), strict=True))
# Hues so nearly opposite (the sine of what is missing) have no mean in single precision.
_OPPOSITE = 2e-2


def image_delta_e(
    reference_lab: Lab,
    sample_lab: Lab,
    method: ImageFormula = "CIE 1994",
    threads: int | None = None,
    white_xyz: White | None = None,
) -> Float[np.ndarray, "*batch"]:
    """Compute the colour difference (...), float32, of CIELAB images (...,3), within 1e-3 of double precision.

    method : "CIE 1994" or "CIE 2000", as of `delta_e_lab`, or "CAM16-UCS", as of `formula`, within 0.05.
    threads : None uses all cores. white_xyz : (3,) of both images; required by CAM16-UCS alone.

    Raises
    ------
    InputError : the images have other shapes; or CAM16-UCS has no white, or one that is none.
    """
    if method not in get_args(ImageFormula):
        raise UnknownNameError("colour difference of images", method, get_args(ImageFormula))
    if np.shape(reference_lab) != np.shape(sample_lab):
        found = f"{np.shape(reference_lab)} and {np.shape(sample_lab)}"
        raise InputError("images of different shapes", field="sample_lab", found=found, expected="one shape")
    reference, sample = (np.asarray(one).reshape(-1, 3) for one in (reference_lab, sample_lab))
    found = np.empty(len(reference), np.float32)
    white = _checked(white_xyz) if method == "CAM16-UCS" else None
    block = {"CIE 1994": _block_1994, "CIE 2000": _block_2000}[method] if white is None else cam16_block(white)

    def run(start: int) -> None:
        # Planes of reference and sample, which the formula may write over.
        planes = np.empty((2, 3, _BLOCK), np.float32)
        with np.errstate(
            invalid="ignore", over="ignore", divide="ignore"
        ):  # pixels that hold no colour come out as NaN
            for first in range(start, min(start + _RUN * _BLOCK, len(found)), _BLOCK):
                rows = slice(first, first + _BLOCK)
                lab = planes[..., : len(found[rows])]
                lab[0], lab[1] = reference[rows].T, sample[rows].T
                found[rows] = block(lab)
                if method == "CIE 2000":
                    _again(found[rows], reference[rows], sample[rows])

    with ThreadPoolExecutor(usable_cores() if threads is None else threads) as pool:
        list(pool.map(run, range(0, len(found), _RUN * _BLOCK)))
    if white is not None:
        _again_cam16(found, reference, sample, white)
    return found.reshape(np.shape(reference_lab)[:-1])


def _block_1994(lab: Float[np.ndarray, "2 3 n"]) -> Float[np.ndarray, " n"]:
    """Compute CIE 116-1995, in place, since memory traffic dominates arithmetic."""
    (lightness, a, b), (sample_lightness, sample_a, sample_b) = lab
    total = _squared(np.subtract(lightness, sample_lightness, out=lightness))
    off = _squared(a - sample_a) + _squared(b - sample_b)
    chroma, along = _chroma(a, b), _chroma(sample_a, sample_b)
    along -= chroma
    # The rest of the squared distance; rounding may leave it a hair below zero.
    hue = np.maximum(off, _squared(along), out=off)
    hue -= along
    scale = sample_b
    for part, weight in ((along, 0.045), (hue, 0.015)):
        np.multiply(chroma, np.float32(weight), out=scale)
        scale += np.float32(1.0)
        part /= _squared(scale)
        total += part
    return np.sqrt(total, out=total)


def _squared(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Square values in place."""
    return np.square(values, out=values)


def _chroma(a: Float[np.ndarray, " n"], b: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Compute chroma in place of `a`; `b` is overwritten."""
    return np.sqrt(np.add(_squared(a), _squared(b), out=a), out=a)


def _block_2000(lab: Float[np.ndarray, "2 3 n"]) -> Float[np.ndarray, " n"]:
    """CIE 142-2001 (Sharma, Wu and Dalal 2005, eq. 2-22); NaN where hues are opposite."""
    (l_1, a_1, b_1), (l_2, a_2, b_2) = lab
    one, half, two = np.float32(1.0), np.float32(0.5), np.float32(2.0)
    grow = one + half * (one - _saturation(half * (np.sqrt(a_1 * a_1 + b_1 * b_1) + np.sqrt(a_2 * a_2 + b_2 * b_2))))
    a_1, a_2 = grow * a_1, grow * a_2
    chroma_1, chroma_2 = np.sqrt(a_1 * a_1 + b_1 * b_1), np.sqrt(a_2 * a_2 + b_2 * b_2)
    product, dot, cross = chroma_1 * chroma_2, a_1 * a_2 + b_1 * b_2, a_1 * b_2 - a_2 * b_1
    # 2 sqrt(C1 C2) sin(turn / 2), for hues nearer than a right angle and others: no difference of near numbers.
    beyond = dot < 0.0
    root = np.sqrt(two * np.where(beyond, product - dot, one / np.maximum(product + dot, np.float32(1e-30))))
    hue = np.where(beyond, np.copysign(root, cross), cross * root)

    # The mean hue halves the lesser turn, as the sum of two vectors of one length does.
    cosine, sine = a_1 * chroma_2 + a_2 * chroma_1, b_1 * chroma_2 + b_2 * chroma_1
    length = np.sqrt(cosine * cosine + sine * sine)
    known = length > 0.0
    length = np.where(known, length, one)
    cosine, sine = cosine / length, sine / length
    mean = half * (chroma_1 + chroma_2)
    c_2, s_2 = two * cosine * cosine - one, two * sine * cosine
    c_3, s_3 = cosine * (two * c_2 - one), sine * (two * c_2 + one)
    c_4, s_4 = two * c_2 * c_2 - one, two * s_2 * c_2
    (c6, s6), (c30, s30), (c63, s63), (c275, s275) = _HUE
    t = one - np.float32(0.17) * (cosine * c30 + sine * s30) + np.float32(0.24) * c_2
    t += np.float32(0.32) * (c_3 * c6 - s_3 * s6) - np.float32(0.20) * (c_4 * c63 + s_4 * s63)

    # The square of the angle to 275 degrees, by its series in 1 - cosine; beyond a right angle all of it is far off.
    x = one - (cosine * c275 + sine * s275)
    squared = np.float32(16 / 1575) * x
    for term in (1 / 35, 4 / 45, 1 / 3, 2.0):
        squared = (squared + np.float32(term)) * x
    blue = np.exp(squared * np.float32(-((180.0 / np.pi / 25.0) ** 2)))
    rotation = -two * _saturation(mean) * np.sin(np.float32(np.pi / 3.0) * blue)

    offset = half * (l_1 + l_2) - np.float32(50.0)
    offset *= offset
    lightness = (l_2 - l_1) / (one + np.float32(0.015) * offset / np.sqrt(np.float32(20.0) + offset))
    chroma = (chroma_2 - chroma_1) / (one + np.float32(0.045) * mean)
    hue /= one + np.float32(0.015) * mean * t
    total = lightness * lightness + chroma * chroma + hue * hue + rotation * chroma * hue
    # `maximum` of an array and a number takes five times as long as of two arrays.
    np.maximum(total, np.zeros_like(total), out=total)
    return np.where(beyond & (np.abs(cross) < np.float32(_OPPOSITE) * product), np.float32(np.nan), np.sqrt(total))


def _saturation(chroma: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Compute sqrt(C^7 / (C^7 + 25^7))."""
    squared = chroma * chroma
    seventh = squared * squared * squared * chroma
    return np.sqrt(seventh / (seventh + _TO_25_7))


def _again(
    found: Float[np.ndarray, " n"], reference: Float[np.ndarray, "n 3"], sample: Float[np.ndarray, "n 3"]
) -> None:
    """Recompute in double precision where single precision has no number."""
    some = np.flatnonzero(np.isnan(found))
    if len(some):
        found[some] = delta_e_lab(reference[some], sample[some], "CIE 2000")


def _again_cam16(
    found: Float[np.ndarray, " n"], reference: Float[np.ndarray, "n 3"], sample: Float[np.ndarray, "n 3"], white: White
) -> None:
    """Recompute CAM16-UCS in double precision where infinity marks it."""
    some = np.flatnonzero(np.isinf(found))
    if len(some):
        first, second = (xyz_from_lab(one[some].astype(np.float64), white) for one in (reference, sample))
        found[some] = Formula("CAM16-UCS")(first, second, white)


def _checked(white_xyz: White | None) -> White:
    white = np.zeros(0) if white_xyz is None else np.asarray(white_xyz, dtype=np.float64)
    if white.shape != (3,) or not (np.isfinite(white).all() and (white > 0.0).all()):
        raise InputError(
            "CAM16-UCS needs the white that the images are relative to",
            field="white_xyz",
            found=str(white_xyz),
            expected="X, Y, Z > 0",
        )
    return white / white[1]
