"""Real spherical harmonics up to l = 4 over directions of the world, as polynomials of x, y and z.

Orthonormal over the sphere; number l^2 + l + m, with m from -l to l about the z axis, in the signs of Ramamoorthi and
Hanrahan 2001 (A Signal-Processing Framework for Inverse Rendering), without the Condon-Shortley phase.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

#: How many harmonics there are, and how many bands (l from 0).
COUNT, BANDS = 25, 5
# What convolution with the clamped cosine makes of each band (Ramamoorthi and Hanrahan 2001, eq. 8): sr.
_COSINE = np.array([np.pi, 2.0 * np.pi / 3.0, np.pi / 4.0, 0.0, -np.pi / 24.0])


def harmonics(to: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 25"]:
    """The 25 harmonics in unit directions.

    >>> round(float(harmonics(np.array([0.0, 0.0, 1.0]))[2]), 6)  # sqrt(3 / (4 pi)) z
    0.488603
    """
    x, y, z = to[..., 0], to[..., 1], to[..., 2]
    xx, yy, zz = x * x, y * y, z * z
    root = np.sqrt
    pi = np.pi
    return np.stack(
        [
            np.full(np.shape(x), root(1.0 / (4.0 * pi))),
            root(3.0 / (4.0 * pi)) * y,
            root(3.0 / (4.0 * pi)) * z,
            root(3.0 / (4.0 * pi)) * x,
            root(15.0 / (4.0 * pi)) * x * y,
            root(15.0 / (4.0 * pi)) * y * z,
            root(5.0 / (16.0 * pi)) * (3.0 * zz - 1.0),
            root(15.0 / (4.0 * pi)) * x * z,
            root(15.0 / (16.0 * pi)) * (xx - yy),
            root(35.0 / (32.0 * pi)) * y * (3.0 * xx - yy),
            root(105.0 / (4.0 * pi)) * x * y * z,
            root(21.0 / (32.0 * pi)) * y * (5.0 * zz - 1.0),
            root(7.0 / (16.0 * pi)) * z * (5.0 * zz - 3.0),
            root(21.0 / (32.0 * pi)) * x * (5.0 * zz - 1.0),
            root(105.0 / (16.0 * pi)) * z * (xx - yy),
            root(35.0 / (32.0 * pi)) * x * (xx - 3.0 * yy),
            root(315.0 / (16.0 * pi)) * x * y * (xx - yy),
            root(315.0 / (32.0 * pi)) * y * z * (3.0 * xx - yy),
            root(45.0 / (16.0 * pi)) * x * y * (7.0 * zz - 1.0),
            root(45.0 / (32.0 * pi)) * y * z * (7.0 * zz - 3.0),
            root(9.0 / (256.0 * pi)) * (35.0 * zz * zz - 30.0 * zz + 3.0),
            root(45.0 / (32.0 * pi)) * x * z * (7.0 * zz - 3.0),
            root(45.0 / (64.0 * pi)) * (xx - yy) * (7.0 * zz - 1.0),
            root(315.0 / (32.0 * pi)) * x * z * (xx - 3.0 * yy),
            root(315.0 / (256.0 * pi)) * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy)),
        ],
        axis=-1,
    )


def clamped_cosine(normals: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 25"]:
    """Coefficients of max(0, n . direction) for unit normals: what a matt surface makes of light where nothing hides
    any, sr. Their sum with the light's coefficients is the irradiance.
    """
    bands = np.repeat(_COSINE, 2 * np.arange(BANDS) + 1)
    return harmonics(normals) * bands
