"""Light that an RGB material sends out, as a spectrum: the colour is the file's, the wavelengths are made up."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....spectral.illuminants import illuminant
from ....spectral.observers import EFFICACY, observer
from ....spectral.upsampling import upsampling
from ....spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...svbrdf.textures import blocks
from .stand_in import Colour

UNITS = "W.m^-2.sr^-1.nm^-1"


def emission_of(colour: Colour, uplift: str) -> tuple[dict[str, Any], str]:
    """Entries of `original` for the mean of `colour`, whose 1, 1, 1 is 1 cd/m^2 of D65; and a note.

    The spectrum is that of a reflectance of this colour in the light of D65, so that its colour is exact.
    """
    size = colour.texture.size if colour.texture else (1, 1)
    total = sum(np.atleast_3d(colour.at(rows, size)).reshape(-1, 3).sum(axis=0) for rows in blocks(*size))
    texels = size[0] * size[1] if colour.texture else 1
    mean = np.asarray(total, dtype=np.float64) / texels
    light, eye = illuminant("D65"), observer("1931_2")
    white = light.resampled(WORKING_WAVELENGTHS_NM).samples / (EFFICACY * eye.luminous(light))
    values = upsampling(uplift).spectra(mean) * white
    spectrum = {
        "wavelengths_nm": WORKING_WAVELENGTHS_NM,
        "values": values,
        "quantity": "emission",
        "details.units": UNITS,
        "linear_rgb": mean,
    }
    return spectrum, "linear sRGB in cd/m^2, in the light of D65" + ("; the mean of a map" if colour.texture else "")
