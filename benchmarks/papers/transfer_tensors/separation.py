"""Highlights taken out of a family before it is factored: four Gaussians about the mirrored view.

Sun et al. 2007 (section 4.1): f = f_s + f_r, f_s a sum of Gaussians about the mirrored direction, of which three
standard deviations cover 0, 7, 14 and 21 degrees; f_r is what a small tensor can hold. The first is as wide as a texel
of the cube maps that light comes from. They find the amplitudes by expectation and maximisation; here they are the
least squares that are not negative, a convex problem with one answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .families import Family

#: Degrees that three standard deviations cover; 0 stands for one texel of a cube map of 64 x 64 texels a face.
WIDTHS = (0.0, 7.0, 14.0, 21.0)
_TEXEL = 90.0 / 64.0
# Cosines of the view that amplitudes are found at, and directions about its mirror: rings as far as this, and places on
# each.
_COSINES, _FARTHEST, _RINGS, _ROUND = 24, np.radians(30.0), 40, 16
# The flattest view: beyond, half of the lobe is below the horizon.
_LOWEST = 0.05


@dataclass(frozen=True, eq=False)
class Separated:
    """The separated highlights of N members.

    cosines (A,) : of views, rising. amplitudes (N,A,4) : f_r, 1/sr, in the middle of each Gaussian. sharpness (4,) :
    lambda of exp(lambda (cos - 1)), the spherical Gaussian of that standard deviation.
    """

    cosines: Float[np.ndarray, " A"]
    amplitudes: Float[np.ndarray, "N A 4"]
    sharpness: Float[np.ndarray, "4"]

    def amplitudes_at(
        self, weights: Float[np.ndarray, " N"], cosine: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 4"]:
        """Interpolate the amplitudes of a mixture of members, linear between views; held beyond the flattest."""
        table = np.einsum("m,mak->ak", weights, self.amplitudes)
        return np.stack([np.interp(cosine, self.cosines, each) for each in table.T], axis=1)

    def values(
        self, amplitudes: Float[np.ndarray, "n 4"], wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """f_s, 1/sr."""
        mirrored = wo * (-1.0, -1.0, 1.0)
        away = np.sum(wi * mirrored, axis=1, keepdims=True) - 1.0
        return np.sum(amplitudes * np.exp(away * self.sharpness), axis=1)


def separated(family: Family) -> Separated:
    """Return the Gaussians of all members, found view by view."""
    from scipy.optimize import nnls

    deviation = np.radians(np.maximum(WIDTHS, _TEXEL)) / 3.0
    sharpness = 1.0 / (deviation * deviation)
    cosines = np.linspace(_LOWEST, 1.0, _COSINES)
    amplitudes = np.zeros((len(family), len(cosines), len(WIDTHS)))
    # Rings come closer together towards the middle, where the narrowest Gaussian is.
    ring = _FARTHEST * ((np.arange(_RINGS) + 0.5) / _RINGS) ** 2
    turn = np.arange(_ROUND) * (2.0 * np.pi / _ROUND)
    # By solid angle: sin(theta), and how far apart rings are there.
    weigh = np.repeat(np.sin(ring) * np.sqrt(ring), _ROUND)
    for place, cosine in enumerate(cosines):
        wo = np.array([np.sqrt(1.0 - cosine * cosine), 0.0, cosine])
        middle = wo * (-1.0, -1.0, 1.0)
        across, along = np.array([cosine, 0.0, wo[0]]), np.array([0.0, 1.0, 0.0])
        flat = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * along
        wi = (np.cos(ring)[:, None, None] * middle + np.sin(ring)[:, None, None] * flat).reshape(-1, 3)
        above = wi[:, 2] > 1e-3
        wi, root = wi[above], np.sqrt(weigh[above])
        bumps = np.exp((np.sum(wi * middle, axis=1) - 1.0)[:, None] * sharpness) * root[:, None]
        values = family.values(wi, np.broadcast_to(wo, wi.shape)) * root
        # f_r falls off from the middle; what is even about it is not the highlight's, and stays.
        for member, value in enumerate(values):
            amplitudes[member, place] = nnls(np.column_stack([bumps, root]), value)[0][:-1]
    return Separated(cosines, amplitudes, sharpness)
