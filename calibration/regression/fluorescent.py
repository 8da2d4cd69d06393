"""Pictures of fluorescent surfaces as colours under a light: each pixel as `Bispectral.fold` has its matrix."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...spectral.bispectral import ANTI_STOKES_TOLERANCE, band_widths
from ...spectral.formats.spectral_exr import SpectralImage
from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum


def fluorescent_xyz(image: SpectralImage, light: Spectrum, observer: Observer) -> Float[np.ndarray, "H W 3"]:
    """XYZ of what leaves each pixel under `light`; Y of the perfect diffuser is 1, and a pixel may exceed it.

    Raises
    ------
    InputError : a pixel sends out more power than it takes in, or light at shorter wavelengths.
    """
    assert image.reradiation is not None
    height, width, bands, _ = image.reradiation.shape
    matrices = image.reradiation.reshape(-1, bands, bands)
    widths = band_widths(image.spectrum.wavelengths_nm)
    power = np.einsum("noi,o->ni", matrices, widths) / widths
    upward = np.max([matrices[:, out, out + 1 :].max(axis=1) for out in range(bands - 1)], axis=0)
    # A matrix is checked as it is made: those of the pixels that are likeliest to be refused.
    surface = image.bispectral(*divmod(int(power.max(axis=1).argmax()), width))
    if upward.max() > ANTI_STOKES_TOLERANCE:
        image.bispectral(*divmod(int(upward.argmax()), width))
    # All matrices have the axes of this one, and so what its bands take of the light, and what is seen of them.
    weights = observer.sensitivity(surface.wavelengths_out_nm)[:, :, None] * surface.excitation(light)
    weights /= observer.luminous(light)
    diagonal = np.arange(bands)
    weights[:, diagonal, diagonal] = observer.weights(light, surface.wavelengths_out_nm)
    return (matrices.reshape(len(matrices), -1) @ weights.reshape(3, -1).T).reshape(height, width, 3)
