"""Quadrature directions for a BRDF slice: fine about the mirror direction, even over the hemisphere.

The mirror direction is sampled by half vectors, in octaves of their angle, which resolves lobes of any width; the rest
by directions to the light, whose grid ends at the horizon. A smooth step in the half vector's angle blends the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

#: Directions per evaluation of a surface: some hold large tables of each.
BLOCK = 256
# End of the fine grid's first cell, angle of the half vector, radians; sharper mirrors are points to it.
_FIRST = 1.0e-4
# Gauss-Legendre nodes an octave.
_NODES = 4


@dataclass(frozen=True)
class Grids:
    """Sampling grids of a slice.

    fade : half vector's angles, radians, between which the weight of the fine grid falls from 1 to 0. azimuths : of the
    fine grid. even : nodes in the cosine, and azimuths, of the even grid.
    """

    fade: tuple[float, float] = (0.35, 0.7)
    azimuths: int = 18
    even: tuple[int, int] = (16, 36)


#: Grids of isotropic surfaces: lobes are wide far from the mirror direction.
PLAIN = Grids()
#: Grids of anisotropic surfaces, with more azimuths: highlights are some five times as long as wide.
STRETCHED = Grids(azimuths=40)


def slice_directions(
    wo: Float[np.ndarray, "3"], grids: Grids = PLAIN
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, " S"]]:
    """Compute unit directions above the horizon and their solid angles, sr, for the slice of `wo` (unit, wo.z > 0)."""
    half, cells, share = _half_vectors(grids)
    toward = half @ wo
    fine = 2.0 * toward[:, None] * half - wo
    # Solid angle of a mirror direction for one of the half vector: 4 (h.wo), Wang et al. 2009, eq. 21.
    weight = cells * share * 4.0 * toward
    lit = (toward > 0.0) & (fine[:, 2] > 0.0)
    even, angles = _hemisphere(*grids.even)
    return (
        np.concatenate([fine[lit], even]),
        np.concatenate([weight[lit], angles * (1.0 - fading(half_angles(even, wo), grids.fade))]),
    )


def half_angles(wi: Float[np.ndarray, "S 3"], wo: Float[np.ndarray, "3"]) -> Float[np.ndarray, " S"]:
    """Compute angles from the normal to the half vectors, radians."""
    between = wi + wo
    # atan2 of lengths: exact where the half vector is near the normal.
    return np.arctan2(np.hypot(between[:, 0], between[:, 1]), between[:, 2])


def fading(angle: Float[np.ndarray, " S"], fade: tuple[float, float]) -> Float[np.ndarray, " S"]:
    """Evaluate a smooth step: 1 up to the first angle of `fade` and 0 from the second."""
    x = np.clip((angle - fade[0]) / (fade[1] - fade[0]), 0.0, 1.0)
    return 1.0 - x * x * (3.0 - 2.0 * x)


@cache
def _half_vectors(grids: Grids) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute half vectors (n,3), the solid angles of their cells (n,) and the weight of the fine grid there (n,)."""
    octaves = int(np.ceil(np.log2(grids.fade[1] / _FIRST)))
    edges = np.concatenate([[0.0], np.geomspace(_FIRST, grids.fade[1], octaves + 1)])
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    low, wide = edges[:-1, None], np.diff(edges)[:, None]
    tilt = (low + wide * 0.5 * (nodes + 1.0)).ravel()
    weight = (wide * 0.5 * weights).ravel() * np.sin(tilt)
    azimuth = 2.0 * np.pi * (np.arange(grids.azimuths) + 0.5) / grids.azimuths
    return (
        _polar(tilt, azimuth),
        np.repeat(weight * 2.0 * np.pi / grids.azimuths, grids.azimuths),
        np.repeat(fading(tilt, grids.fade), grids.azimuths),
    )


@cache
def _hemisphere(count: int, azimuths: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute directions (n,3) over the hemisphere and their solid angles (n,)."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    azimuth = 2.0 * np.pi * (np.arange(azimuths) + 0.5) / azimuths
    angles = np.repeat(0.5 * weights * 2.0 * np.pi / azimuths, azimuths)
    return _polar(np.arccos(0.5 * (nodes + 1.0)), azimuth), angles


def _polar(tilt: Float[np.ndarray, " t"], azimuth: Float[np.ndarray, " a"]) -> Float[np.ndarray, "n 3"]:
    tilt, azimuth = (grid.ravel() for grid in np.meshgrid(tilt, azimuth, indexing="ij"))
    sine = np.sin(tilt)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(tilt)], axis=1)
