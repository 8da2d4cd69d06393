"""Warp from half vectors to light directions: a viewer's slice of a BRDF, each lobe warped into one lobe."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ....materials.core.spherical_gaussian import Gaussians

#: The least cosine between half vector and viewer that the warp is taken at: at 90 degrees the mirrored lobe has no
#: width across at all, and one isotropic lobe of it would be infinitely sharp.
LEAST_COSINE = 1e-3


def mirrored(viewer: Float[np.ndarray, "... 3"], half: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """psi: the light that a facet with normal `half` sends to the viewer, 2 (o . h) h - o (eqs. 17 and 18)."""
    return 2.0 * np.sum(viewer * half, axis=-1, keepdims=True) * half - viewer


def stretch(viewer: Float[np.ndarray, "... 3"], half: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "..."]:
    """tau = 4 |h . o|, the solid angle of light by that of half vectors (eq. 21).

    The printed quotient of cross products is 0/0 at the pole of its own theta and phi; its value is this everywhere. It
    is never below 4 `LEAST_COSINE`.
    """
    return np.asarray(4.0 * np.maximum(np.abs(np.sum(viewer * half, axis=-1)), LEAST_COSINE))


def warped(lobes: Gaussians, viewer: Float[np.ndarray, "... 3"]) -> Gaussians:
    """Return a distribution of half vectors over directions of light (eqs. 16 to 20): D*(h) -> W*(i).

    A lobe's amplitude stays, its support grows by tau at its own axis: sharpness lambda / tau. viewer : unit; its shape
    and the lobes' broadcast.
    """
    sharpness = lobes.sharpness / stretch(viewer, lobes.axis)
    axis = mirrored(viewer, lobes.axis)
    return Gaussians(axis, sharpness, np.broadcast_to(lobes.amplitude, sharpness.shape))
