"""Histogram of the ΔE of a picture's pixels: counts in growing bins, the same for every row of a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

#: Steps for three times as much, and those on each side of the budget; what lies beyond them is in the outermost.
STEPS_TO_THREE, BELOW, ABOVE = 4, 16, 12
# Size of the drawing, SVG units; a bar is as high as the root of its share, so that few bad pixels show beside many
# good.
_WIDTH, _HEIGHT = 168.0, 36.0


def histogram(delta_e: Float[np.ndarray, "H W"], budget: float) -> tuple[int, ...]:
    """Count pixels in each of `BELOW + ABOVE` bins of a ΔE map (NaN: not compared, infinite: no number, in no bin).

    A bin includes its upper bound: pixels within the budget are in the first `BELOW`.
    """
    values = delta_e[np.isfinite(delta_e)]
    inner = budget * 3.0 ** (np.arange(1 - BELOW, ABOVE) / STEPS_TO_THREE)
    # The budget itself, without rounding.
    inner[BELOW - 1] = budget
    counts = np.bincount(np.searchsorted(inner, values, side="left"), minlength=BELOW + ABOVE)
    return tuple(counts.tolist())


def histogram_plot(counts: Sequence[int], budget: float) -> dict[str, Any]:
    """Return the outline of all bars as one SVG path, the place of the budget, ticks with ΔE, and a description."""
    total, step = max(sum(counts), 1), _WIDTH / len(counts)
    tallest = math.sqrt(max(max(counts, default=0), 1) / total)
    outline = [f"M0 {_HEIGHT:g}"]
    for count in counts:
        height = max(1.0, _HEIGHT * math.sqrt(count / total) / tallest) if count else 0.0
        outline.append(f"V{_HEIGHT - height:.0f}h{step:g}")
    over = sum(counts[BELOW:])
    ticks = [(_place(share), f"{share * budget:.3g}") for share in (0.1, 1.0, 10.0)]
    return {
        "path": "".join([*outline, f"V{_HEIGHT:g}z"]),
        "width": _WIDTH,
        "height": _HEIGHT,
        "budget": _place(1.0),
        "ticks": ticks,
        "words": f"{total - over} pixels up to ΔE94 {budget:g}, {over} above it" if sum(counts) else "no pixels",
    }


def _place(budgets: float) -> float:
    return (BELOW + STEPS_TO_THREE * math.log(budgets, 3.0)) * _WIDTH / (BELOW + ABOVE)
