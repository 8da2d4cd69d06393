"""What the two EXR formats share: opening, and channels by name."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import existing_file, written_whole

# Samples over all channels, 2 GB as float32: 4096 x 2048 pixels of 60 wavelengths.
MOST_SAMPLES = 2**29


def read_exr(path: str | Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Header attributes of the first part, and its channels (H,W) float32 by name.

    Raises
    ------
    InputError
        Missing, not OpenEXR, damaged, or, by its header, of more than `MOST_SAMPLES`.
    """
    import OpenEXR

    path = existing_file(path)
    if path.read_bytes()[:4] != b"\x76\x2f\x31\x01":
        raise InputError("not an OpenEXR file", file=path, found=f"first bytes {path.read_bytes()[:4]!r}")
    try:
        with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            _check_size(path, file.header())
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header = dict(file.header())
            channels = {name: np.asarray(channel.pixels, dtype=np.float32) for name, channel in file.channels().items()}
    except (RuntimeError, ValueError, TypeError, KeyError, MemoryError) as reason:
        raise InputError(
            "the OpenEXR file cannot be read",
            file=path,
            found=str(reason).strip(),
            hint="it may be truncated; copy it again",
        ) from None
    return header, channels


def _check_size(path: Path, header: dict) -> None:
    """Before a pixel is read: a damaged header would have memory set aside for a picture that is not there."""
    low, high = header["dataWindow"]
    width, height = (max(0, int(high[axis]) - int(low[axis]) + 1) for axis in (0, 1))
    samples = width * height * len(header["channels"])
    if samples > MOST_SAMPLES:
        raise InputError(
            "too large a picture",
            file=path,
            field="dataWindow",
            found=f"{width} x {height} pixels of {len(header['channels'])} channels",
            expected=f"at most {MOST_SAMPLES} samples in all",
            hint="cut out a part, or save it smaller",
        )


def write_exr(path: str | Path, attributes: dict, channels: dict[str, np.ndarray]) -> None:
    """Write (H,W) channels as float32, ZIP-compressed, beside the name and then in its place."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    pixels = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in channels.items()}
    with written_whole(path) as beside, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        OpenEXR.File(header, pixels).write(str(beside))
