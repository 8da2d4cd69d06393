"""What the two EXR formats share: opening, and channels by name."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import existing_file, written_whole


def read_exr(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Header attributes of the first part, and its channels (H,W) float32 by name."""
    import OpenEXR

    path = existing_file(path)
    if path.read_bytes()[:4] != b"\x76\x2f\x31\x01":
        raise InputError("not an OpenEXR file", file=path, found=f"first bytes {path.read_bytes()[:4]!r}")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header = dict(file.header())
            channels = {name: np.asarray(channel.pixels, dtype=np.float32) for name, channel in file.channels().items()}
    except (RuntimeError, ValueError, TypeError) as reason:
        raise InputError(
            "the OpenEXR file cannot be read",
            file=path,
            found=str(reason).strip(),
            hint="it may be truncated; copy it again",
        ) from None
    return header, channels


def write_exr(path: str | Path, attributes: dict, channels: dict[str, np.ndarray]) -> None:
    """Write (H,W) channels as float32, ZIP-compressed, beside the name and then in its place."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    pixels = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in channels.items()}
    with written_whole(path) as beside, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        OpenEXR.File(header, pixels).write(str(beside))
