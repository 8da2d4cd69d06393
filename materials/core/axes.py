"""The angles that factors are functions of: which a frame has, and where the nodes of one lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError

#: "io": incident and outgoing angles; "hd": half and difference angles (docs/conventions.md).
Frame = Literal["io", "hd"]

# Axis names of each frame, in the order of a pack's factors; the fourth is present only for anisotropic materials.
AXIS_NAMES: dict[str, tuple[str, str, str, str]] = {
    "io": ("theta_i", "theta_o", "phi", "phi_i"),
    "hd": ("theta_h", "theta_d", "phi_d", "phi_h"),
}


@dataclass(frozen=True)
class Axis:
    """Nodes of one angle.

    Attributes
    ----------
    name : one of `AXIS_NAMES`.
    size : number of nodes, at least 2.
    maximum : the last node, radians; the first is 0.
    warp : nodes are uniform in u in [0, 1], with angle = maximum u ("linear") or maximum u^2 ("sqrt": dense near 0).
    periodic : the last node is the same direction as the first, and angles are taken modulo `maximum`.
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
        """Fractional node index in [0, size - 1] of an angle in radians; held constant past the ends.

        >>> Axis("theta_h", 5, 1.6, "sqrt").position(np.array([0.0, 0.1, 0.4, 9.0])).tolist()
        [0.0, 1.0, 2.0, 4.0]
        """
        u = np.asarray(angle, dtype=float) / self.maximum
        u = np.mod(u, 1.0) if self.periodic else np.clip(u, 0.0, 1.0)
        return np.asarray((u if self.warp == "linear" else np.sqrt(u)) * (self.size - 1))
