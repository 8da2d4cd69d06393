"""PNG files, 8 or 16 bits a channel, that say what their numbers mean."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.formats.png_writer import png_bytes

SRGB_DISPLAY = "sRGB - Display"


def quantise(rgb: Float[np.ndarray, "H W 3"], bits: int = 8) -> UInt[np.ndarray, "H W 3"]:
    """Round display-encoded RGB in [0, 1] to the nearest code value of 8 or 16 bits."""
    if bits not in (8, 16):
        raise InputError("a PNG holds 8 or 16 bits a channel", field="bits", found=bits, expected="8 or 16")
    top = (1 << bits) - 1
    codes = np.rint(np.clip(rgb.astype(np.float64), 0.0, 1.0) * top)
    return codes.astype(np.uint8 if bits == 8 else np.uint16)


def write_png(
    path: str | Path,
    rgb: Float[np.ndarray, "H W 3"],
    *,
    bits: int = 8,
    display: str | None = None,
    words: Sequence[str] = (),
) -> Path:
    """Write display-encoded RGB as a PNG: beside its name, then renamed, so that half a picture is never seen.

    Tagged as sRGB where the display is sRGB, with `words` as its description.
    """
    chunks = [(b"sRGB", b"\x01")] if display == SRGB_DISPLAY else []
    if words:
        chunks.append((b"iTXt", b"Description\x00\x00\x00\x00\x00" + "\n".join(words).encode("utf-8")))
    with written_whole(path) as beside:
        beside.write_bytes(png_bytes(quantise(rgb, bits), chunks))
    return Path(path)
