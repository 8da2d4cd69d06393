"""Patches as files: `.ti1` for ArgyllCMS, CSV for any other program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import UsageError
from ...runtime.files import written_whole
from ...spectral.srgb import srgb_to_linear

_SUFFIXES = (".ti1", ".csv")


def write_patches(path: str | Path, codes: Float[np.ndarray, "N 3"], bits: int = 8) -> None:
    """Write codes from 0 to 1, rounded to what `bits` can send: by the suffix percent (.ti1) or whole codes (.csv).

    Raises
    ------
    UsageError : another suffix. InputError, NoRoomError : the folder is missing, or its disk full.
    """
    path = Path(path)
    if path.suffix.lower() not in _SUFFIXES:
        raise UsageError(f"{path}: patches are written as {' or '.join(_SUFFIXES)}")
    steps = 2**bits - 1
    sent = np.round(codes * steps).astype(int)
    text = _ti1(sent / steps) if path.suffix.lower() == ".ti1" else _csv(sent, steps)
    with written_whole(path) as beside:
        beside.write_text(text, encoding="utf-8")


def _csv(sent: np.ndarray, steps: int) -> str:
    head = f"# codes from 0 to {steps}; measure X, Y, Z in cd/m2 and add them as further columns\npatch,r,g,b\n"
    return head + "".join(f"{at},{r},{g},{b}\n" for at, (r, g, b) in enumerate(sent, 1))


def _ti1(codes: np.ndarray) -> str:
    """Percent of full scale, with the rough XYZ of sRGB that the format asks for (ArgyllCMS, File formats, .ti1)."""
    xyz = (
        100.0
        * srgb_to_linear(codes)
        @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    )
    rows = "".join(
        f"{at} {' '.join(f'{100.0 * code:.4f}' for code in rgb)} {' '.join(f'{value:.4f}' for value in seen)}\n"
        for at, (rgb, seen) in enumerate(zip(codes, xyz, strict=True), 1)
    )
    return (
        'CTI1\n\nDESCRIPTOR "Patches of a display"\nORIGINATOR "Metamer"\nCOLOR_REP "RGB"\n'
        f"NUMBER_OF_FIELDS 7\nBEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n\n"
        f"NUMBER_OF_SETS {len(codes)}\nBEGIN_DATA\n{rows}END_DATA\n"
    )
