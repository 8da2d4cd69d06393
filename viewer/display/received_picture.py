"""Pictures that somebody sends, as XYZ-D65."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from ...materials.svbrdf.stated_colours import is_srgb, stated_colours
from ...runtime.errors import InputError
from ...runtime.files import existing_file


def read_srgb(
    path: str | Path,
) -> tuple[UInt8[np.ndarray, "H W 3"], Float[np.ndarray, "H W 3"], tuple[str, ...]]:
    """Pixels and XYZ-D65, Y of white 1 (IEC 61966-2-1), of a picture taken as sRGB; and what else it says that it is.

    Raises
    ------
    InputError : no picture that can be read.
    """
    from PIL import Image, UnidentifiedImageError

    path = existing_file(path)
    try:
        with Image.open(path) as image:
            profile = image.info.get("icc_profile")
            stated = stated_colours(image, path.read_bytes())
            pixels = np.asarray(image.convert("RGB"))
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as reason:
        raise InputError(
            "not a picture that can be read", file=path, found=str(reason)[:120], expected="a PNG or JPEG file"
        ) from None
    from ...calibration.display.claims import CLAIMS

    xyz = CLAIMS["sRGB"].xyz(pixels.reshape(-1, 3) / 255.0).reshape(pixels.shape)
    return pixels, xyz, stated if not profile or is_srgb(profile) else ("a colour profile of its own", *stated)
