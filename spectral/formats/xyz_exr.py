"""Rendered pictures as XYZ in OpenEXR: the linear result, before any adaptation or display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..image import ColourImage
from .exr import write_exr

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
