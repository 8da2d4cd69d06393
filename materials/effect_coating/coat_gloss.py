"""Width of a coat's reflection from its gloss units."""

from __future__ import annotations

from dataclasses import replace

from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..analytic.glossmeter import gloss_of
from .flake_tilt import FlakeTilt

#: Widths of a needle, Beckmann: a mirror to the eye, and a semi-gloss coat.
NARROWEST, WIDEST = 0.008, 0.1


def needle_for(brdf: FlakeTilt, units: float) -> float | None:
    """Find the width of the needle for a coating of these gloss units at 60 degrees; None if none has so few.

    Gloss above the maximum for a coat of that index yields the narrowest.
    """
    from scipy.optimize import root_scalar

    def above(width: float) -> float:
        return gloss_units(replace(brdf, coat_roughness=width, needle=1)) - units

    if above(NARROWEST) <= 0.0:
        return NARROWEST
    if above(WIDEST) > 0.0:
        return None
    return float(root_scalar(above, bracket=(NARROWEST, WIDEST), xtol=1e-4).root)


def gloss_units(brdf: FlakeTilt) -> float:
    """Compute the gloss units of a coating at 60 degrees (ISO 2813)."""
    return gloss_of(brdf, Folding(observer("1931_2"), [illuminant("D65")]), 0.0).units
