"""Additivity of the channels of a display, which every matrix model assumes, tested before one is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...spectral.difference import delta_e_xyz
from .readings import Readings

# ΔE94 of white from the sum of the three at full code: from here on it is said, and from here on a matrix is refused.
_SAID, _REFUSED = 1.0, 3.0


@dataclass(frozen=True)
class Additivity:
    """Additivity from the corners of the cube.

    delta_e : largest ΔE94 of white, yellow, cyan and magenta from the sum of their parts; None without such a corner
    and its parts. luminance : of white over that of its parts, each less black; None likewise. words : as a sentence.
    """

    delta_e: float | None
    luminance: float | None
    words: str

    @property
    def refuses(self) -> bool:
        """True if a matrix would be visibly wrong."""
        return self.delta_e is not None and self.delta_e > _REFUSED

    @property
    def warning(self) -> str | None:
        """Warning of channels that do not add up, else None."""
        return self.words if self.delta_e is None or self.delta_e > _SAID else None


def additivity(readings: Readings) -> Additivity:
    """Measure the additivity of averaged readings."""
    found = {}
    for codes, xyz in zip(readings.codes, readings.xyz, strict=True):
        if np.isin(codes, (0.0, 1.0)).all():
            found[tuple(int(code) for code in codes)] = xyz
    black = found.get((0, 0, 0))
    alone = [found.get(tuple(int(at == channel) for at in range(3))) for channel in range(3)]
    if black is None or any(one is None for one in alone):
        return Additivity(None, None, "whether channels add up is not known: a primary or black was not measured")
    parts = {tuple(int(at == channel) for at in range(3)): one - black for channel, one in enumerate(alone)}
    worst, luminance = None, None
    white = found.get((1, 1, 1), readings.xyz[np.argmax(readings.xyz[:, 1])])
    for codes, xyz in found.items():
        if sum(codes) < 2:
            continue
        summed = black + np.sum([part for which, part in parts.items() if codes[which.index(1)]], axis=0)
        off = float(delta_e_xyz(xyz, summed, white))
        worst = off if worst is None else max(worst, off)
        if sum(codes) == 3:
            luminance = float((xyz[1] - black[1]) / (summed[1] - black[1]))
    if worst is None:
        return Additivity(None, None, "whether channels add up is not known: no mixture of full codes was measured")
    of_white = "" if luminance is None else f"; white is {luminance:.0%} of red, green and blue together"
    return Additivity(worst, luminance, f"mixtures are up to ΔE94 {worst:.1f} from the sum of their parts{of_white}")
