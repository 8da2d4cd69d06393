"""Spherical harmonics: an environment in a few numbers, good for what is smooth."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import ive

from ...lighting.environment import latlong, octahedral
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.visibility.visibility import SceneVisibility, hidden_shares

#: Bands from 0 that most is written in, and how many harmonics that is.
BANDS, COUNT = 5, 25
#: The clamped cosine's own factors, band by band (Ramamoorthi and Hanrahan 2001, eq. 8).
COSINE = np.pi * np.array([1.0, 2.0 / 3.0, 1.0 / 4.0, 0.0, -1.0 / 24.0, 0.0, 1.0 / 64.0])
# Side of the map that transfer is a sum over.
_SKY = 64


def harmonics(directions: Float[np.ndarray, "n 3"], bands: int = BANDS) -> Float[np.ndarray, "n B"]:
    """Real, orthonormal harmonics of bands 0 to `bands` - 1 in unit directions; their pole is z.

    Column l^2 + l + m is Y_lm: sines of |m| phi for m < 0, cosines for m > 0, without the Condon-Shortley sign.
    """
    x, y, z = directions.T
    found = np.empty((len(directions), bands * bands))
    # (x + iy)^m holds sin^m(theta) with both the cosine and the sine of m phi.
    turning, around = np.ones(len(directions), dtype=np.complex128), x + 1j * y
    first = np.sqrt(0.25 / np.pi)
    for m in range(bands):
        before, now = np.zeros(len(directions)), np.full(len(directions), first)
        for band in range(m, bands):
            centre = band * band + band
            scale = np.sqrt(2.0) if m else 1.0
            found[:, centre + m] = scale * now * turning.real
            if m:
                found[:, centre - m] = scale * now * turning.imag
            # The next band of the same m, normalised as it goes.
            step = np.sqrt((4.0 * (band + 1) ** 2 - 1.0) / ((band + 1) ** 2 - m * m))
            back = np.sqrt((band * band - m * m) / (4.0 * band * band - 1.0)) if band > m else 0.0
            before, now = now, step * (z * now - back * before)
        first *= np.sqrt((2.0 * m + 3.0) / (2.0 * m + 2.0))
        turning = turning * around
    return found


def project_light(environment: EnvironmentLight, bands: int = BANDS) -> Float[np.ndarray, "K B"]:
    """Return the coefficients of an environment's fields in `harmonics` of the world, cd/m^2 sr^(1/2)."""
    height, width = environment.fields.shape[1:]
    to = latlong.texel_directions(height, width).reshape(-1, 3) @ environment.world_from_map.T
    weights = np.repeat(latlong.solid_angles(height, width), width)
    return (environment.fields.reshape(len(environment.fields), -1) * weights) @ harmonics(to, bands)


def gaussian_factors(sharpness: Float[np.ndarray, " n"], bands: int = BANDS) -> Float[np.ndarray, "n B"]:
    """Compute the factor of each harmonic in the mean under a normalised spherical Gaussian about a direction."""
    safe = np.maximum(np.asarray(sharpness, dtype=float), 1e-8)[:, None]
    band = np.arange(bands)
    factor = ive(band + 0.5, safe) / ive(0.5, safe)
    return np.repeat(factor, 2 * band + 1, axis=1)


def cosine_factors(bands: int = BANDS) -> Float[np.ndarray, " B"]:
    """Compute the factor of each harmonic in the illuminance on a surface with a normal; up to 7 bands."""
    return np.repeat(COSINE[:bands], 2 * np.arange(bands) + 1)


def clamped_cosine(normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 25"]:
    """Coefficients of max(0, n . direction) for unit normals: what a matt surface makes of light where nothing hides
    any, sr. Their sum with the light's coefficients is the illuminance.
    """
    return harmonics(normals) * cosine_factors()


def matt_transfer(
    visibility: SceneVisibility,
    vertices: Int[np.ndarray, "N 3"],
    weights: Float[np.ndarray, "N 3"],
    normals: Float[np.ndarray, "N 3"],
    back: Bool[np.ndarray, " N"] | None = None,
) -> Float[np.ndarray, "N 25"]:
    """Coefficients (`harmonics`) of visibility times clamped cosine, sr, world axes: their sum with those of the
    luminance from all directions is the illuminance of a matt surface. Few harmonics ring: clip that sum at 0.

    normals : unit, of shading, on the side that is seen. Where nothing is hidden the transfer is exactly theirs.
    """
    codes, dark = visibility.mixed(vertices, weights, back)
    to, size = octahedral.texel_directions(_SKY).reshape(-1, 3), octahedral.solid_angles(_SKY)
    flux = harmonics(to) * size[:, None]
    shares = hidden_shares(visibility.along(to), codes, size)
    lost = (shares * np.maximum(normals @ to.T, 0.0)) @ flux
    # At corners inside of solids everything is hidden.
    share, whole = dark[:, None], clamped_cosine(normals)
    return (whole - np.where(share < 1.0, lost, 0.0)) * (1.0 - share)
