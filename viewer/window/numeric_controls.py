"""Adjustable numbers of a session, for sliders, wheels and keys."""

from __future__ import annotations

from dataclasses import replace

from .commands import Dial
from .light_choice import LEAST_DIMMING
from .state import LEAST_CELL, Adaptation, Session


def _compare(session: Session, **changes: float) -> Session:
    return replace(session, compare=replace(session.compare, **changes))


EXPOSURE = Dial(
    "exposure", "Exposure", -10.0, 10.0, 0.5, lambda s: s.exposure, lambda s, v: replace(s, exposure=v), "EV"
)  # fmt: skip
SURROUND = Dial(
    "surround", "Surround", 20.0, 90.0, 5.0, lambda s: s.surround, lambda s, v: replace(s, surround=v), "L*"
)  # fmt: skip
DIMMING = Dial(
    "dimming", "Dimming", LEAST_DIMMING, 1.0, 2.0**0.5,
    lambda s: s.light.dimming, lambda s, v: replace(s, light=replace(s.light, dimming=v)), logarithmic=True,
)  # fmt: skip
ROTATION = Dial(
    "rotation", "Light rotation", -180.0, 180.0, 15.0,
    lambda s: s.light.rotation_deg, lambda s, v: replace(s, light=replace(s.light, rotation_deg=v)), "°",
)  # fmt: skip
DEGREE = Dial(
    "degree", "Degree of adaptation", 0.0, 1.0, 0.05,
    lambda s: s.adaptation.degree, lambda s, v: replace(s, adaptation=Adaptation(s.adaptation.method, v)),
)  # fmt: skip
TOLERANCE = Dial(
    "tolerance", "Tolerance", 0.01, 100.0, 2.0**0.5,
    lambda s: s.compare.tolerance, lambda s, v: _compare(s, tolerance=v), "ΔE", logarithmic=True,
)  # fmt: skip
SCALE = Dial(
    "scale", "ΔE scale", 0.01, 100.0, 2.0, lambda s: s.compare.scale, lambda s, v: _compare(s, scale=v), "ΔE",
    logarithmic=True,
)  # fmt: skip
POSITION = Dial(
    "wipe", "Wipe position", 0.0, 1.0, 0.05, lambda s: s.compare.position, lambda s, v: _compare(s, position=v)
)  # fmt: skip
CELL = Dial(
    "cell", "Checkerboard cell", LEAST_CELL, 1.0, 2.0, lambda s: s.compare.cell,
    lambda s, v: _compare(s, cell=v), logarithmic=True,
)  # fmt: skip
TURNTABLE = Dial(
    "turntable", "Turntable speed", -360.0, 360.0, 15.0,
    lambda s: s.turntable_deg_s, lambda s, v: replace(s, turntable_deg_s=v), "°/s",
)  # fmt: skip
SAMPLES = Dial(
    "samples", "Samples a pixel's side", 1.0, 16.0, 1.0, lambda s: s.samples,
    lambda s, v: replace(s, samples=round(v)),
)  # fmt: skip

DIALS = (
    EXPOSURE, SURROUND, DIMMING, ROTATION, DEGREE, TOLERANCE, SCALE, POSITION, CELL, TURNTABLE, SAMPLES,
)  # fmt: skip
