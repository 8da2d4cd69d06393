"""Directions of the world in the frames of sites, and back: z is the normal, x and y as for rays of `transfer.hits`."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..transfer.hits import tangents


def local(to: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Directions in frames about their own normals."""
    across, along = tangents(normals)
    return np.stack([np.sum(to * axis, axis=1) for axis in (across, along, normals)], axis=1)


def outward(to: Float[np.ndarray, "n 3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Directions of frames in the world."""
    across, along = tangents(normals)
    return to[:, :1] * across + to[:, 1:2] * along + to[:, 2:] * normals
