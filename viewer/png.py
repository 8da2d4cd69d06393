"""PNG files, 8 or 16 bits a channel, that say what their numbers mean."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt

from ..spectral.errors import InputError
from ..spectral.files import written_whole

SRGB_DISPLAY = "sRGB - Display"


def quantise(rgb: Float[np.ndarray, "H W 3"], bits: int = 8) -> UInt[np.ndarray, "H W 3"]:
    """Round display-encoded RGB in [0, 1] to the nearest code value of 8 or 16 bits."""
    if bits not in (8, 16):
        raise InputError("a PNG holds 8 or 16 bits a channel", field="bits", found=bits, expected="8 or 16")
    top = (1 << bits) - 1
    codes = np.rint(np.clip(rgb.astype(np.float64), 0.0, 1.0) * top)
    return codes.astype(np.uint8 if bits == 8 else np.uint16)


def png_bytes(codes: UInt[np.ndarray, "H W 3"], display: str | None = None, words: Sequence[str] = ()) -> bytes:
    """A PNG of 8- or 16-bit RGB; tagged as sRGB where the display is sRGB, with `words` as its description.

    Written here, not by Pillow, because Pillow cannot write 16 bits a channel in colour.
    """
    height, width, _ = codes.shape
    depth = 8 * codes.dtype.itemsize
    rows = codes.astype(codes.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8).reshape(height, -1)
    # Filter 1 of the specification (difference to the pixel on the left) suits smooth shading.
    step = 3 * codes.dtype.itemsize
    filtered = np.empty((height, 1 + rows.shape[1]), dtype=np.uint8)
    filtered[:, 0] = 1
    filtered[:, 1 : 1 + step] = rows[:, :step]
    filtered[:, 1 + step :] = rows[:, step:] - rows[:, :-step]
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, 2, 0, 0, 0))]
    if display == SRGB_DISPLAY:
        chunks.append((b"sRGB", b"\x01"))
    if words:
        chunks.append((b"iTXt", b"Description\x00\x00\x00\x00\x00" + "\n".join(words).encode("utf-8")))
    chunks += [(b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def write_png(
    path: str | Path,
    rgb: Float[np.ndarray, "H W 3"],
    *,
    bits: int = 8,
    display: str | None = None,
    words: Sequence[str] = (),
) -> Path:
    """Write display-encoded RGB as a PNG: beside its name, then renamed, so that half a picture is never seen."""
    with written_whole(path) as beside:
        beside.write_bytes(png_bytes(quantise(rgb, bits), display, words))
    return Path(path)
