"""Spectra that tests of matches share."""

from __future__ import annotations

import numpy as np
from metamer.spectral.sample import Sample
from metamer.spectral.spectrum import Spectrum

NM = np.arange(380.0, 731.0, 10.0)
ORANGE = 0.15 + 0.5 / (1.0 + np.exp(-(NM - 560.0) / 20.0))


def sample(name, *rows, nm=NM, **facts):
    """Readings of one thing."""
    return Sample(name, "test", tuple(Spectrum.sampled(nm, row) for row in rows), **facts)


def metamer_of(row, light="D65", eye="1964_10", size=0.04):
    """Another spectrum of the same colour under one light."""
    from metamer.spectral.illuminants import illuminant
    from metamer.spectral.observers import observer

    seen = observer(eye).weights(illuminant(light), NM)
    wave = size * np.sin((NM - 380.0) / 25.0)
    return row + wave - seen.T @ np.linalg.solve(seen @ seen.T, seen @ wave)
