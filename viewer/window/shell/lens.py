"""Zoom of an image in its area."""

from __future__ import annotations

from dataclasses import dataclass

#: Largest and smallest zoom, screen pixels per image pixel.
MOST, LEAST = 32.0, 1.0 / 16.0


@dataclass(frozen=True)
class PicturePlace:
    """Position of an image in its area, in screen pixels, and its visible part.

    uv : left, top, right and bottom of the visible part, in shares. seen_size : of the whole image, pixels.
    """

    left: float
    top: float
    width: float
    height: float
    uv: tuple[float, float, float, float]
    seen_size: tuple[int, int]

    @property
    def zoom(self) -> float:
        """Screen pixels per image pixel."""
        return self.width / ((self.uv[2] - self.uv[0]) * self.seen_size[0])

    def pixel_of(self, x: float, y: float) -> tuple[float, float]:
        """Convert a screen position, from the upper left of the visible part, to image pixels."""
        return self.uv[0] * self.seen_size[0] + x / self.zoom, self.uv[1] * self.seen_size[1] + y / self.zoom

    def screen_of(self, column: float, row: float) -> tuple[float, float]:
        """Convert image pixels to a screen position."""
        return (column - self.uv[0] * self.seen_size[0]) * self.zoom, (row - self.uv[1] * self.seen_size[1]) * self.zoom

    def holds(self, at: tuple[float, float]) -> bool:
        """Return whether a position is inside the image."""
        return 0.0 <= at[0] < self.seen_size[0] and 0.0 <= at[1] < self.seen_size[1]


class Lens:
    """Zoom state of an image, initially showing all of it."""

    def __init__(self) -> None:
        self._zoom: float | None = None
        self._middle = (0.5, 0.5)
        self._last = 1.0
        self._size = (1, 1)

    def fit(self) -> None:
        """Show the whole image."""
        self._zoom, self._middle = None, (0.5, 0.5)

    def whole(self, size: tuple[int, int], room: tuple[int, int]) -> PicturePlace:
        """Place an image rendered for its area, at whole pixels without zoom."""
        left, top = max(0, (room[0] - size[0]) // 2), max(0, (room[1] - size[1]) // 2)
        return PicturePlace(left, top, size[0], size[1], (0.0, 0.0, 1.0, 1.0), size)

    def placed(self, size: tuple[int, int], room: tuple[int, int]) -> PicturePlace:
        """Place an image from a file: initially whole and not enlarged."""
        zoom = self._zoom or min(1.0, room[0] / size[0], room[1] / size[1])
        self._last, self._size = zoom, size
        found = []
        for side, space, middle in zip(size, room, self._middle, strict=True):
            seen = min(side, space / zoom)
            start = min(max(middle * side - seen / 2.0, 0.0), side - seen)
            found.append(((space - seen * zoom) // 2, seen * zoom, start / side, (start + seen) / side))
        (left, width, u0, u1), (top, height, v0, v1) = found
        return PicturePlace(left, top, width, height, (u0, v0, u1, v1), size)

    def zoom(self, factor: float, at: tuple[float, float]) -> None:
        """Zoom by a factor about a position of the image, which stays fixed."""
        before = self._last
        self._zoom = min(max(before * factor, LEAST), MOST)
        shift = 1.0 - before / self._zoom
        middle = [
            now + shift * (place / side - now) for now, place, side in zip(self._middle, at, self._size, strict=True)
        ]
        self._middle = min(max(middle[0], 0.0), 1.0), min(max(middle[1], 0.0), 1.0)

    def move(self, right: float, down: float) -> None:
        """Move the image by screen pixels."""
        across = self._middle[0] - right / self._last / self._size[0]
        along = self._middle[1] - down / self._last / self._size[1]
        self._middle = min(max(across, 0.0), 1.0), min(max(along, 0.0), 1.0)
