"""Occlusion by the geometric horizon: light above a point's shading normal and below its triangle's plane.

A point sees what is above both horizons, that of its triangle and that of its shading normal
(`lighting.reference.geometry`).
Between vertices of a coarse mesh the two differ by ten degrees and more, and jump from triangle to triangle: no site at
a vertex knows that, and none has to, since both normals are known at the point.

Near the horizon a spherical Gaussian exp(lambda (v . p - 1)) is a Gaussian in the sine of the elevation, of the width
sigma = 1 / sqrt(lambda). With s and f the sines of its axis above the horizons of the shading normal and of the
triangle, both taken for parallel there, what it sends to the surface is the integral of x exp(-(x - s)^2 / (2 sigma^2))
over x > 0, and over x > s - f where the triangle's horizon is the higher one. Both are elementary:

    g(t) = sigma exp(-(t / sigma)^2 / 2) / sqrt(2 pi) + s Phi(t / sigma),        share = g(f) / g(s).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from .free_share import error_function

# Where the axis is farther below the shading normal's horizon, in sigmas, there is next to no light to share: less than
# a hundredth of it. There `error_function`, good to 4e-4, would be divided by numbers as small.
_LOWEST = -2.0


def share_above(
    facet: Float[np.ndarray, "*n"], shading: Float[np.ndarray, "*n"], sharpness: Float[np.ndarray, "*lobes"] | float
) -> Float[np.ndarray, "*n"]:
    """Return the share, 0 to 1, of the illuminance by a Gaussian that comes from above the triangle's plane.

    Parameters
    ----------
    facet, shading : sines of the axis' elevation above the triangle's plane and above the shading normal's horizon.
    sharpness : lambda, positive.

    Where the triangle's horizon is not the higher one, the share is exactly 1.
    """
    sigma = 1.0 / np.sqrt(sharpness)
    axis = np.maximum(shading / sigma, _LOWEST)
    edge = axis + np.minimum((facet - shading) / sigma, 0.0)

    def sent(to: Float[np.ndarray, "*m"]) -> Float[np.ndarray, "*m"]:
        below = 0.5 + 0.5 * error_function(to * np.sqrt(0.5))
        return np.exp(-0.5 * to * to) / np.sqrt(2.0 * np.pi) + axis * below

    return np.clip(sent(edge) / sent(axis), 0.0, 1.0)
