"""Sprite sheets: many small pictures of one size in few files, without loss.

A page loads only the sheets it shows. Each picture is in a cell with its outermost pixels repeated once around it, so
that enlargement does not mix it with its neighbours.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from ...runtime.files import made_folder, written_whole
from . import plots

# Pictures along a side of a sheet: few enough that any order on the screen needs little more than what it shows.
SIDE = 5
_PER_SHEET = SIDE * SIDE
# Digits of a hash in a name.
_DIGITS = 20


class SpriteSheets:
    """Sheets that are filled in order of arrival; each is encoded when it is full."""

    def __init__(self) -> None:
        self.pixels = 0
        self.count = 0
        self._full: list[bytes] = []
        self._cells: list[UInt8[np.ndarray, "h w 4"]] = []

    def add(self, picture: UInt8[np.ndarray, "H H c"]) -> None:
        """Append a square picture, RGB or with alpha, as large as the first one."""
        self.pixels = self.pixels or picture.shape[0]
        rgba = np.full((self.pixels, self.pixels, 4), 255, dtype=np.uint8)
        rgba[..., : picture.shape[2]] = picture
        self._cells.append(np.pad(rgba, ((1, 1), (1, 1), (0, 0)), mode="edge"))
        self.count += 1
        if len(self._cells) == _PER_SHEET:
            self._full.append(_encoded(self._cells))
            self._cells = []

    def files(self) -> list[bytes]:
        """Encode the last sheet, and return all, WebP files."""
        return [*self._full, *([_encoded(self._cells)] if self._cells else [])]

    def embedded(self) -> list[str]:
        """Encode the last sheet, and return all as addresses that hold them."""
        return [plots.data_uri(file) for file in self.files()]


def write_sheets(folder: Path, sheets: Sequence[bytes]) -> list[str]:
    """Write sheets into a folder, each named by the hash of its content; returns the names in order.

    Sheets of another page stay, since it may still exist (`forget_other_sheets`).
    """
    made_folder(folder)
    names = [f"{hashlib.sha256(sheet).hexdigest()[:_DIGITS]}.webp" for sheet in sheets]
    for name, sheet in zip(names, sheets, strict=True):
        with written_whole(folder / name) as beside:
            beside.write_bytes(sheet)
    return names


def forget_other_sheets(folder: Path, names: Collection[str]) -> None:
    """Remove all other sheets of a folder, and the folder if it is empty."""
    for path in folder.glob(f"{'[0-9a-f]' * _DIGITS}.webp"):
        if path.name not in names:
            path.unlink(missing_ok=True)
    with suppress(OSError):
        folder.rmdir()


def _encoded(cells: list[UInt8[np.ndarray, "h w 4"]]) -> bytes:
    side = cells[0].shape[0]
    columns = min(SIDE, len(cells))
    sheet = np.zeros((-(-len(cells) // columns) * side, columns * side, 4), dtype=np.uint8)
    for number, cell in enumerate(cells):
        row, column = divmod(number, columns)
        sheet[row * side : (row + 1) * side, column * side : (column + 1) * side] = cell
    return plots.lossless(sheet)
