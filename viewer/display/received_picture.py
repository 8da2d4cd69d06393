"""Display-encoded images from elsewhere, as XYZ-D65."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.display.aim import PICTURE_WHITE_XYZ
from ...calibration.display.claims import CLAIMS
from ...calibration.display.icc_profile import read_display_profile
from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...spectral.formats.picture_header import HDR, is_srgb, other_than_srgb, profile_of

# Header values of Display P3 (H.273).
_P3 = "primaries of Display P3 (cICP)"


def read_picture(
    path: str | Path,
) -> tuple[UInt8[np.ndarray, "H W 3"], Float[np.ndarray, "H W 3"], tuple[str, ...]]:
    """Read the codes of an image, their XYZ-D65 (Y of white 1), and notes on header data that are not applied.

    Its ICC profile is applied, or the primaries of Display P3; otherwise codes are interpreted as sRGB (IEC 61966-2-1).

    Raises
    ------
    InputError : an unreadable image, or one for an HDR display.
    """
    from PIL import Image, UnidentifiedImageError

    path = existing_file(path)
    try:
        with Image.open(path) as image:
            data = path.read_bytes()
            profile, stated = profile_of(image, data), (*other_than_srgb(image, data), *_dropped(image))
            pixels = _codes(image, path)
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as reason:
        raise InputError(
            "not a picture that can be read", file=path, found=str(reason)[:120], expected="a PNG or JPEG file"
        ) from None
    if any(words.startswith(HDR) for words in stated):
        raise InputError(
            "a picture for an HDR display",
            file=path,
            found=", ".join(stated),
            expected="codes of sRGB, of Display P3, or with an ICC profile",
            hint="save it for sRGB, or name the scene that it is of",
        )
    codes = pixels.reshape(-1, 3) / 255.0
    xyz = CLAIMS["sRGB"].xyz
    if stated == (_P3,):
        xyz, stated = CLAIMS["P3"].xyz, ()
    elif profile and not is_srgb(profile):
        try:
            xyz, stated = partial(read_display_profile(path, profile).xyz, white_xyz=PICTURE_WHITE_XYZ), ()
        except InputError as reason:
            stated = (f"a profile that cannot be used ({reason.problem})", *stated)
    return pixels, xyz(codes).reshape(pixels.shape), stated


def _codes(image: Any, path: Path) -> UInt8[np.ndarray, "H W 3"]:
    """Decode to 8 bits per channel; 16-bit grey is scaled here, since Pillow clips it at 255."""
    if image.mode.startswith("I;16"):
        grey = np.round(np.asarray(image) / 257.0).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=-1)
    if image.mode in ("I", "F"):
        raise InputError(
            "whole numbers or floats on no scale", file=path, found=image.mode, expected="8 or 16 bits a channel"
        )
    return np.asarray(image.convert("RGB"))


def _dropped(image: Any) -> Iterator[str]:
    """Yield descriptions of dropped data such as alpha."""
    if image.mode in ("CMYK", "LAB"):
        yield f"colours in {image.mode}"
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        yield "transparency"
