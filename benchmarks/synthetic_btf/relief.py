"""The surface of a made-up sample: a periodic height field of flat facets, each of one dye."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...lighting.vectors import unit
from ...runtime.errors import InputError


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights over H x W texels that go on for ever, the tile over and over.

    Lengths are in texels. Rows and columns are those of pictures: row 0 is at v = 1, x runs along columns and y against
    rows. A cell is a square of the map of heights, of two flat facets: cell (row, column) spans the height of the same
    index and its three neighbours to the right and below. Facet 2 (row C + column) + k is its upper left or lower
    right half.

    heights : (R,C) texels, above whatever plane. dye : (R,C) which dye each cell has, from 0.
    texels : (H,W). R / H and C / W are the same whole number, the cells along a texel.
    along : (R,C,2) direction of the yarn in each cell, x and y; None where there are no fibres.

    Raises
    ------
    InputError : arrays that do not fit, heights that are no numbers, a dye below 0.
    """

    heights: Float[np.ndarray, "R C"]
    dye: Int[np.ndarray, "R C"]
    texels: tuple[int, int]
    along: Float[np.ndarray, "R C 2"] | None = None

    def __post_init__(self) -> None:
        rows, columns = self.heights.shape
        height, width = self.texels
        fits = height > 0 and width > 0 and rows > 0 and rows % height == 0 and rows // height * width == columns
        if not fits or self.dye.shape != self.heights.shape:
            raise InputError(
                "a relief whose maps do not fit its texels",
                field="heights, dye",
                found=f"{self.heights.shape} and {self.dye.shape} for {self.texels} texels",
                expected="the same whole number of cells along each side of every texel",
            )
        if self.along is not None and self.along.shape != (rows, columns, 2):
            found = self.along.shape
            raise InputError(
                "yarns do not fit the cells", field="along", found=found, expected=f"({rows}, {columns}, 2)"
            )
        if not np.isfinite(self.heights).all():
            raise InputError("a height that is not a number", field="heights", expected="finite heights, in texels")
        if self.dye.min() < 0:
            found = int(self.dye.min())
            raise InputError("a dye that there cannot be", field="dye", found=found, expected="0 or more")

    @property
    def cells(self) -> int:
        """Cells along a side of a texel."""
        return self.heights.shape[0] // self.texels[0]

    @cached_property
    def mean_height(self) -> float:
        """Average height of the whole surface, by area of the plane."""
        return float(self.corners[..., 2].mean())

    @cached_property
    def corners(self) -> Float[np.ndarray, "F 3 3"]:
        """(F,3,3) corners of the facets of one tile, texels; counter-clockwise from above."""
        rows, columns = self.heights.shape
        row, column = (each.ravel() for each in np.mgrid[:rows, :columns])
        at = [self._vertex(row + down, column + right) for down, right in ((0, 0), (1, 0), (0, 1), (1, 1))]
        upper, lower = np.stack([at[0], at[1], at[2]], axis=1), np.stack([at[2], at[1], at[3]], axis=1)
        return np.stack([upper, lower], axis=1).reshape(-1, 3, 3)

    def _vertex(self, row: Int[np.ndarray, " n"], column: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
        rows, columns = self.heights.shape
        height = self.heights[row % rows, column % columns]
        return np.stack([column / self.cells, -row / self.cells, height], axis=1)

    @cached_property
    def normals(self) -> Float[np.ndarray, "F 3"]:
        """(F,3) unit normals of the facets, upwards."""
        corners = self.corners
        return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))

    @cached_property
    def facet_dyes(self) -> Int[np.ndarray, " F"]:
        """(F,) which dye each facet has."""
        return np.repeat(self.dye.ravel(), 2)

    @cached_property
    def tangents(self) -> Float[np.ndarray, "F 3"] | None:
        """(F,3) unit vectors along the yarn, in the plane of each facet; None where there are no fibres."""
        if self.along is None:
            return None
        flat = np.repeat(self.along.reshape(-1, 2), 2, axis=0)
        normals = self.normals
        # Over the yarn's direction in the plane, the facet rises by what its slope says.
        rise = -np.einsum("fi,fi->f", flat, normals[:, :2]) / normals[:, 2]
        return unit(np.concatenate([flat, rise[:, None]], axis=1))

    def shifted(self, down: int, right: int) -> Relief:
        """Return the same surface, its tile cut `down` and `right` texels farther up and left: images are rolled so
        much.
        """
        step = (down * self.cells, right * self.cells)
        along = None if self.along is None else np.roll(self.along, step, axis=(0, 1))
        return Relief(
            np.roll(self.heights, step, axis=(0, 1)), np.roll(self.dye, step, axis=(0, 1)), self.texels, along
        )
