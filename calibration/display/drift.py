"""Drift of a display during its measurement, estimated from white between the patches, and removed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from .readings import Readings

# Whites that are needed before drift is told from noise, and before it is smoothed.
_FEWEST, _SMOOTHED = 3, 5
# Weights of bending that are tried, over places from 0 to 1, smoothest first: no drift at all, a straight line nearly.
_SMOOTHING = (np.inf, *(10.0**power for power in range(1, -6, -1)))
# Share of luminance: what repeats of white scatter by, from which on no steady drift is behind it.
_RESTLESS = 0.01


@dataclass(frozen=True, eq=False)
class Drift:
    """Readings corrected for drift, and the drift.

    Parameters
    ----------
    readings : as if the display had been in its final state all along.
    luminance : of the last white over that of the first, by the smooth course; None if unknown.
    scatter : of luminances of white about that course, relative, root mean square; None likewise.
    words : as a sentence.
    """

    readings: Readings
    luminance: float | None
    scatter: float | None
    words: str

    @property
    def warning(self) -> str | None:
        """Warning about the readings, or None."""
        if self.scatter is None or self.scatter <= _RESTLESS:
            return None
        return (
            f"white comes out differently each time, by {self.scatter:.1%}: the display limits its brightness by what "
            "it shows, or the instrument moved; switch limiters off, and show patches on the same background"
        )


def without_drift(readings: Readings) -> Drift:
    """Divide each reading by the course of white at its place, per X, Y and Z.

    The course is a smoothing spline through the whites (Wahba 1990; smoothed by leave-one-out cross-validation), linear
    for fewer than five of them.
    """
    whites = readings.whites
    apart = whites[np.diff(whites, prepend=-2) > 1]
    if len(apart) < _FEWEST:
        words = f"drift is not known: white was measured {len(apart)} times between patches, {_FEWEST} are needed"
        return Drift(readings, None, None, words)
    course = _course(whites.astype(np.float64), readings.xyz[whites], np.arange(len(readings), dtype=np.float64))
    seen = readings.xyz[whites, 1] / course[whites, 1]
    # Residuals of the fit underestimate the scatter: it takes three degrees of freedom.
    scatter = float(np.sqrt(np.sum((seen - 1.0) ** 2) / max(len(whites) - 3, 1)))
    luminance = float(course[whites[-1], 1] / course[whites[0], 1])
    words = f"white drifted by {luminance - 1.0:+.2%} from first to last; taken out by {len(whites)} readings of it"
    steady = replace(readings, xyz=readings.xyz * (course[whites[-1]] / course), notes=(*readings.notes, words))
    return Drift(steady, luminance, scatter, words)


def _course(
    places: Float[np.ndarray, " W"], whites: Float[np.ndarray, "W 3"], at: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N 3"]:
    """Compute XYZ of white at every place, clamped before the first and after the last."""
    held = np.clip(at, places[0], places[-1])
    if len(places) < _SMOOTHED:
        return np.stack([np.interp(held, places, column) for column in whites.T], axis=1)
    scale, span = whites.mean(axis=0), places[-1] - places[0]
    known, wanted = (places - places[0]) / span, (held - places[0]) / span
    best, least = _SMOOTHING[0], np.inf
    if len(places) > _SMOOTHED:
        for smoothing in _SMOOTHING:
            # One smoothness for X, Y and Z: three times as many readings speak for it.
            off = np.empty((len(known), 3))
            for out in range(len(known)):
                kept = np.arange(len(known)) != out
                off[out] = _spline(known[kept], whites[kept] / scale, known[out : out + 1], smoothing)[0]
            left = float(np.sum((off - whites / scale) ** 2))
            if left < least:
                best, least = smoothing, left
    return _spline(known, whites / scale, wanted, best) * scale


def _spline(known: np.ndarray, values: np.ndarray, wanted: np.ndarray, smoothing: float) -> np.ndarray:
    if np.isinf(smoothing):
        return np.repeat(values.mean(axis=0, keepdims=True), len(wanted), axis=0)
    from scipy.interpolate import make_smoothing_spline

    return make_smoothing_spline(known, values, lam=smoothing)(wanted)
