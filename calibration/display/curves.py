"""Tone curves of channels: relative light for a code, from 0 at code 0 to 1 at full code.

Every curve continues as its mirror image below 0, and linearly above 1, since a cube around the display's own needs
values there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

#: Measured curves are interpolated with light to this power, in which usual displays are nearly straight.
NEARLY_STRAIGHT = 1.0 / 2.2


@dataclass(frozen=True)
class GainOffsetGamma:
    """Gain-offset-gamma curve (gain code + 1 - gain) ** gamma, clamped at 0, less its value at code 0.

    Berns, Motta and Gorzynski 1993. gain : above 1 the lowest codes emit no light; below 1 more than a power would.
    """

    gain: float
    gamma: float

    def at(self, codes: Float[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch"]:
        """Evaluate light, 1 at full code."""
        inside = np.minimum(np.abs(codes), 1.0)
        black = max(1.0 - self.gain, 0.0) ** self.gamma
        light = (np.maximum(self.gain * inside + 1.0 - self.gain, 0.0) ** self.gamma - black) / (1.0 - black)
        slope = self.gain * self.gamma / (1.0 - black)
        return np.sign(codes) * (light + slope * np.maximum(np.abs(codes) - 1.0, 0.0))

    @property
    def document(self) -> dict[str, Any]:
        """Stored fields, as JSON."""
        return {"kind": "gain offset gamma", "gain": self.gain, "gamma": self.gamma}


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """Curve through measured points, monotone between them (Fritsch and Carlson 1980, of light to the power 1/2.2).

    codes : (n,) ascending from 0 to 1. light : (n,) from 0 to 1, nowhere falling.
    """

    codes: Float[np.ndarray, " n"]
    light: Float[np.ndarray, " n"]

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.codes, self.light**NEARLY_STRAIGHT)

    @cached_property
    def _slope(self) -> float:
        return float(self._spline(1.0, 1)) / NEARLY_STRAIGHT

    def at(self, codes: Float[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch"]:
        """Evaluate light, 1 at full code."""
        size = np.abs(codes)
        light = np.maximum(self._spline(np.minimum(size, 1.0)), 0.0) ** (1.0 / NEARLY_STRAIGHT)
        return np.sign(codes) * (light + self._slope * np.maximum(size - 1.0, 0.0))

    @property
    def document(self) -> dict[str, Any]:
        """Stored fields, as JSON."""
        return {"kind": "measured", "codes": self.codes.tolist(), "light": self.light.tolist()}


#: A tone curve of one channel.
Curve = GainOffsetGamma | MeasuredCurve


def curve_of(document: dict[str, Any]) -> Curve:
    """Return the curve that a file stores.

    Raises
    ------
    KeyError, TypeError, ValueError : an invalid one.
    """
    if document["kind"] == "gain offset gamma":
        return GainOffsetGamma(float(document["gain"]), float(document["gamma"]))
    if document["kind"] != "measured":
        raise ValueError(f"a curve of kind {document['kind']!r}")
    return MeasuredCurve(np.array(document["codes"], dtype=float), np.array(document["light"], dtype=float))
