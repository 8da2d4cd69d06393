"""Low-dimensional bases of radiance for light between surfaces, fluorescent ones included.

A fluorescent surface is linear in the light that reaches it, but not wavelength by wavelength, so that light cannot be
factored out of the coefficients and multiplied in at the end, as `SpectralBasis.fold` does. Coefficients of reflectance
relative to a light s would need the operator diag(1/s) D diag(s), which does not exist where s is dark. Coefficients of
*radiance* avoid this: c = A^T v for a radiance v, A^T D B for a surface D, and an observer sees cmf^T B c. A light
enters once, at its own resolution, and a diagonal D is an ordinary surface.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from .axis_letters import Wavelengths
from .basis import SpectralBasis

# Radiances, and views of them, that a basis is made from: more say nothing new and cost an SVD.
_MOST = 4096


#: Donaldson matrices [out, in] (L,L), or of surfaces where nothing changes its wavelength the diagonal (L,) alone.
Matrices = Sequence[np.ndarray] | np.ndarray


def radiance_basis(
    surfaces: Matrices,
    lights: Float[np.ndarray, "m L"],
    sensitivity: Float[np.ndarray, "3 L"],
    wavelengths_nm: Wavelengths,
    *,
    bounces: int = 2,
    size: int | None = None,
) -> SpectralBasis:
    """Compute the balanced basis of radiances after up to `bounces` surfaces, as observed after further ones.

    The rows for `SpectralBasis.balanced` are past paths: D s, D' D s, ..., each light s at Y = 1. Its columns are
    future ones: the observer, D^T cmf, ..., so that both together are one path of at most `bounces` surfaces. This is
    balanced truncation of a linear system (Moore 1981). The first surface is not in the columns: its D s is known
    exactly (`Bispectral.radiance`) and enters as coefficients A^T D s; directly seen surfaces need no basis at all
    (`Bispectral.fold`).

    Parameters
    ----------
    surfaces : on `wavelengths_nm` (`Bispectral.on`).
    lights : spectral power on `wavelengths_nm`, of any scale; steps fine enough for their lines, such as 1 nm.
    sensitivity : `Observer.sensitivity(wavelengths_nm)`.
    bounces : surfaces on a path, 1 or more.
    size : J; default and upper bound is the numerical rank.
    """
    powers = lights / (lights @ sensitivity[1])[:, None]
    generator = np.random.default_rng(1)
    been = _paths(powers, surfaces, bounces, generator)[1:]
    to_come = _paths(sensitivity, [surface.T for surface in surfaces], bounces - 1, generator)
    rows, columns = np.concatenate(been), np.concatenate(to_come)
    return SpectralBasis.balanced(rows, columns.T, size, wavelengths_nm)


def radiance_operators(basis: SpectralBasis, surfaces: Matrices) -> Float[np.ndarray, "n J J"]:
    """Compute A^T D B of each surface, the effect of one more bounce on coefficients of radiance."""
    kinds = {1: basis.operator, 2: basis.bispectral_operator}
    return np.stack([kinds[surface.ndim](surface) for surface in surfaces])


def sent_by(surface: np.ndarray, radiances: Float[np.ndarray, "*n L"]) -> Float[np.ndarray, "*n L"]:
    """Compute D v of each radiance v."""
    return radiances * surface if surface.ndim == 1 else radiances @ surface.T


def _paths(start: np.ndarray, surfaces: Matrices, bounces: int, generator: np.random.Generator) -> list[np.ndarray]:
    """Propagate the rows of `start` over 0, 1, ..., `bounces` surfaces; at most `_MOST` rows of each."""
    steps = [start]
    for _ in range(bounces):
        last = steps[-1]
        chosen = (
            last[generator.choice(len(last), max(1, _MOST // len(surfaces)), replace=False)]
            if (len(last) * len(surfaces) > _MOST)
            else last
        )
        steps.append(np.concatenate([sent_by(surface, chosen) for surface in surfaces]))
    return steps
