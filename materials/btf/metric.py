"""Perceptual metric of changes in a BTF: ΔE94 as a metric of each view and light's coefficients.

Least-squares fits of a form should weight residuals by their visibility. Lab is differentiated at the mean colour of
each view and light: ΔE94 of a small change x is then |C^T x|, with C a triangular matrix. The mean is stored with the
form, so that the metric needs no storage; the mean of the texels' own metrics is no better (ΔE94 within 0.01).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.difference import KNEE, lab_from_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer

#: Lights under which a change is judged; one that none of these shows weighs `_UNSEEN`.
LIGHTS = ("D65", "A", "FL11")
# Weight of a coefficient that no light shows, relative to the mean weight: there are other lights.
_UNSEEN = 1e-4
# From f(X), f(Y), f(Z) to L*, a*, b*.
_LAB = np.array([[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]])


def folding_of(lights: tuple[str, ...] = LIGHTS) -> Folding:
    """Make the folding of some lights for the 1931 observer."""
    return Folding(observer("1931_2"), [illuminant(name) for name in lights])


def seen(
    mean: Float[np.ndarray, "*n J"], basis: SpectralBasis, lights: tuple[str, ...] = LIGHTS
) -> Float[np.ndarray, "*n J J"]:
    """Compute for each colour the lower triangular C for which ΔE94 of a small change x of the coefficients is |C^T x|.

    mean : f_r cos(theta_i), 1/sr, coefficients in `basis`. White is the perfect diffuser, lit along its normal.
    lights : illuminants, over which squared ΔE94 is averaged.
    """
    folding = folding_of(lights)
    weights = np.pi * folding.coefficients(basis)
    whites = folding.weights(basis.wavelengths_nm).sum(axis=0)
    flat = np.asarray(mean, dtype=np.float64).reshape(-1, basis.size)
    total = np.zeros((len(flat), basis.size, basis.size))
    for start in range(0, len(whites), 3):
        white, to_xyz = whites[start : start + 3], weights[:, start : start + 3] / whites[start : start + 3]
        xyz = np.maximum(flat @ to_xyz, 0.0)
        # The slope of CIELAB's f; the branch that is not taken is kept from a division by 0.
        slope = np.where(xyz > KNEE, np.cbrt(np.maximum(xyz, KNEE)) ** -2.0 / 3.0, 841.0 / 108.0)
        to_lab = np.einsum("ab,nb,jb->naj", _LAB, slope, to_xyz)
        lab = lab_from_xyz(xyz * white, white)
        chroma = np.hypot(lab[:, 1], lab[:, 2])
        # A grey has no hue, and weighs all directions alike.
        hue = np.divide(lab[:, 1:], chroma[:, None], out=np.zeros((len(flat), 2)), where=chroma[:, None] > 0.0)
        along, around = (1.0 + 0.045 * chroma) ** -2.0, (1.0 + 0.015 * chroma) ** -2.0
        weigh = np.zeros((len(flat), 3, 3))
        weigh[:, 0, 0] = 1.0
        weigh[:, 1:, 1:] = around[:, None, None] * np.eye(2)
        weigh[:, 1:, 1:] += (along - around)[:, None, None] * hue[:, :, None] * hue[:, None]
        total += np.einsum("naj,nab,nbk->njk", to_lab, weigh, to_lab) * (3.0 / len(whites))
    trace = np.trace(total, axis1=1, axis2=2) / basis.size
    total += _UNSEEN * trace[:, None, None] * np.eye(basis.size)
    return np.linalg.cholesky(total).reshape(*np.shape(mean), basis.size)
