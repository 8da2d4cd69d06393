"""Mapping between screen positions and positions in the sides' images, as in `compare.frag`."""

from __future__ import annotations

from .state import Session


def side_under(session: Session, size: tuple[int, int], column: int, row: int) -> tuple[int, int, int]:
    """Return the side (0 is A, 1 is B) shown at a pixel of the display, and its column and row in that side's image.

    A ΔE map counts as A.

    >>> side_under(Session(), (10, 4), 9, 1)
    (0, 9, 1)
    """
    mode, compare = session.seen, session.compare
    if mode == "B":
        return 1, column, row
    if mode == "wipe":
        return int(column + 0.5 >= compare.position * size[0]), column, row
    if mode == "side by side":
        half = size[0] // 2
        side = int(column >= half)
        return side, column - side * half + (size[0] - half) // 2, row
    if mode == "checkerboard":
        cell = max(1, round(compare.cell * size[1]))
        return (column // cell ^ row // cell) & 1, column, row
    return 0, column, row


def seen_at(session: Session, size: tuple[int, int], column: float, row: float) -> tuple[tuple[float, float], ...]:
    """Return the display positions of a position in the sides' images: two if side by side, or none.

    >>> from .state import Compare
    >>> seen_at(Session(compare=Compare("side by side")), (10, 4), 5.0, 1.0)
    ((3.0, 1.0), (8.0, 1.0))
    """
    if session.seen != "side by side":
        return ((column, row),)
    half = size[0] // 2
    here = column - (size[0] - half) // 2
    found = [(here, row)] if 0 <= here < half else []
    if 0 <= here < size[0] - half:
        found.append((here + half, row))
    return tuple(found)
