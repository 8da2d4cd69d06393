"""Numbers of texels as the codes of pictures and a factor: glTF has fractions from 0 to 1, of 8 bits or 16."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt

from ...runtime.errors import InputError
from ...spectral.srgb import linear_to_srgb
from ..svbrdf.texel_map import TexelMap

# How far from a code of 8 bits a number may be, in codes, to be that.
_EXACT = 1e-4
# Beyond [0, 1] by less is rounding, and Mallett and Yuksel's white.
_ROUNDING = 1e-6


def coded(
    one: TexelMap, srgb: bool, what: str, notes: list[str]
) -> tuple[UInt[np.ndarray, "H W C"] | None, tuple[float, ...]]:
    """Codes, None where all texels are alike, and what they are multiplied by, C numbers.

    Codes of pictures stay as they came; other numbers become codes of 8 bits where those hold them exactly, else of 16.

    Raises
    ------
    InputError : numbers below 0 or above 1, which are not clipped.
    """
    channels = one.values.shape[2]
    factor = one.scale * channels if len(one.scale) == 1 else one.scale
    if one.size == (1, 1):
        return None, tuple(_within(one.decoded(one.values), what)[0, 0].tolist())
    as_it_came = one.values.dtype.kind == "u" and one.srgb == srgb and not any(one.offset)
    if as_it_came and min(factor) >= 0.0 and max(factor) <= 1.0:
        return one.values, factor
    codes = unit_codes(_encoded(_within(one.decoded(one.values), what), srgb))
    if codes.dtype == np.uint16:
        notes.append(f"{what} is written with 16 bits a channel")
    return codes, (1.0,) * channels


def unit_codes(fractions: Float[np.ndarray, "H W C"]) -> UInt[np.ndarray, "H W C"]:
    """Fractions from 0 to 1 as codes of 8 bits where those are exact, else as the nearest ones of 16."""
    exact = fractions * 255.0
    codes = np.rint(exact)
    if np.abs(exact - codes).max() <= _EXACT:
        return codes.astype(np.uint8)
    return np.rint(fractions * 65535.0).astype(np.uint16)


def filled(codes: UInt[np.ndarray, "H W C"] | None, channels: int) -> UInt[np.ndarray, "H W C"]:
    """Codes with so many channels, grey repeated; where there are none, 1 everywhere."""
    if codes is None:
        return np.full((1, 1, channels), 255, np.uint8)
    return np.repeat(codes, channels, axis=2) if codes.shape[2] == 1 else codes


def _within(values: np.ndarray, what: str) -> np.ndarray:
    beyond = int(((values < -_ROUNDING) | (values > 1.0 + _ROUNDING)).sum())
    if beyond:
        raise InputError(
            "colours that glTF has no numbers for" if values.shape[-1] == 3 else "numbers that glTF does not have",
            field=what,
            found=f"{beyond} of {values.size} from {values.min():.3g} to {values.max():.3g}",
            expected="0 to 1, in linear sRGB",
            hint="export it as --format mitsuba, or a spectral texture as --format exr",
        )
    return np.clip(values, 0.0, 1.0)


def _encoded(linear: np.ndarray, srgb: bool) -> np.ndarray:
    """sRGB of linear light, or the numbers as they are."""
    return linear_to_srgb(linear) if srgb else linear
