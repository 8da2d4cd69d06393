"""Masks: opacity on a grid of texels, which cuts holes into a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ..core.cutout import Cutout
from .map_set import ROUNDING, Placement
from .texels import look_up


@dataclass(frozen=True, eq=False)
class Mask(Cutout):
    """Holes where the opacity of a mask is below its cutoff (glTF's alphaMode MASK).

    opacity : (H,W,1) in [0, 1], linear between texels. cutoff : from where on something is there.
    placement : of the mask on the mesh.
    """

    opacity: Float[np.ndarray, "H W 1"]
    cutoff: float
    placement: Placement

    def holes(self, uv: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Implement `Cutout.holes`."""
        found = look_up(self.opacity, self.placement.of(uv), self.placement.wrap)[:, 0]
        return found < self.cutoff - ROUNDING
