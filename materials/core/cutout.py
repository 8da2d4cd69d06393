"""Holes of surfaces, through which is seen what lies behind."""

from __future__ import annotations

import abc

import numpy as np
from jaxtyping import Bool, Float


class Cutout(abc.ABC):
    """Opacity mask of a surface: what is there is seen, casts shadows and stops rays, a hole does none of these."""

    @abc.abstractmethod
    def holes(self, uv: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Return whether nothing is there, at texture coordinates of the mesh."""
