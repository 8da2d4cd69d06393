"""Dyes with smooth spectra: what fibres absorb is added up, then light that wanders between fibres is worked out."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

# K/S of what each dye adds at strength 1: edges (height, nm, width: absorbed below, above where the width is negative)
# and bands (height, nm, width). Made up after the places of absorption of the dyes they are called by.
_DYES: dict[str, tuple[list[tuple[float, float, float]], list[tuple[float, float, float]]]] = {
    "madder": ([(3.2, 590.0, 12.0)], [(1.1, 520.0, 35.0)]),
    "indigo": ([], [(4.5, 655.0, 48.0), (0.7, 410.0, 30.0), (1.0, 595.0, 40.0)]),
    "weld": ([(3.6, 470.0, 14.0)], [(0.4, 420.0, 25.0)]),
    "walnut": ([(1.8, 560.0, 70.0)], [(0.5, 450.0, 60.0)]),
    "verdigris": ([(1.6, 450.0, 18.0), (1.9, 600.0, -20.0)], [(1.2, 680.0, 40.0)]),
    "cochineal": ([], [(3.0, 525.0, 28.0), (2.4, 565.0, 16.0), (0.6, 440.0, 40.0)]),
    "undyed": ([], []),
}
# K/S of wool that nobody dyed: a little in the red, more in the blue.
_FIBRE = (0.008, 0.10, 455.0, 30.0)

#: Names of the dyes.
DYES = tuple(_DYES)


def dyed(name: str, strengths: Float[np.ndarray, " P"] | list[float]) -> Spectrum:
    """Reflectances (P,81) of one dye at several strengths, on the working wavelengths.

    K/S is that of the fibre and `strengths` times that of the dye; R = 1 + K/S - sqrt((K/S)^2 + 2 K/S), a layer so
    thick that nothing comes through (Kubelka and Munk 1931).

    Raises
    ------
    InputError : a dye there is none of, or a strength below 0.
    """
    if name not in _DYES:
        raise InputError("an unknown dye", field="dye", found=name, expected=", ".join(DYES))
    strength = np.asarray(strengths, dtype=np.float64)
    if not (np.isfinite(strength).all() and (strength >= 0.0).all()):
        raise InputError("a strength that no dye has", field="strengths", found=strengths, expected="0 or more")
    nm = WORKING_WAVELENGTHS_NM
    edges, bands = _DYES[name]
    added = np.zeros_like(nm)
    for height, middle, width in edges:
        added += height / (1.0 + np.exp((nm - middle) / width))
    for height, middle, width in bands:
        added += height * np.exp(-0.5 * ((nm - middle) / width) ** 2)
    least, more, middle, width = _FIBRE
    ratio = least + more / (1.0 + np.exp((nm - middle) / width)) + strength[:, None] * added
    return Spectrum.sampled(nm, 1.0 + ratio - np.sqrt(ratio * ratio + 2.0 * ratio))


def together(*dyes: Spectrum) -> Spectrum:
    """Several dyes as one table (P,L): the first dye's strengths, then the next one's."""
    samples = np.concatenate([np.atleast_2d(one.samples) for one in dyes])
    return Spectrum.sampled(dyes[0].wavelengths_nm, samples)
