"""Angles that factors are functions of: the axes of each frame, and the positions of their nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from .directions import angles, azimuth_difference, folded, half_difference, io_angles

#: "io": incident and outgoing angles; "hd": half and difference angles (docs/conventions.md).
Frame = Literal["io", "hd"]

# Axis names of each frame, in the order of a pack's factors; the fourth is present only for anisotropic materials.
AXIS_NAMES: dict[str, tuple[str, str, str, str]] = {
    "io": ("theta_i", "theta_o", "phi", "phi_i"),
    "hd": ("theta_h", "theta_d", "phi_d", "phi_h"),
}
Direction = Float[np.ndarray, "*#batch 3"]


@dataclass(frozen=True)
class Axis:
    """Nodes of one angle.

    Attributes
    ----------
    name : one of `AXIS_NAMES`.
    size : number of nodes, at least 2.
    maximum : the last node, radians; the first is 0.
    warp : nodes are uniform in u in [0, 1], with angle = maximum u ("linear") or maximum u^2 ("sqrt": dense near 0).
    periodic : the last node equals the first, and angles are taken modulo `maximum`.
    """

    name: str
    size: int
    maximum: float
    warp: Literal["linear", "sqrt"] = "linear"
    periodic: bool = False

    def __post_init__(self) -> None:
        known = [name for names in AXIS_NAMES.values() for name in names]
        if self.name not in known:
            raise InputError("unknown axis", field="name", found=self.name, expected=", ".join(known))
        if self.size < 2:
            raise InputError("too few nodes", field=self.name, found=self.size, expected="at least 2")
        if not (np.isfinite(self.maximum) and self.maximum > 0):
            raise InputError(
                "unusable extent", field=self.name, found=self.maximum, expected="a positive angle, radians"
            )
        if self.warp not in ("linear", "sqrt"):
            raise InputError("unknown warp", field=self.name, found=self.warp, expected="linear or sqrt")

    @property
    def nodes(self) -> Float[np.ndarray, " n"]:
        """Angles of the nodes, radians, ascending."""
        u = np.linspace(0.0, 1.0, self.size)
        return self.maximum * (u if self.warp == "linear" else u * u)

    def position(self, angle: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Compute the fractional node index in [0, size - 1] of an angle in radians; clamped at the ends.

        >>> Axis("theta_h", 5, 1.6, "sqrt").position(np.array([0.0, 0.1, 0.4, 9.0])).tolist()
        [0.0, 1.0, 2.0, 4.0]
        """
        u = np.asarray(angle, dtype=float) / self.maximum
        u = np.mod(u, 1.0) if self.periodic else np.clip(u, 0.0, 1.0)
        return np.asarray((u if self.warp == "linear" else np.sqrt(u)) * (self.size - 1))


@dataclass(frozen=True)
class FrameAngles:
    """Direction pairs as the angles of a frame, computed once for any number of packs over the same geometry.

    `angles` maps an axis name to (N,) radians: "phi" and "phi_d" are folded into [0, pi] unless the azimuth axis is
    there too. `scale` (N,): factor from a tabulated value to f_r cos(theta_i), 0 below the horizon.
    """

    frame: Frame
    angles: dict[str, Float[np.ndarray, " N"]]
    scale: Float[np.ndarray, " N"]
    batch: tuple[int, ...]


def frame_angles(frame: Frame, wi: Direction, wo: Direction, anisotropic: bool = False) -> FrameAngles:
    """Compute the angles of `frame` for unit vectors in the surface frame; batch shapes broadcast."""
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
