"""Linear red, green and blue of spectra, for files that hold nothing else: what D65 shows the CIE 1931 observer."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import xyz_from_rgb
from ..svbrdf.map_set import MapSet
from ..svbrdf.textures import blocks


def shown_colour(
    spectra: Float[np.ndarray, "*texels L"], wavelengths_nm: Float[np.ndarray, " L"]
) -> Float[np.ndarray, "*texels 3"]:
    """Linear sRGB of reflectances under D65, also beyond [0, 1]; the perfect diffuser is (1, 1, 1)."""
    weights = observer("1931_2").weights(illuminant("D65"), wavelengths_nm)
    return spectra @ (np.linalg.inv(xyz_from_rgb()) @ weights).T


def shown_base(surface: MapSet) -> Float[np.ndarray, "H W 3"]:
    """Linear sRGB of the base colour of maps; of measured spectra, as D65 shows them."""
    base = surface.base
    if surface.uplift:
        return base.decoded(base.values)
    rows = blocks(*base.size)
    return np.concatenate([shown_colour(base.decoded(base.values[some]), surface.wavelengths_nm) for some in rows])
