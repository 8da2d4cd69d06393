"""Lines of text on a contact sheet, in the font that comes with Pillow: it has hardly a space, and no capital delta."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFont import FreeTypeFont

_DELTA = "Δ"
# Width of a space in sizes of the font, about that of text faces. Pillow's has 0.2, which rounds to two pixels.
_SPACE = 0.36
_PIECES = re.compile(rf"[^ {_DELTA}]+| +|{_DELTA}")
# The delta is drawn at so many times its size and reduced: Pillow's lines are not smoothed.
_FINER = 8


def sheet_font(size: int) -> FreeTypeFont:
    """Return the font that comes with Pillow, `size` pixels high."""
    from PIL import ImageFont

    font = ImageFont.load_default(size)
    assert isinstance(font, ImageFont.FreeTypeFont), "Pillow was built without FreeType"
    return font


def line_length(text: str, font: FreeTypeFont) -> int:
    """Pixels that `write_line` takes for a text."""
    return sum(_advance(piece, font) for piece in _PIECES.findall(text))


def write_line(sheet: Image, at: tuple[int, int], text: str, ink: tuple[int, int, int], font: FreeTypeFont) -> None:
    """Write a text whose top left corner is `at`."""
    from PIL import ImageDraw

    draw, (left, top) = ImageDraw.Draw(sheet), at
    for piece in _PIECES.findall(text):
        if piece == _DELTA:
            _write_delta(sheet, (left, top), ink, font)
        elif piece.strip():
            draw.text((left, top), piece, ink, font)
        left += _advance(piece, font)


def fitted_line(text: str, font: FreeTypeFont, width: int) -> str:
    """Return the text, its middle left out where it is wider than `width` pixels: both ends of an id tell."""
    if line_length(text, font) <= width:
        return text
    kept = len(text)
    while kept > 2:
        kept -= 1
        short = f"{text[: (kept + 1) // 2]}…{text[len(text) - kept // 2 :]}"
        if line_length(short, font) <= width:
            return short
    return "…"


def _advance(piece: str, font: FreeTypeFont) -> int:
    if piece == _DELTA:
        return round(font.getlength("E")) + 1
    if not piece.strip():
        return len(piece) * round(_SPACE * font.size)
    return round(font.getlength(piece))


def _write_delta(sheet: Image, at: tuple[int, int], ink: tuple[int, int, int], font: FreeTypeFont) -> None:
    """A capital delta as tall and as heavy as the capitals beside it."""
    from PIL import Image, ImageDraw

    _, top, _, bottom = font.getbbox("E")
    width, height = _advance(_DELTA, font), round(bottom - top)
    mask = Image.new("L", (_FINER * width, _FINER * height))
    stroke = max(_FINER, round(0.09 * font.size * _FINER))
    low, edge = _FINER * height - 1 - stroke // 2, stroke // 2
    corners = [(edge, low), (_FINER * (width - 1) / 2, edge), (_FINER * (width - 1) - edge, low)]
    ImageDraw.Draw(mask).line([*corners, *corners[:2]], 255, stroke, joint="curve")
    place = (at[0], at[1] + round(top))
    sheet.paste(Image.new("RGB", (width, height), ink), place, mask.resize((width, height), Image.Resampling.BOX))
