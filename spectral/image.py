"""Image of tristimulus values with its colour space and its white."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError


@dataclass(frozen=True, eq=False)
class ColourImage:
    """Pixels, their colour space and their white.

    Parameters
    ----------
    values : (H,W,3) float32, row 0 at the top; linear.
    space : "xyz" as rendered, or "xyz_d65" after adaptation to the display white.
    white_xyz : (3,) XYZ of the perfect diffuser facing the light, Y = 1.
    """

    values: Float[np.ndarray, "H W 3"]
    space: Literal["xyz", "xyz_d65"]
    white_xyz: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", np.asarray(self.values, dtype=np.float32))
        object.__setattr__(self, "white_xyz", np.asarray(self.white_xyz, dtype=np.float64))
        if self.values.ndim != 3 or self.values.shape[-1] != 3:
            raise InputError(
                "not an image of three channels",
                field="values",
                found=f"shape {self.values.shape}",
                expected="(H, W, 3)",
            )
