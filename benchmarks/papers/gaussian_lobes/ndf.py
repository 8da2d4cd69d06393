"""Distributions of half vectors as spherical Gaussians, made when they are needed: nothing is computed per material.

Each function gives lobes (n,) in the surface's frame (z along the normal) whose sum is the distribution D(h), 1/sr.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ....materials.analytic.cook_torrance import ggx as ggx_density
from ....materials.core.spherical_gaussian import Gaussians
from ....runtime.errors import InputError

#: The numbers of lobes that GGX is known in.
GGX_COUNTS = (1, 2, 3, 4, 6)
_GGX_ROUGHNESS = np.array([0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9])
# ln(lambda alpha^2 / 2) of the lobes by their number, a row for each roughness; a lobe at -9.2 is a constant. Found by
# variable projection: Nelder-Mead over these, amplitudes >= 0 solved for, weights as in `ggx`.
_GGX_LOBES = {
    1: ((-0.86,), (-0.86,), (-0.82,), (-0.76,), (-0.72,), (-0.68,), (-0.80,), (-1.57,)),
    2: ((-2.97, -0.43), (-2.75, -0.34), (-2.37, -0.16), (-2.17, -0.02), (-1.86, 0.20), (-1.78, 0.32), (-2.37, 0.27),
        (-9.2, 0.01)),
    3: ((-4.30, -2.04, -0.04), (-3.80, -1.72, 0.11), (-3.38, -1.37, 0.29), (-2.99, -0.97, 0.50), (-2.75, -0.56, 0.73),
        (-3.40, -0.36, 0.85), (-9.2, -0.06, 1.14), (-9.2, 0.01, 1.85)),
    4: ((-5.09, -3.10, -1.35, 0.29), (-4.56, -2.67, -1.08, 0.43), (-4.11, -2.15, -0.71, 0.63),
        (-3.69, -1.56, -0.28, 0.87), (-4.54, -1.06, 0.11, 1.10), (-9.2, -0.55, 0.58, 1.47), (-9.2, -0.26, -0.06, 1.14),
        (-9.2, 0.01, 0.28, 1.84)),
    6: ((-6.27, -4.52, -3.10, -1.77, -0.50, 0.74), (-5.89, -4.06, -2.70, -1.47, -0.29, 0.86),
        (-5.27, -3.07, -1.86, -0.82, 0.16, 1.13), (-9.2, -2.26, -1.11, -0.22, 0.59, 1.41),
        (-9.2, -1.66, -1.19, -0.07, 0.78, 1.56), (-9.2, -2.32, -0.55, -0.24, 0.58, 1.47),
        (-9.2, -1.88, -0.06, 0.07, 1.14, 1.40), (-9.2, -1.85, 0.01, 0.37, 1.45, 1.86)),
}  # fmt: skip
# Angles at which the amplitudes are solved for, dense near the pole.
_ANGLES = 0.5 * np.pi * ((np.arange(120) + 0.5) / 120.0) ** 2
# Y of a perfect mirror's highlight that is dark: a hundredth of white.
_DARK = 0.01
# Spacing of lobes along a stretched highlight, a (r^2 - 1)^(b/2) narrow standard deviations, by their number.
_SPACING = {2: (1.68, 0.655), 3: (1.47, 0.615), 4: (1.30, 0.60), 5: (1.19, 0.585), 6: (1.105, 0.575), 7: (1.035, 0.57)}
# Variances of such a lobe that are tried, in narrow ones.
_VARIANCES = np.geomspace(1.0, 8.0, 40)


def beckmann(roughness: float) -> Gaussians:
    """Cook-Torrance with Gaussian slopes m, and the paper's exp(-(theta/m)^2): lambda = 2/m^2 (eq. 12)."""
    return _round(2.0 / roughness**2, 1.0 / (np.pi * roughness**2))


def blinn_phong(exponent: float) -> Gaussians:
    """(e + 2) / (2 pi) cos^e: lambda = e, as ln(cos) = -(1 - cos) near the pole."""
    return _round(exponent, (exponent + 2.0) / (2.0 * np.pi))


def ward(alpha_x: float, alpha_y: float | None = None, count: int = 1) -> Gaussians:
    """Ward 1992: exp(-tan^2 (cos^2 phi / ax^2 + sin^2 phi / ay^2)) / (pi ax ay), lambda = 2/a^2 along each axis."""
    alpha_y = alpha_x if alpha_y is None else alpha_y
    return stretched(2.0 / alpha_x**2, 2.0 / alpha_y**2, 1.0 / (np.pi * alpha_x * alpha_y), count)


def ashikhmin_shirley(exponent_u: float, exponent_v: float, count: int = 7) -> Gaussians:
    """Ashikhmin and Shirley 2000: sqrt((nu + 1)(nv + 1)) / (2 pi) cos^(nu cos^2 phi + nv sin^2 phi)."""
    top = np.sqrt((exponent_u + 1.0) * (exponent_v + 1.0)) / (2.0 * np.pi)
    return stretched(exponent_u, exponent_v, top, count)


def ggx(roughness: float, count: int = 4) -> Gaussians:
    """GGX of alpha in (0, 1] (Walter et al. 2007, eq. 33) as 1, 2, 3, 4 or 6 lobes.

    Sharpness comes from a table over alpha; the amplitudes, none negative, are those of least squared error in L*, as a
    sphere shows it: a fit of D itself spends its lobes on the top, and the wide skirt, which is what one sees of GGX,
    is lost.

    Raises
    ------
    InputError : a roughness out of range; a number of lobes that is not among `GGX_COUNTS`.
    """
    from scipy.optimize import nnls

    if not 0.0 < roughness <= 1.0:
        raise InputError("out of its domain", field="roughness", found=roughness, expected="a number > 0 and <= 1")
    if count not in _GGX_LOBES:
        expected = ", ".join(map(str, GGX_COUNTS))
        raise InputError("a number of lobes that GGX is not known in", field="count", found=count, expected=expected)
    table = np.array(_GGX_LOBES[count])
    at = np.log(roughness)
    sharpness = [2.0 / roughness**2 * np.exp(np.interp(at, np.log(_GGX_ROUGHNESS), column)) for column in table.T]
    # Below the table's end the highlight is the same, only smaller: the pole is dense enough where the angles shrink
    # too.
    angles = _ANGLES * min(1.0, roughness / _GGX_ROUGHNESS[0])
    density = ggx_density(np.cos(angles) ** 2, np.sin(angles) ** 2, roughness)
    # Area of each angle on a sphere, and the change of L* by a change of D there (CIE 015:2018 eq. 8.3).
    seen = np.sqrt(np.sin(angles) * np.cos(angles) * np.gradient(angles))
    weights = seen * (0.25 * np.pi * density + _DARK) ** (-2.0 / 3.0)
    terms = weights[:, None] * np.exp(-2.0 * np.outer(np.sin(0.5 * angles) ** 2, sharpness))
    scale = np.linalg.norm(terms, axis=0)
    amplitude = nnls(terms / scale, weights * density)[0] / scale
    return Gaussians(np.broadcast_to([0.0, 0.0, 1.0], (count, 3)), np.array(sharpness), amplitude)


def stretched(sharpness_x: float, sharpness_y: float, top: float, count: int) -> Gaussians:
    """top exp(-(lambda_x x^2 + lambda_y y^2) / 2) near the pole, by `count` lobes along the wide axis.

    Lobes stand at equal distances; their common sharpness and their amplitudes are those of least squared error in the
    tangent plane, where every integral is closed.

    Raises
    ------
    InputError : a number of lobes that is not 1 to 7.
    """
    if not 1 <= count <= 7:
        raise InputError("too many lobes or none", field="count", found=count, expected="1 to 7")
    narrow, wide = max(sharpness_x, sharpness_y), min(sharpness_x, sharpness_y)
    ratio = np.sqrt(narrow / wide)
    if count == 1 or ratio < 1.0 + 1e-6:
        # Same height and same integral.
        return _round(np.sqrt(narrow * wide), top)
    factor, power = _SPACING[count]
    places = factor * (ratio**2 - 1.0) ** (0.5 * power) * (np.arange(count) - 0.5 * (count - 1))
    variance, amplitudes = max(
        (_projected(places, ratio, variance) for variance in _VARIANCES), key=lambda found: found[0]
    )[1:]
    tilts = places / np.sqrt(narrow)
    along, up, none = np.sin(tilts), np.cos(tilts), np.zeros(count)
    axis = np.stack([along, none, up] if sharpness_x < sharpness_y else [none, along, up], axis=1)
    return Gaussians(axis, np.full(count, narrow / variance), top * amplitudes)


def _projected(places: np.ndarray, ratio: float, variance: float) -> tuple[float, float, np.ndarray]:
    """Compute how much of the stretched Gaussian lobes of a variance hold at best, that variance, and amplitudes."""
    apart = (places[:, None] - places) ** 2
    gram = np.pi * variance * (np.exp(-apart / (4.0 * variance)) + 1e-9 * np.eye(len(places)))
    across = 2.0 * np.pi * np.sqrt(variance / (1.0 + variance)) * np.sqrt(variance / (ratio**2 + variance)) * ratio
    held = across * np.exp(-(places**2) / (2.0 * (ratio**2 + variance)))
    amplitudes = np.linalg.solve(gram, held)
    return float(amplitudes @ held), variance, amplitudes


def _round(sharpness: float, top: float) -> Gaussians:
    return Gaussians(np.array([[0.0, 0.0, 1.0]]), np.array([float(sharpness)]), np.array([float(top)]))


def slice_of(lobes: Gaussians, half: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """D(h): the sum of lobes (n,) at half vectors."""
    return lobes.value(half[:, None, :]).sum(axis=-1)
