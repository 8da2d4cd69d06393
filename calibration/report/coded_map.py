"""ΔE maps for a page: pictures that any viewer can show, and whose codes a script converts back to values.

A map is a PNG with a palette. Its pixels are codes of steps that grow by `STEP_SHARE`; its palette is the scale of all
maps. Replacing the palette in place shows the same codes on another scale.
"""

from __future__ import annotations

import struct
import zlib
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from . import plots

#: Code of a value of one budget; so many codes further on stands three times as much.
BUDGET_CODE, STEPS_TO_THREE = 150, 32
#: Growth of the value from one code to the next, as a share.
STEP_SHARE = 3.0 ** (1.0 / STEPS_TO_THREE) - 1.0
#: The largest code that has a value, and those of what is larger, has no number, or is not compared.
LAST, BEYOND, UNDEFINED, NOT_COMPARED = 252, 253, 254, 255


@cache
def code_values() -> Float[np.ndarray, "253"]:
    """Compute the largest ΔE of each code up to `LAST`, in budgets; 0, 1 and 3 budgets are included exactly."""
    return np.concatenate([[0.0], 3.0 ** ((np.arange(1, LAST + 1) - BUDGET_CODE) / STEPS_TO_THREE)])


def map_codes(delta_e: Float[np.ndarray, "H W"], budget: float) -> UInt8[np.ndarray, "H W"]:
    """Return the smallest code whose value is no smaller, so that values over a budget never appear within it."""
    code = np.searchsorted(code_values() * budget, delta_e, side="left")
    return np.where(np.isnan(delta_e), NOT_COMPARED, np.where(np.isinf(delta_e), UNDEFINED, code)).astype(np.uint8)


def map_png(delta_e: Float[np.ndarray, "H W"], budget: float) -> bytes:
    """Encode a ΔE map (NaN: not compared, infinite: no number) as a PNG of its codes, coloured from 0 to three budgets.

    Header and palette take 813 bytes, a multiple of three, so that the palette can be replaced in base64, too.
    """
    codes = map_codes(delta_e, budget)
    height, width = codes.shape
    above = np.zeros_like(codes)
    above[1:] = codes[:-1]
    # Filters 0 and 2 of the specification: as it is, and the difference to the pixel above.
    rows = ((0, codes), (2, codes - above))
    packed = [zlib.compress(np.pad(row, ((0, 0), (1, 0)), constant_values=name).tobytes(), 9) for name, row in rows]
    beyond = np.array([plots.OVER_RGB, plots.UNDEFINED_RGB, plots.NOT_COMPARED_RGB], dtype=np.uint8)
    palette = np.concatenate([plots.delta_e_picture(code_values()[None], 1.0)[0], beyond])
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", palette.tobytes()),
        (b"IDAT", min(packed, key=len)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )


def clear_chunk() -> bytes:
    """Return a chunk that makes pixels without a comparison transparent.

    It follows the palette, so that it shifts neither head nor palette.
    """
    data = b"tRNS" + b"\xff" * NOT_COMPARED + b"\x00"
    return struct.pack(">I", len(data) - 4) + data + struct.pack(">I", zlib.crc32(data))


def code_words(budget: float) -> dict[str, Any]:
    """Return the table of codes for the page's script."""
    return {
        "budget": budget,
        "budgetCode": BUDGET_CODE,
        "stepsToThree": STEPS_TO_THREE,
        "last": LAST,
        "scale": plots.scale_rgb().tolist(),
    }
