"""PNG files of 8 or 16 bits a channel (ISO/IEC 15948), grey or in colour.

Written here, not by Pillow, because Pillow cannot write 16 bits a channel in colour.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

import numpy as np
from jaxtyping import UInt

# Colour type by number of channels: grey, red green blue, and that with alpha.
_COLOUR_TYPE = {1: 0, 3: 2, 4: 6}


def png_bytes(codes: UInt[np.ndarray, "H W C"], chunks: Iterable[tuple[bytes, bytes]] = ()) -> bytes:
    """Return a PNG of C = 1, 3 or 4 channels, with further `chunks` (kind, content) before its pixels.

    >>> png_bytes(np.zeros((1, 2, 3), np.uint8))[:4]
    b'\\x89PNG'
    """
    height, width, channels = codes.shape
    depth = 8 * codes.dtype.itemsize
    rows = codes.astype(codes.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8).reshape(height, -1)
    # Filter 1 of the specification (difference to the pixel on the left) suits smooth shading.
    step = channels * codes.dtype.itemsize
    filtered = np.empty((height, 1 + rows.shape[1]), dtype=np.uint8)
    filtered[:, 0] = 1
    filtered[:, 1 : 1 + step] = rows[:, :step]
    filtered[:, 1 + step :] = rows[:, step:] - rows[:, :-step]
    every = [(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, _COLOUR_TYPE[channels], 0, 0, 0)), *chunks]
    every += [(b"IDAT", zlib.compress(filtered.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in every
    )
