"""Synthetic environment with known integrals under Gaussians and over matt surfaces: sky, panel and sun.

World coordinates, y up. Its luminance is in units of the sky's; it has one spectrum.

- sky: 1 above, `GROUND` below, the step between them blurred by a normalised spherical Gaussian of sharpness 400 (3
  degrees), as by haze;
- a soft panel, a Gaussian of sharpness 25 (11 degrees) and peak 4, to the left, 25 degrees up, behind the camera;
- a small sun, a Gaussian of sharpness 1000 (1.8 degrees), to the right, 50 degrees up, whose illuminance is that of the
  whole sky, pi.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from jaxtyping import Float

from ..core.spherical_gaussian import Gaussians, share_in_hemisphere, sphere_integral

GROUND = 0.3
#: Sharpness of what blurs the horizon.
HAZE = 400.0
# Mean cosine about its axis of a Gaussian of that sharpness: coth(lambda) - 1 / lambda.
_HAZE_COSINE = 1.0 - 1.0 / HAZE
#: (sharpness, peak, azimuth from the camera's side to its right, elevation, degrees): the panel, then the sun.
_SOURCES = ((25.0, 4.0, -60.0, 25.0), (1000.0, np.pi / float(sphere_integral(np.array(1000.0))), 40.0, 50.0))
_TABLE = np.linspace(0.0, np.pi, 2049)


@cache
def _sources() -> Gaussians:
    """Make panel and sun, in this order."""
    sharpness, peak, azimuth, elevation = (np.array(column) for column in zip(*_SOURCES, strict=True))
    azimuth, elevation = np.radians(azimuth), np.radians(elevation)
    flat = np.cos(elevation)
    axis = np.stack([flat * np.sin(azimuth), np.sin(elevation), flat * np.cos(azimuth)], axis=1)
    return Gaussians(axis, sharpness, peak)


def sun() -> Gaussians:
    """Return the sun, one lobe."""
    found = _sources()
    return Gaussians(found.axis[1:], found.sharpness[1:], found.amplitude[1:])


def without_sun(directions: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Evaluate the luminance of sky and panel in unit directions."""
    found = _sources()
    panel = np.exp(found.sharpness[0] * (directions @ found.axis[0] - 1.0))
    step = np.interp(directions[:, 1], *_step())
    return GROUND + (1.0 - GROUND) * step + found.amplitude[0] * panel


def under_lobes(axes: Float[np.ndarray, "N 3"], sharpness: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Compute the mean luminance under normalised Gaussians.

    For panel and sun it is exact (`Gaussians.inner`). For the sky, the convolution of lobe and haze is approximated by
    one Gaussian whose mean cosine is the product of theirs: exact for the sphere's first harmonics and for sharp lobes,
    within 1e-4 otherwise.
    """
    elevation = np.arctan2(axes[:, 1], np.hypot(axes[:, 0], axes[:, 2]))
    step = share_in_hemisphere(elevation, _of_mean_cosine(_HAZE_COSINE * _mean_cosine(sharpness)))
    lobes = Gaussians(axes[:, None], sharpness[:, None], 1.0 / sphere_integral(sharpness)[:, None])
    return GROUND + (1.0 - GROUND) * step + lobes.inner(_sources()).sum(axis=1)


def on_normals(normals: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Compute the illuminance on surfaces that face unit directions."""
    found = _sources()
    # Only the constant and the first harmonic of the step reach a matt surface; haze shortens the harmonic.
    sky = np.pi * (GROUND + (1.0 - GROUND) * 0.5 * (1.0 + _HAZE_COSINE * normals[:, 1]))
    between = np.arctan2(
        np.linalg.norm(np.cross(normals[:, None], found.axis), axis=2), np.einsum("nk,sk->ns", normals, found.axis)
    )
    return sky + sum(
        integral * np.interp(angle, _TABLE, _cosine_under(float(one)))
        for integral, angle, one in zip(found.integral, between.T, found.sharpness, strict=True)
    )


@cache
def _step() -> tuple[np.ndarray, np.ndarray]:
    """Return the blurred step over the sine of the elevation."""
    sine = np.linspace(-1.0, 1.0, 4097)
    return sine, share_in_hemisphere(np.arcsin(sine), np.array(HAZE))


@cache
def _cosine_under(sharpness: float) -> Float[np.ndarray, " table"]:
    """Tabulate the mean of max(cos, 0) under a normalised Gaussian, by the angle from normal to axis.

    Its derivative by the angle is minus the mean of the sine's part: one integral over the lobe's polar angle and
    azimuth.
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    # x = 1 - cosine about the axis, in terms of the lobe's own integral from 0 to 1.
    share = 0.5 * (nodes + 1.0)
    x = -np.log1p(share * np.expm1(-2.0 * sharpness)) / sharpness
    azimuth = (np.arange(256) + 0.5) * (np.pi / 256)
    up, out = 1.0 - x, np.sqrt(np.maximum(x * (2.0 - x), 0.0))
    level = out[:, None] * np.cos(azimuth)
    # An angle at a time: all at once would take a quarter of a gigabyte.
    each = (np.maximum(np.cos(angle) * up[:, None] + np.sin(angle) * level, 0.0).mean(axis=1) for angle in _TABLE)
    return np.array([one @ (0.5 * weights) for one in each])


def _mean_cosine(sharpness: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Compute coth(lambda) - 1/lambda of a normalised Gaussian, for lambda >= 0.1."""
    return 1.0 / np.tanh(sharpness) - 1.0 / sharpness


def _of_mean_cosine(wanted: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Find the sharpness of a normalised Gaussian with that mean cosine, by Newton's method from a close start."""
    found = wanted * (3.0 - wanted**2) / (1.0 - wanted**2)
    for _ in range(6):
        slope = 1.0 / found**2 - 1.0 / np.sinh(np.minimum(found, 300.0)) ** 2
        found = np.maximum(found - (_mean_cosine(found) - wanted) / slope, 0.5 * found)
    return found
