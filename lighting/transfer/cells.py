"""Cells of the hemisphere above a surface, for incident and outgoing light.

Cells have equal projected solid angle (the cosine included) and are about as wide as high: a square grid mapped onto
the unit disc below the hemisphere by concentric rings (Shirley and Chiu, "A low distortion map between disk and
square", Journal of Graphics Tools 2(3), 1997).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

#: Cells along a side of the square: 16 are 7 degrees apart about the normal.
ACROSS = 16


@dataclass(frozen=True)
class HemisphereCells:
    """Grid of `across` x `across` cells, `across` even; index = row * across + column."""

    across: int = ACROSS

    def __len__(self) -> int:
        return self.across**2

    def of(self, local: Float[np.ndarray, "*n 3"]) -> Int[np.ndarray, "*n"]:
        """Return the cell of each unit direction in a frame; below the horizon, the nearest cell at the rim."""
        x, y = local[..., 0], local[..., 1]
        length = np.sqrt(x * x + y * y)
        # Directions below the horizon would project into the disc again.
        radius = np.where(local[..., 2] > 0.0, np.minimum(length, 1.0), 1.0)
        wide, high = np.abs(x), np.abs(y)
        turn = np.arctan2(np.minimum(wide, high), np.maximum(wide, high)) * (4.0 / np.pi) * radius
        a = np.copysign(np.where(wide >= high, radius, turn), x)
        b = np.copysign(np.where(wide >= high, turn, radius), y)
        column, row = (
            np.clip((0.5 * (each + 1.0) * self.across).astype(np.int32), 0, self.across - 1) for each in (a, b)
        )
        return row * self.across + column

    def directions(self) -> Float[np.ndarray, "cells 3"]:
        """Unit directions of cell centres."""
        return self.within(np.arange(len(self)), np.full((len(self), 2), 0.5))

    def within(self, cells: Int[np.ndarray, "*n"], places: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 3"]:
        """Return unit directions at places in [0, 1) of cells, along columns and rows; uniform in projected solid
        angle.
        """
        row, column = np.divmod(cells, self.across)
        a, b = ((each + places[..., k]) / self.across * 2.0 - 1.0 for k, each in enumerate((column, row)))
        wide = np.abs(a) >= np.abs(b)
        radius = np.where(wide, a, b)
        ratio = np.divide(np.where(wide, b, a), radius, out=np.zeros_like(a), where=radius != 0.0) * (0.25 * np.pi)
        x, y = np.where(wide, np.cos(ratio), np.sin(ratio)), np.where(wide, np.sin(ratio), np.cos(ratio))
        return np.stack([radius * x, radius * y, np.sqrt(1.0 - radius * radius)], axis=-1)

    @cached_property
    def quarter(self) -> Int[np.ndarray, " quarter"]:
        """Cells of one quadrant; rotations by right angles give all others."""
        half = np.arange(self.across // 2, self.across)
        return (half[:, None] * self.across + half).ravel()

    def turned(self, cells: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Rotate cells by a right angle about the normal, from x to y."""
        row, column = np.divmod(cells, self.across)
        return column * self.across + (self.across - 1 - row)
