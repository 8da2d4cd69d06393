"""Rendered pictures as XYZ in OpenEXR: the linear result, before any adaptation or display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..errors import InputError
from ..image import ColourImage
from .exr import read_exr, write_exr

# Chromaticities of the axes of XYZ itself, white E, in OpenEXR's order: red, green, blue, white (x, y).
_XYZ_CHROMATICITIES = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)


def write_xyz_exr(
    path: str | Path,
    image: ColourImage,
    coverage: Float[np.ndarray, "H W"] | None = None,
    notes: dict[str, str] | None = None,
) -> None:
    """Write channels X, Y, Z (Y = 1 for the perfect diffuser facing the light) and coverage as A.

    The white goes into attribute `whiteXYZ`, the space into `colourSpace`, `notes` into string attributes.
    """
    channels = {name: image.values[..., index] for index, name in enumerate("XYZ")}
    if coverage is not None:
        channels["A"] = coverage
    attributes = {
        "chromaticities": _XYZ_CHROMATICITIES,
        "colourSpace": image.space,
        "whiteXYZ": np.asarray(image.white_xyz, dtype=np.float32),
        **(notes or {}),
    }
    write_exr(path, attributes, channels)


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
