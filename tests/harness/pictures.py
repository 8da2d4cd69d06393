"""Pictures that the program wrote, read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import read_exr
from metamer.spectral.image import ColourImage


def read_xyz_exr(path: str | Path) -> tuple[ColourImage, Float[np.ndarray, "H W"] | None]:
    """Read a picture that `write_xyz_exr` wrote, and its coverage where it has one."""
    header, channels = read_exr(path)
    missing = [name for name in "XYZ" if name not in channels]
    if missing:
        raise InputError(
            "not an XYZ picture", file=path, field="channels", found=", ".join(list(channels)[:6]), expected="X, Y, Z"
        )
    if "whiteXYZ" not in header:
        raise InputError(
            "the picture does not say which white it is relative to",
            file=path,
            field="whiteXYZ",
            expected="an attribute with X, Y, Z of the perfect diffuser",
        )
    values = np.stack([channels[name] for name in "XYZ"], axis=-1)
    white = np.asarray(header["whiteXYZ"], dtype=np.float64)
    return ColourImage(values, header.get("colourSpace", "xyz"), white), channels.get("A")
