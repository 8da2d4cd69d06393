"""Octahedral maps of directions: the sphere unfolded onto a square.

Row 0 and column 0 are a corner of the square, at (-1, -1) of its plane (u over columns, v over rows). Up (+y) is the
middle of the square, down (-y) its four corners; +x lies to the right of the middle, +z below it. Praun and Hoppe 2003.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def directions(u: Float[np.ndarray, "*#n"], v: Float[np.ndarray, "*#n"]) -> Float[np.ndarray, "*n 3"]:
    """Unit directions of places (u, v) of the square, each from -1 to 1."""
    u, v = np.broadcast_arrays(u, v)
    up = 1.0 - np.abs(u) - np.abs(v)
    outside = np.maximum(-up, 0.0)
    to = np.stack([u - np.copysign(outside, u), up, v - np.copysign(outside, v)], axis=-1)
    return to / np.linalg.norm(to, axis=-1, keepdims=True)


def places(to: Float[np.ndarray, "*n 3"]) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """(u, v), each from -1 to 1, of directions of any length but 0."""
    x, y, z = np.moveaxis(to, -1, 0)
    size, below = np.abs(x) + np.abs(y) + np.abs(z), y < 0.0
    x, z = x / size, z / size
    return (
        np.where(below, np.copysign(1.0 - np.abs(z), x), x),
        np.where(below, np.copysign(1.0 - np.abs(x), z), z),
    )


def texel_directions(side: int) -> Float[np.ndarray, "side side 3"]:
    """Unit directions of the middles of texels."""
    middles = (2.0 * np.arange(side) + 1.0) / side - 1.0
    return directions(middles[None, :], middles[:, None])


def bordered(texels: Float[np.ndarray, "side side K"]) -> Float[np.ndarray, "padded padded K"]:
    """Return the same map with one texel more at each edge: what lies beyond an edge is that edge's own texels,
    reversed.
    """
    side = len(texels)
    padded = np.empty((side + 2, side + 2, texels.shape[2]), dtype=texels.dtype)
    padded[1:-1, 1:-1] = texels
    padded[0, 1:-1], padded[-1, 1:-1] = texels[0, ::-1], texels[-1, ::-1]
    padded[1:-1, 0], padded[1:-1, -1] = texels[::-1, 0], texels[::-1, -1]
    padded[0, 0], padded[0, -1] = texels[-1, -1], texels[-1, 0]
    padded[-1, 0], padded[-1, -1] = texels[0, -1], texels[0, 0]
    return padded
