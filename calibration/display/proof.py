"""Soft proof of a picture on a display: pixels out of gamut, and the resulting colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.difference import delta_e_xyz
from .aim import Aim, Black
from .cube import Cube
from .model import DisplayModel

#: ΔE94 from which on a difference can be seen: what is off by less counts as shown.
VISIBLE_DELTA_E = 0.5
# Pixels at a time.
_ROWS = 1 << 18


@dataclass(frozen=True, eq=False)
class ProofStatistics:
    """Soft proof of a picture.

    lost : (H,W) mask of pixels out of gamut. delta_e : (H,W) ΔE94 between requested and shown colours.
    darker : (H,W) mask of pixels with less luminance than the display's black.
    """

    lost: Bool[np.ndarray, "H W"]
    delta_e: Float[np.ndarray, "H W"]
    darker: Bool[np.ndarray, "H W"]


def proofed(
    model: DisplayModel, cube: Cube, aim: Aim, xyz_d65: Float[np.ndarray, "H W 3"], black: Black = "absolute"
) -> ProofStatistics:
    """Make the soft proof of a picture in XYZ-D65, Y of white 1, by the tables that drive the display."""
    flat = np.asarray(xyz_d65, dtype=np.float64).reshape(-1, 3)
    # Flat parts of pictures are many pixels and few colours.
    colours, which = np.unique(flat, axis=0, return_inverse=True)
    apart, (outside, darker) = np.empty(len(colours)), np.empty((2, len(colours)), dtype=bool)
    for start in range(0, len(colours), _ROWS):
        rows = slice(start, start + _ROWS)
        wanted = aim.xyz(colours[rows], black)
        codes = cube.look_up(wanted)
        held = np.clip(codes, 0.0, 1.0)
        apart[rows] = delta_e_xyz(wanted, model.xyz(held), aim.white_xyz)
        outside[rows] = (codes != held).any(axis=1)
        darker[rows] = wanted[:, 1] < aim.black_xyz[1]
    shape, which = np.shape(xyz_d65)[:2], which.reshape(-1)
    found = outside & (apart > VISIBLE_DELTA_E), apart, darker
    return ProofStatistics(*(one[which].reshape(shape) for one in found))
