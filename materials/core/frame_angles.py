"""Pairs of directions as the angles of a frame, which factors are looked up at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .axes import Frame
from .directions import angles, azimuth_difference, folded, half_difference, io_angles

Direction = Float[np.ndarray, "*#batch 3"]


@dataclass(frozen=True)
class FrameAngles:
    """Direction pairs as the angles of a frame, worked out once for any number of packs over the same geometry.

    `angles` maps an axis name to (N,) radians: "phi" and "phi_d" are folded into [0, pi] unless the azimuth axis is
    there too. `scale` (N,): what a tabulated value is multiplied by to give f_r cos(theta_i), 0 below the horizon.
    """

    frame: Frame
    angles: dict[str, Float[np.ndarray, " N"]]
    scale: Float[np.ndarray, " N"]
    batch: tuple[int, ...]


def frame_angles(frame: Frame, wi: Direction, wo: Direction, anisotropic: bool = False) -> FrameAngles:
    """Return the angles of `frame` for unit vectors in the surface frame; batch shapes broadcast."""
    wi, wo = np.broadcast_arrays(np.asarray(wi, dtype=float), np.asarray(wo, dtype=float))
    batch = wi.shape[:-1]
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    if frame == "io":
        theta_i, theta_o, phi = io_angles(wi, wo)
        values = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
        if anisotropic:
            values |= {"phi": azimuth_difference(wi, wo), "phi_i": angles(wi)[1]}
        return FrameAngles(frame, values, lit.astype(float), batch)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    values = {"theta_h": theta_h, "theta_d": theta_d}
    values |= {"phi_d": phi_d, "phi_h": phi_h} if anisotropic else {"phi_d": folded(phi_d)}
    return FrameAngles(frame, values, np.where(lit, wi[:, 2], 0.0), batch)
