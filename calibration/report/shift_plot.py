"""Colour shifts as arrows in CIELAB: from before to after, magnified until visible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Side of the drawing, SVG units.
SIZE = 300.0
# The longest arrow, as a share of the drawing, and the factors that arrows are lengthened by.
_LONGEST, _FACTORS = 0.16, tuple(step * 10**power for power in range(5) for step in (1, 2, 5))
# Room around the colours, in CIELAB, and a shift that is none.
_ROOM, _NONE = 6.0, 1e-9
_HEAD = 5.0


@dataclass(frozen=True)
class ShiftArrow:
    """A colour (L*, a*, b*), its shift, its name, style and link."""

    name: str
    lab: Sequence[float]
    off: Sequence[float]
    style: str = ""
    leads_to: str = ""


def shift_plots(shifts: Sequence[ShiftArrow]) -> dict[str, Any] | None:
    """Plot two planes, a* b* and C* L*, with the same factor for both; None without colours."""
    known = [one for one in shifts if np.isfinite([*one.lab, *one.off]).all()]
    if not known:
        return None
    labs, offs = np.array([one.lab for one in known]), np.array([one.off for one in known])
    ends = labs + offs
    chroma = np.hypot(labs[:, 1], labs[:, 2])
    moved = np.hypot(ends[:, 1], ends[:, 2]) - chroma
    planes = (
        ("a*", "b*", labs[:, 1:], offs[:, 1:], True),
        ("C*", "L*", np.stack([chroma, labs[:, 0]], axis=1), np.stack([moved, offs[:, 0]], axis=1), False),
    )
    boxes = [_box(points, centred) for _, _, points, _, centred in planes]
    longest = max(float(np.hypot(*off.T).max()) / box[1] for (_, _, _, off, _), box in zip(planes, boxes, strict=True))
    factor = max((one for one in _FACTORS if one * longest <= _LONGEST), default=_FACTORS[0])
    if longest <= _NONE:
        factor = _FACTORS[0]
    return {
        "factor": factor,
        "size": SIZE,
        "largest": max(known, key=lambda one: float(np.linalg.norm(one.off))),
        "planes": [
            _plane(known, plane[0], plane[1], plane[2], plane[3], box, factor)
            for plane, box in zip(planes, boxes, strict=True)
        ],
    }


def _box(points: np.ndarray, centred: bool) -> tuple[np.ndarray, float]:
    """Return the lower left corner and width of a square about points; `centred` includes the neutral point."""
    if centred:
        points = np.concatenate([points, np.zeros((1, 2))])
    low, high = points.min(axis=0) - _ROOM, points.max(axis=0) + _ROOM
    width = float((high - low).max())
    return 0.5 * (low + high) - 0.5 * width, width


def _plane(
    known: Sequence[ShiftArrow],
    across: str,
    up: str,
    points: np.ndarray,
    offs: np.ndarray,
    box: tuple[np.ndarray, float],
    factor: int,
) -> dict[str, Any]:
    corner, width = box
    scale = SIZE / width

    def at(values: np.ndarray) -> np.ndarray:
        return (values - corner) * [scale, -scale] + [0.0, SIZE]

    starts, ends = at(points), at(points + factor * offs)
    step = next(one for one in (5.0, 10.0, 20.0, 50.0, 100.0) if width / one <= 6.0 or one == 100.0)
    x, y = (np.arange(np.ceil(low / step), np.floor((low + width) / step) + 1) * step + 0.0 for low in corner)
    return {
        "across": across,
        "up": up,
        "x_ticks": [(float((one - corner[0]) * scale), f"{one:g}") for one in x],
        "y_ticks": [(float(SIZE - (one - corner[1]) * scale), f"{one:g}") for one in y],
        "arrows": [
            {
                "path": _arrow(start, end),
                "at": start.tolist(),
                "name": one.name,
                "style": one.style,
                "leads_to": one.leads_to,
                "words": "ΔL* {:+.2f}, Δa* {:+.2f}, Δb* {:+.2f}".format(*one.off),
            }
            for one, start, end in zip(known, starts, ends, strict=True)
        ],
    }


def _arrow(start: np.ndarray, end: np.ndarray) -> str:
    """Return a line with two barbs; shorter than these, a line alone."""
    off = end - start
    length = float(np.hypot(*off))
    line = f"M{start[0]:.1f} {start[1]:.1f}L{end[0]:.1f} {end[1]:.1f}"
    if length <= _HEAD:
        return line
    along = off / length
    barbs = [end - _HEAD * (along + side * 0.5 * np.array([-along[1], along[0]])) for side in (1.0, -1.0)]
    return line + "".join(f"M{barb[0]:.1f} {barb[1]:.1f}L{end[0]:.1f} {end[1]:.1f}" for barb in barbs)
