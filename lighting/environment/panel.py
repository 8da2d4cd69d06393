"""Softbox prepared for renderers: evaluated from each sample's position, without prefiltering."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...materials.core.environment_form import BENDS
from ..vectors import dot, unit
from .polygon import gaussian_shares, surface_moments
from .softbox import SoftboxLight

#: Cells along a side; each has its own visibility.
CELLS = 4
# Sharpness of a Gaussian as broad as an even square, times the square's solid angle; and the lowest sharpness.
_BROAD, _LEAST_SHARPNESS = 12.0, 1.0


@dataclass(frozen=True, eq=False)
class GatheredPanel:
    """Rectangle of uniform luminance on its front, black behind.

    corners (4, 3) : in the coordinates of positions, ordered so that the front has a positive `polygon.solid_angle`.
        luminance : of its front, cd/m^2.
    """

    corners: Float[np.ndarray, "4 3"]
    luminance: float

    @classmethod
    def of(cls, light: SoftboxLight, centre: Float[np.ndarray, "3"], radius: float) -> GatheredPanel:
        """Return a softbox in lengths of `radius` about `centre`, world."""
        first, second, third, fourth = (light.corners - centre) / radius
        return cls(np.array([first, fourth, third, second]), light.luminance_cd_m2)

    @property
    def _sides(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Sides from the first corner, across and along; their cross product points to the front."""
        return self.corners[3] - self.corners[0], self.corners[1] - self.corners[0]

    @cached_property
    def facing(self) -> Float[np.ndarray, "3"]:
        """Unit normal of the front."""
        return unit(np.cross(*self._sides))

    @cached_property
    def cells(self) -> Float[np.ndarray, "n 3"]:
        """Cell centres, row by row."""
        at = (np.arange(CELLS) + 0.5) / CELLS
        across, along = self._sides
        return (self.corners[0] + at[:, None, None] * along + at[:, None] * across).reshape(-1, 3)

    @property
    def cell_area(self) -> float:
        """Area of one cell."""
        return float(np.linalg.norm(np.cross(*self._sides))) / CELLS**2

    def by_lobes(
        self,
        positions: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        sharpness: Float[np.ndarray, "N Q"],
    ) -> Float[np.ndarray, "N Q"]:
        """Return the mean luminance weighted by each Gaussian about unit world directions, cd/m^2."""
        found = np.zeros(sharpness.shape)
        front = self._in_front(positions)
        towards = self.corners - positions[front, None]
        found[front] = self.luminance * gaussian_shares(towards, directions[front], sharpness[front])
        return found

    def by_frames(
        self, positions: Float[np.ndarray, "N 3"], frames: Float[np.ndarray, "N 3 3"], bent: int = BENDS
    ) -> Float[np.ndarray, "N B"]:
        """Return the unoccluded illuminance on surfaces, lx, and its moments in their own axes (rows of `frames`; the
        last is the normal); with `bent` 1 the illuminance alone.
        """
        found = np.zeros((len(positions), bent))
        front = self._in_front(positions)
        towards = np.einsum("nij,nkj->nki", frames[front], self.corners - positions[front, None])
        # Axes of a mirrored frame turn the other way round.
        left = np.linalg.det(frames[front]) < 0.0
        towards = np.where(left[:, None, None], towards[:, ::-1], towards)
        found[front] = self.luminance * surface_moments(towards)[:, :bent]
        return found

    def seen_cells(
        self, positions: Float[np.ndarray, "N 3"]
    ) -> tuple[Float[np.ndarray, "N n 3"], Float[np.ndarray, "N n"], Float[np.ndarray, "N n"]]:
        """Return unit directions to cells, their solid angles, sr, and the sharpness of Gaussians of equal width."""
        offset = self.cells - positions[:, None]
        squared = np.maximum(np.sum(offset * offset, axis=2), 1e-30)
        to = offset / np.sqrt(squared)[..., None]
        angle = self.cell_area * np.abs(to @ self.facing) / squared
        # A cell fills at most a hemisphere, even of a point next to it.
        angle = np.minimum(angle, 2.0 * np.pi)
        return to, angle, np.maximum(_BROAD / np.maximum(angle, 1e-12), _LEAST_SHARPNESS)

    def _in_front(self, positions: Float[np.ndarray, "N 3"]) -> np.ndarray:
        """Return the indices of points in front of the panel."""
        return np.flatnonzero(dot(positions - self.corners[0], np.broadcast_to(self.facing, positions.shape)) > 0.0)
