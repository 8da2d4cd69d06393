"""PNG pictures for a stated display, as layers: codes converted to XYZ."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...spectral.formats.picture_header import is_srgb, names_srgb, other_than_srgb, profile_of
from ...spectral.srgb import srgb_to_linear
from ...spectral.upsampling import xyz_from_rgb
from .row import PixelLayer, Pixels, Row, RowName

#: Displays whose codes are known to stand for a colour: IEC 61966-2-1.
DISPLAYS = ("sRGB",)


def png_rows(path: Path, material: str | None, display: str | None) -> list[Row]:
    """Return the row of a PNG.

    Parameters
    ----------
    material : name of the row; None takes that of the picture.
    display : of the codes; None takes it from the file.

    Raises
    ------
    InputError : no PNG, no stated display, or a contradicting header that `display` does not resolve.
    """
    path = existing_file(path)
    if display is not None and display not in DISPLAYS:
        raise UnknownNameError("display", display, DISPLAYS, field="--display")
    with _opened(path) as picture:
        data = path.read_bytes()
        said, named, other = _said(picture), names_srgb(picture, data), list(other_than_srgb(picture, data))
        if (profile := profile_of(picture, data)) and not is_srgb(profile):
            other.append("an ICC profile of other colours")
    states = ", ".join(other)
    if display is None and (other or not named):
        raise InputError(
            f"the picture says that its numbers are for {'two displays' if named else 'another display'}"
            if other
            else "the picture does not say which display its numbers are for",
            file=path,
            found=states or None,
            expected="sRGB, by a chunk sRGB or cICP or an ICC profile",
            hint="where its numbers are those of sRGB, state it: --display sRGB",
        )
    remark = f"{path.name} states {states}; read as {display}, as --display says." if other else ""
    name = RowName(material or said.get("material", ""), said.get("illuminant", ""), said.get("observer", ""))
    if material is None:
        name = name._replace(scene=said.get("scene", ""), view=said.get("camera", ""))
    return [Row(name, {"picture": PixelLayer(partial(_pixels, path), path, said, remark=remark)})]


def _opened(path: Path) -> Any:
    from PIL import Image, UnidentifiedImageError

    try:
        return Image.open(path, formats=("PNG",))
    except (OSError, UnidentifiedImageError, SyntaxError, ValueError) as reason:
        raise _damaged(path, reason) from None


def _damaged(path: Path, reason: Exception) -> InputError:
    return InputError("the PNG cannot be read", file=path, found=str(reason)[:160], expected="a whole picture")


def _said(picture: Any) -> dict[str, str]:
    """Find lines such as "observer: CIE 1931 2 Degree Standard Observer" in its description."""
    lines = [line.partition(": ") for line in str(picture.info.get("Description", "")).splitlines()]
    return {label: text for label, sep, text in lines if sep}


def _pixels(path: Path) -> Pixels:
    with _opened(path) as picture:
        # Pillow keeps the first byte of 16 bits, and calls the mode RGB.
        fine = "16" in str(picture.tile[0].args)
        if fine or picture.mode not in ("RGB", "RGBA", "L"):
            found, expected = f"{picture.mode}{', 16 bits' if fine else ''}", "RGB, RGBA or L"
            hint = "write it with 8 bits, or as .exr"
            raise InputError("not 8 bits a channel", file=path, field="mode", found=found, expected=expected, hint=hint)
        try:
            codes = np.asarray(picture.convert("RGBA"))
        except (OSError, SyntaxError, ValueError) as reason:
            raise _damaged(path, reason) from None
    # A code stands for all that is rounded to it.
    matrix, half = xyz_from_rgb(), 0.5 / 255.0
    encoded = codes[..., :3] / 255.0
    coverage = (codes[..., 3] / 255.0).astype(np.float32)
    nudged = partial(_moved, encoded, matrix, half)
    return Pixels(srgb_to_linear(encoded) @ matrix.T, coverage, matrix.sum(axis=1), nudged=nudged)


def _moved(
    encoded: Float[np.ndarray, "H W 3"],
    matrix: Float[np.ndarray, "3 3"],
    half: float,
    rows: slice,
    steps: Float[np.ndarray, "h W 3"],
) -> Float[np.ndarray, "h W 3"]:
    return srgb_to_linear(np.maximum(encoded[rows] + half * steps, 0.0)) @ matrix.T
