"""Lobes fitted to any isotropic BRDF: sharpness and shadowing searched for, spectra solved for.

The search minimises the colour difference of a sphere's pixels, made linear at each pixel's own colour; large ones
count by their size, not by its square (iteratively reweighted). For each sharpness and shadowing that it tries, the
amplitudes are the best that are not negative (variable projection), first of X, Y and Z, at the end of every
wavelength.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ....materials.core.brdf import Brdf
from ....materials.core.protocol import sphere_protocol
from ....runtime.errors import InputError
from ....spectral.difference import lab_from_xyz, lightness_slope
from .brdf import SHADOWING_DEG, GaussianBrdf, HalfGeometry

#: More lobes than this are a table, and seven is the most that the paper uses.
MOST_LOBES = 7
# Sharpness that is searched for, and where it begins.
_BOUNDS, _START = (0.3, 3e4), (3.0, 300.0)
# ln S: from e^-8 at grazing to e; it begins at a root of the cosine, and leaves that at a cost.
_SHADOWING_BOUNDS, _PULL = (-8.0, 1.0), 0.02
_ROUNDS, _STEPS = 3, 12
# ΔE94 below which differences count by their square.
_SMALL = 0.5


def fit_gaussians(brdf: Brdf, lobes: int = 3, *, pixels: int = 40, light: str = "D65") -> GaussianBrdf:
    """Return the `GaussianBrdf` of so many lobes that comes nearest to `brdf`.

    Parameters
    ----------
    lobes : 1 to 7. pixels : across the sphere whose pixels are fitted to. light : that they are seen in.

    Raises
    ------
    InputError : a number of lobes out of range; a BRDF that is anisotropic or not finite on the sphere.
    """
    if not 1 <= lobes <= MOST_LOBES:
        raise InputError("too many lobes or none", field="lobes", found=lobes, expected=f"1 to {MOST_LOBES}")
    if not brdf.isotropic:
        raise InputError("round lobes do not fit", field="brdf", found="anisotropic", expected="an isotropic BRDF")
    sphere = sphere_protocol(pixels, True, light=light)
    cosine = sphere.wi[:, 2]
    leaves = brdf.eval(sphere.wi, sphere.wo) * cosine[:, None]
    if not np.isfinite(leaves).all():
        raise InputError("the BRDF is not finite", field="brdf", found="NaN or infinity on the sphere")
    weights = sphere.weights(brdf.wavelengths_nm)
    xyz = np.pi * leaves @ weights
    differences = colour_difference_slope(xyz, weights.sum(axis=0))
    geometry = HalfGeometry.of(sphere.wi, sphere.wo)
    start = np.concatenate([_first_sharpness(lobes), 0.5 * np.log(np.cos(np.radians(SHADOWING_DEG[1:-1]))), [-2.0]])
    low = np.append(np.full(lobes, np.log(_BOUNDS[0])), np.full(len(start) - lobes, _SHADOWING_BOUNDS[0]))
    high = np.append(np.full(lobes, np.log(_BOUNDS[1])), np.full(len(start) - lobes, _SHADOWING_BOUNDS[1]))
    pull = _PULL * np.sqrt(len(xyz))
    lightness, counts = lightness_slope(xyz[:, 1]), np.ones(len(xyz))

    def terms(found: np.ndarray) -> np.ndarray:
        shadowing = np.exp(np.append(0.0, found[lobes:]))
        return geometry.terms(np.exp(found[:lobes]), shadowing) * cosine[:, None]

    def left(found: np.ndarray) -> np.ndarray:
        made = terms(found)
        residual = made @ _amplitudes(made, xyz, lightness * counts) - xyz
        return np.einsum("nab,nb->na", differences, residual) * counts[:, None]

    from scipy.optimize import least_squares

    found = start
    for _ in range(_ROUNDS):
        search = least_squares(
            lambda at: np.append(left(at).ravel(), pull * (at - start)[lobes:]),
            found,
            bounds=(low, high),
            max_nfev=_STEPS,
        )
        found = search.x
        size = np.linalg.norm(left(found), axis=1) / counts
        counts = 1.0 / np.sqrt(np.maximum(size, _SMALL))
    # In increasing order of sharpness, as the paper has them for textures.
    found[:lobes] = np.sort(found[:lobes])
    spectra = _amplitudes(terms(found), leaves, lightness * counts)
    return GaussianBrdf(
        brdf.wavelengths_nm,
        spectra[0],
        np.exp(found[:lobes]),
        spectra[1 : 1 + lobes],
        spectra[1 + lobes :],
        np.exp(np.append(0.0, found[lobes:])),
    )


def _first_sharpness(lobes: int) -> Float[np.ndarray, " n"]:
    if lobes == 1:
        return np.log([np.sqrt(_START[0] * _START[1])])
    return np.log(np.geomspace(*_START, lobes))


def _amplitudes(terms: np.ndarray, columns: np.ndarray, weights: np.ndarray) -> Float[np.ndarray, "R C"]:
    """Fit to each column (N,C) the amplitudes >= 0 of the terms (N,R) that come nearest to it, by their Gram matrix."""
    from scipy.optimize import nnls

    weighted = terms * weights[:, None]
    scale = np.linalg.norm(weighted, axis=0)
    # A lobe that no pixel sees has no amplitude to find.
    scale = np.where(scale > 0.0, scale, 1.0)
    weighted = weighted / scale
    # The ridge keeps lobes apart that have become one.
    factor = np.linalg.cholesky(weighted.T @ weighted + 1e-9 * np.eye(len(scale)))
    right = np.linalg.solve(factor, weighted.T @ (columns * weights[:, None]))
    return np.stack([nnls(factor.T, one)[0] for one in right.T], axis=1) / scale[:, None]


def colour_difference_slope(xyz: Float[np.ndarray, "N 3"], white: Float[np.ndarray, "3"]) -> Float[np.ndarray, "N 3 3"]:
    """Matrices that turn small changes of XYZ into vectors whose length is ΔE94 from `xyz` (CIE 116-1995)."""
    lab = lab_from_xyz(xyz, white)
    ratio = np.maximum(xyz / white, 0.0)
    slope = np.where(ratio > (24.0 / 116.0) ** 3, np.maximum(ratio, 1e-3) ** (-2.0 / 3.0) / 3.0, 841.0 / 108.0) / white
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    cosine = np.where(chroma > 0.0, lab[:, 1] / np.where(chroma > 0.0, chroma, 1.0), 1.0)
    sine = np.where(chroma > 0.0, lab[:, 2] / np.where(chroma > 0.0, chroma, 1.0), 0.0)
    x, y, z = slope.T
    a = np.stack([500.0 * x, -500.0 * y, 0.0 * z], axis=1)
    b = np.stack([0.0 * x, 200.0 * y, -200.0 * z], axis=1)
    along = (cosine[:, None] * a + sine[:, None] * b) / (1.0 + 0.045 * chroma)[:, None]
    across = (cosine[:, None] * b - sine[:, None] * a) / (1.0 + 0.015 * chroma)[:, None]
    return np.stack([np.stack([0.0 * x, 116.0 * y, 0.0 * z], axis=1), along, across], axis=1)
