"""Plots of figures against their cost, as SVG coordinates: scales, ticks, lines, marks and labels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Number = float | int

#: Size of a plot, SVG units.
SIZE = (460.0, 300.0)
# Labels nearer than this, across and down, are one.
_NEAR = (26.0, 7.0)
# Marks of a kind, about the origin: told apart without colour.
MARKS = (
    "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0-4 0Z",
    "M-3.5-3.5H3.5V3.5H-3.5Z",
    "M0-4.6L4.3 3.2H-4.3Z",
    "M0-4.8L4.8 0L0 4.8L-4.8 0Z",
    "M-4-2L-2-4L0-2L2-4L4-2L2 0L4 2L2 4L0 2L-2 4L-4 2L-2 0Z",
    "M0 4.6L4.3-3.2H-4.3Z",
    "M-2-4.5H2L4.5 0L2 4.5H-2L-4.5 0Z",
)


class LogScale:
    """Logarithmic scale on a length: from a round number below the least value to one above the greatest.

    Plots go upwards when `downwards`, since SVG counts down. Values of 0 or less are placed at `floor`.
    """

    def __init__(
        self, values: Sequence[Number], length: float, *, downwards: bool = False, floor: float = 1e-9
    ) -> None:
        self._floor = floor
        logs = np.log10(np.maximum(values, floor))
        self.low, self.high = _below(float(logs.min())), _above(float(logs.max()))
        self._length, self._downwards = length, downwards

    def at(self, value: Number) -> float:
        """Return the place of a value."""
        share = (math.log10(max(value, self._floor)) - self.low) / (self.high - self.low)
        return self._length * ((1.0 - share) if self._downwards else share)

    def ticks(self) -> list[tuple[float, str]]:
        """Return places and labels of round numbers; of whole decades only, if there are many."""
        wide = self.high - self.low > 2.5
        found = [
            tick for tick in _round_logs((1,) if wide else (1, 2, 5)) if self.low <= tick + 1e-9 <= self.high + 2e-9
        ]
        return [(self.at(10.0**tick), short_number(10.0**tick)) for tick in found]


def short_number(value: float) -> str:
    """Return a round number for a tick.

    >>> [short_number(value) for value in (0.0005, 0.001, 200.0, 50000.0, 2e6)]
    ['5e-4', '0.001', '200', '50k', '2M']
    """
    for scale, unit, least in ((1e6, "M", 1e6), (1e3, "k", 1e4)):
        # A power of ten may come out a little low.
        if value > 0.999 * least:
            return f"{value / scale:g}{unit}"
    return f"{value:g}" if value > 0.999e-3 else f"{value:.0e}".replace("e-0", "e-")


def line_plot(series: Mapping[str, Sequence[tuple[Number, Number]]], x_label: str, y_label: str) -> dict[str, Any]:
    """Plot lines through (x, y), both logarithmic: for each its path, its marks, and its own marker and colour."""
    everything = [point for points in series.values() for point in points]
    x = LogScale([point[0] for point in everything], SIZE[0])
    y = LogScale([point[1] for point in everything], SIZE[1], downwards=True)
    lines = []
    for number, (name, points) in enumerate(series.items()):
        places = [(x.at(across), y.at(up)) for across, up in points]
        path = "M" + "L".join(f"{across:.1f} {down:.1f}" for across, down in places) if len(places) > 1 else ""
        lines.append({"name": name, "number": number % len(MARKS), "path": path, "places": places})
    return {"lines": lines, "x_ticks": x.ticks(), "y_ticks": y.ticks(), "x_label": x_label, "y_label": y_label}


def merged_labels(places: Sequence[tuple[Number, Number]], numbers: Sequence[int]) -> list[dict[str, Any]]:
    """Label points with numbers, merging (nearly) coincident ones: text, place and anchor."""
    groups: list[list[int]] = []
    for index, place in enumerate(places):
        near = next((g for g in groups if all(abs(places[g[-1]][k] - place[k]) < _NEAR[k] for k in (0, 1))), None)
        groups.append([index]) if near is None else near.append(index)
    found = []
    for group in groups:
        across = [places[index][0] for index in group]
        down = sum(places[index][1] for index in group) / len(group)
        left = max(across) > 0.8 * SIZE[0]
        # Runs as "3-6": points in one place tend to be neighbours in the list.
        text = ", ".join(runs([numbers[index] for index in group]))
        where = min(across) - 8.0 if left else max(across) + 8.0
        found.append({"text": text, "x": where, "y": down + 3.5, "anchor": "end" if left else "start"})
    return found


def runs(numbers: Sequence[int]) -> list[str]:
    """Format ascending integers, three or more in a row as a range.

    >>> runs([1, 2, 4, 5, 6, 9])
    ['1', '2', '4–6', '9']
    """
    words: list[str] = []
    start = 0
    for end in range(1, len(numbers) + 1):
        if end == len(numbers) or numbers[end] != numbers[end - 1] + 1:
            run = numbers[start:end]
            words += [f"{run[0]}–{run[-1]}"] if len(run) > 2 else map(str, run)
            start = end
    return words


def _round_logs(bases: Sequence[int] = (1, 2, 5)) -> list[float]:
    return [math.log10(base) + power for power in range(-10, 13) for base in bases]


def _below(value: float) -> float:
    return max(tick for tick in _round_logs() if tick <= value - 0.02)


def _above(value: float) -> float:
    return min(tick for tick in _round_logs() if tick >= value + 0.02)
