"""Gold with the reflectance that its refractive index gives it, at every wavelength and angle."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
from jaxtyping import Float

from ...materials.analytic.cook_torrance import fresnel, ggx, smith_ggx
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..papers.gaussian_lobes import ndf
from .surface import GlossySurface, masked_by

# Photon energy, eV, with n and k: Johnson and Christy, "Optical constants of the noble metals", Physical Review B 6,
# 4370 (1972), table I.
_ENERGY_EV = (3.37, 3.25, 3.12, 3.00, 2.88, 2.75, 2.63, 2.50, 2.38, 2.26, 2.14, 2.01, 1.88, 1.76, 1.64, 1.51)
_N = (1.48, 1.46, 1.47, 1.46, 1.45, 1.38, 1.31, 1.04, 0.62, 0.43, 0.29, 0.21, 0.14, 0.13, 0.14, 0.16)
_K = (1.895, 1.933, 1.952, 1.958, 1.948, 1.914, 1.849, 1.833, 2.081, 2.455, 2.863, 3.272, 3.697, 4.103, 4.542, 5.083)
# The product of the Planck constant and the speed of light, eV nm.
_HC = 1239.84198
# Angles of incidence whose spectra are taken, degrees; between them reflectance is linear in (1 - cos)^3, which is
# nowhere off by more than 0.005.
_ANGLES = (0.0, 55.0, 70.0, 78.0, 83.0, 87.0, 90.0)


def real_gold(roughness: float) -> GlossySurface:
    """Facets of GGX, alpha as given, that reflect as gold does."""
    return GlossySurface(
        f"gold n k {roughness:g}",
        np.zeros(len(WORKING_WAVELENGTHS_NM)),
        reflectance(_cosines()),
        lambda half: ggx(half[..., 2] ** 2, half[..., 0] ** 2 + half[..., 1] ** 2, roughness),
        partial(masked_by, smith_ggx, roughness),
        partial(ndf.ggx, roughness),
        _shares,
    )


def reflectance(cosine: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N L"]:
    """Fresnel's, of unpolarised light, at cosines of the angle of incidence, on the working wavelengths."""
    nm = _HC / np.array(_ENERGY_EV)
    n, k = (np.interp(WORKING_WAVELENGTHS_NM, nm, values) for values in (_N, _K))
    return fresnel(cosine**2, 1.0 - cosine**2, n, k)


@cache
def _cosines() -> Float[np.ndarray, " R"]:
    return np.cos(np.radians(_ANGLES))


def _shares(cosine: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n R"]:
    """Compute what each of the spectra counts at a cosine: two of them are not 0."""
    nodes, at = (1.0 - _cosines()) ** 3, (1.0 - cosine) ** 3
    return np.stack([np.interp(at, nodes, one) for one in np.eye(len(nodes))], axis=-1)
