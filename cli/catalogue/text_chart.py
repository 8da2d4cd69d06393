"""A spectrum as a small chart of block characters, for a terminal."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

_EIGHTHS = " ▁▂▃▄▅▆▇█"


def text_chart(
    wavelengths_nm: Float[np.ndarray, " L"],
    values: Float[np.ndarray, " L"],
    width: int = 64,
    height: int = 8,
    unit: str = "nm",
) -> str:
    """Draw bars of a spectrum from 0; a column shows the maximum over its range, so that no line is lost.

    unit : of the horizontal axis, if it is not wavelength.

    >>> print(text_chart(np.array([400.0, 500.0, 600.0]), np.array([0.0, 0.5, 1.0]), width=5, height=2))
          1 │   ▃▆
            │▂▅███
          0 └─────
             400 600 nm
    """
    heights = _columns(wavelengths_nm, values, width)
    top = _round_top(float(heights.max(initial=0.0)))
    eighths = np.rint(np.maximum(heights, 0.0) / top * height * 8).astype(int)
    lines = []
    for row in reversed(range(height)):
        bars = "".join(_EIGHTHS[min(max(count - 8 * row, 0), 8)] for count in eighths)
        lines.append(f"{f'{top:g}' if row == height - 1 else '':>7} │{bars}".rstrip())
    lines.append(f"{'0':>7} └" + "─" * width)
    first, last = (f"{edge:g}" for edge in (wavelengths_nm[0], wavelengths_nm[-1]))
    lines.append(f"{'':9}{first}{last:>{max(width - len(first), len(last) + 1)}} {unit}")
    return "\n".join(lines)


def _columns(nm: np.ndarray, values: np.ndarray, width: int) -> np.ndarray:
    edges = np.linspace(nm[0], nm[-1], width + 1)
    heights = np.interp(0.5 * (edges[1:] + edges[:-1]), nm, values)
    place = np.clip(np.searchsorted(edges, nm, side="right") - 1, 0, width - 1)
    # The centre of a column may miss a line among dense samples.
    if len(nm) > width:
        np.maximum.at(heights, place, values)
    return heights


def _round_top(highest: float) -> float:
    if not highest > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(highest))
    return next(decade * step for step in (1.0, 2.0, 5.0, 10.0) if highest <= decade * step * (1 + 1e-9))
