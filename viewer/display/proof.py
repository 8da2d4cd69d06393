"""A soft proof: what another display makes of a picture, shown on this one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .transform import DisplayTransform


@dataclass(frozen=True)
class Proof:
    """A display whose range of colours is shown on another one.

    The picture is encoded for it, clipped to [0, 1] as it clips, decoded again, and then sent to the display that there
    is: what lies outside of both is clipped twice.
    """

    of: DisplayTransform

    def apply(self, xyz_d65: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """XYZ under the display's white as the other display would show it; float32.

        Raises
        ------
        InputError : its transform cannot be turned round.
        """
        return self.of.decode(np.clip(self.of.apply(xyz_d65), 0.0, 1.0))


def proof_of(display: DisplayTransform, named: str | None) -> Proof | None:
    """Return the proof of another display of the same configuration, by the view that is called alike; None for no
    name.

    Raises
    ------
    UnknownNameError : no such display, or none of its views is called so.
    """
    if named is None:
        return None
    return Proof(DisplayTransform(named, display.view, display.config, display.adaptation))
