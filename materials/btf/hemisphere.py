"""Interpolation between measured directions: barycentric weights in the triangle around any other direction.

Directions are mapped to a plane (azimuthal equidistant, theta from the centre) and joined by a Delaunay triangulation.
Meseth, Mueller and Klein 2003 interpolate views so (their eq. 4). Beyond the outermost directions values are clamped:
each of these is repeated farther out, so that neither the outside nor a measurement of one direction, or of several in
a row, needs a rule of its own. Under light below the lowest measured direction f_r is clamped, and the cosine keeps
falling.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError

# Angle of held directions from the normal, radians: beyond the horizon even in the middle of a side between them.
_HELD = 2.4
# Azimuths at which there are held directions wherever the outermost are.
_AROUND = 12
# Measured directions lie on rings, and four of a circle can be joined by either diagonal. Turned by this much for a
# radian of theta while they are joined, they never do: the same triangles on every machine.
_TURNED = 1e-3
# Cells along each side of the table of candidate triangles.
_CELLS = 48
# Cosine at and below which a direction counts as level.
_LEVEL = 1e-3
# Smallest share of a corner from which a direction is in a triangle beyond rounding.
_WITHIN = 1e-9
# Directions along theta and along phi that a hat is summed over.
_FINE = (512, 1440)


@dataclass(frozen=True, eq=False)
class Hemisphere:
    """D measured directions.

    directions : (D,3) unit vectors in the local frame, z >= 0.

    Raises
    ------
    InputError : no directions, or one that is below the horizon, not of length 1, or a duplicate.
    """

    directions: Float[np.ndarray, "D 3"]

    def __post_init__(self) -> None:
        given = np.asarray(self.directions, dtype=np.float64)
        object.__setattr__(self, "directions", given)
        expected = "unit vectors above the horizon, each once"
        if not len(given) or not np.allclose(np.linalg.norm(given, axis=1), 1.0, atol=1e-6):
            raise InputError("not measured directions", field="directions", found=given.shape, expected=expected)
        below = np.flatnonzero(given[:, 2] < -1e-9)
        if len(below):
            found = f"direction {below[0]}: {given[below[0]].round(6).tolist()}"
            raise InputError(
                "a measured direction below the horizon", field="directions", found=found, expected=expected
            )
        rounded = np.unique(given.round(6), axis=0)
        if len(rounded) < len(given):
            found = f"{len(given) - len(rounded)} of {len(given)} more than once"
            raise InputError(
                "measured directions that are there twice", field="directions", found=found, expected=expected
            )

    def __len__(self) -> int:
        return len(self.directions)

    @cached_property
    def corners(self) -> Float[np.ndarray, "C 2"]:
        """(C,2) projected directions: the D measured ones, then the repeated outer ones."""
        measured = _plane(self.directions)
        outermost = measured[self._outermost]
        degrees = np.degrees(np.arctan2(outermost[:, 1], outermost[:, 0]))
        degrees = np.concatenate([degrees, np.arange(_AROUND) * (360.0 / _AROUND)])
        # Rounded before the turn, so that an azimuth just below 0 is 0.
        around = np.radians(np.unique(np.mod(degrees.round(6), 360.0).round(6)))
        return np.concatenate([measured, _HELD * np.stack([np.cos(around), np.sin(around)], axis=1)])

    @cached_property
    def measured(self) -> Int[np.ndarray, " C"]:
        """(C,) measured direction of each corner: for an outer one the nearest of the outermost."""
        found, out = self.corners, self._outermost
        off = np.linalg.norm(found[len(self) :, None] - found[None, out], axis=2)
        return np.concatenate([np.arange(len(self)), out[off.round(9).argmin(axis=1)]])

    @cached_property
    def triangles(self) -> Int[np.ndarray, "T 3"]:
        """(T,3) corners of the Delaunay triangles."""
        from scipy.spatial import Delaunay

        angle = _TURNED * np.linalg.norm(self.corners, axis=1)
        cos, sin, (x, y) = np.cos(angle), np.sin(angle), self.corners.T
        return Delaunay(np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)).simplices.astype(np.int64)

    @cached_property
    def _outermost(self) -> Int[np.ndarray, " h"]:
        """Indices of the measured directions on the convex hull; all of them if they are collinear or few."""
        from scipy.spatial import ConvexHull, QhullError

        try:
            return np.sort(ConvexHull(_plane(self.directions)).vertices).astype(np.int64)
        except (QhullError, ValueError):
            return np.arange(len(self))

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest polar angle of the outermost directions, degrees; values are clamped beyond."""
        across = np.degrees(np.linalg.norm(_plane(self.directions[self._outermost]), axis=1)).round(3)
        return float(across.min()), float(across.max())

    @cached_property
    def inverse(self) -> Float[np.ndarray, "T 3 3"]:
        """(T,3,3) matrices that map (x, y, 1) to the barycentric coordinates of each triangle."""
        corners = self.corners[self.triangles]
        return np.linalg.inv(np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2).swapaxes(1, 2))

    @cached_property
    def cells(self) -> Int[np.ndarray, "cells cells most"]:
        """Triangles that reach into each cell of a grid over the square around the hemisphere, padded with -1."""
        side, grown = np.pi / _CELLS, 1e-6
        low = -np.pi / 2 + side * np.arange(_CELLS)
        cells, numbers = [], []
        for number, corners in enumerate(self.corners[self.triangles]):
            least, most = corners.min(axis=0) - grown, corners.max(axis=0) + grown
            columns, rows = (np.flatnonzero((low + side >= least[k]) & (low <= most[k])) for k in (0, 1))
            across, along, middle = (one[:, None, None] for one in self.inverse[number].T)
            share = across * (low[columns] + 0.5 * side) + along * (low[rows] + 0.5 * side)[:, None] + middle
            # A triangle misses a cell where all the cell lies beyond one of its sides.
            largest = share + 0.5 * side * (np.abs(across) + np.abs(along))
            row, column = np.nonzero((largest >= -grown).all(axis=0))
            cells.append(rows[row] * _CELLS + columns[column])
            numbers.append(np.full(len(row), number))
        cell, number = np.concatenate(cells), np.concatenate(numbers)
        order = np.argsort(cell, kind="stable")
        count = np.bincount(cell, minlength=_CELLS**2)
        table = np.full((_CELLS**2, count.max()), -1, dtype=np.int64)
        table[np.arange(count.max()) < count[:, None]] = number[order]
        return table.reshape(_CELLS, _CELLS, -1)

    def shares(
        self, directions: Float[np.ndarray, "N 3"], falling: bool = False
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Find the three measured directions around each direction, and their weights, whose sum is 1.

        directions : unit vectors with z >= 0. falling : for values f_r cos(theta_i) by the direction of light: beyond
        the outermost directions the weights fall with the cosine, below a sum of 1, so that f_r is clamped.
        """
        plane = _plane(directions)
        at = np.clip(((plane / np.pi + 0.5) * _CELLS).astype(np.int64), 0, _CELLS - 1)
        cells = self.cells.reshape(_CELLS**2, -1)
        number, share = self._within(plane, cells.take(at[:, 1] * _CELLS + at[:, 0], axis=0))
        corners = self.triangles.take(number, axis=0)
        share = np.maximum(share, 0.0)
        share /= share.sum(axis=1, keepdims=True)
        index = self.measured.take(corners)
        if falling:
            held = (corners >= len(self)).any(axis=1)
            cosine = np.einsum("nk,nk->n", share, self.directions[index, 2])
            lower = held & (directions[:, 2] < cosine)
            share = share * np.where(lower, directions[:, 2] / np.where(lower, cosine, 1.0), 1.0)[:, None]
        return index, share

    @cached_property
    def lowest(self) -> float:
        """Smallest cosine of a measured direction, at least `_LEVEL`, as if one at the horizon were just above it."""
        return max(float(self.directions[:, 2].min()), _LEVEL)

    def held(self, directions: Float[np.ndarray, "N 3"]) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
        """Raise directions of light to the lowest measured elevation; return the factor on f_r cos(theta_i) too.

        directions : unit vectors; azimuths are kept, and the factor is 0 below the horizon.
        """
        low = directions[:, 2] < self.lowest
        level = np.linalg.norm(directions[:, :2], axis=1)
        inward = np.sqrt(1.0 - self.lowest**2) / np.where(low & (level > 0.0), level, 1.0)
        lifted = np.concatenate(
            [directions[:, :2] * inward[:, None], np.full((len(directions), 1), self.lowest)], axis=1
        )
        share = np.maximum(directions[:, 2], 0.0) / self.lowest
        return np.where(low[:, None], lifted, directions), np.where(low, share, 1.0)

    def _within(
        self, plane: Float[np.ndarray, "N 2"], which: Int[np.ndarray, "N m"]
    ) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, "N 3"]]:
        """Find the triangle around each point, among candidates: the one whose smallest coordinate is largest."""
        here = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
        best = np.full(len(plane), -np.inf)
        found, share = np.zeros(len(plane), dtype=np.int64), np.zeros((len(plane), 3))
        left = np.arange(len(plane))
        for column in range(which.shape[1]):
            # Well within one triangle, a point is in no other.
            left = left[(which[left, column] >= 0) & (best[left] < _WITHIN)]
            number = which[left, column]
            shares = np.einsum("nij,nj->ni", self.inverse.take(number, axis=0), here.take(left, axis=0))
            # Minimum of three columns, many times faster than one along the rows.
            least = np.minimum(np.minimum(shares[:, 0], shares[:, 1]), shares[:, 2])
            better = least > best[left]
            at = left[better]
            found[at], best[at], share[at] = number[better], least[better], shares[better]
        return found, share

    @cached_property
    def solid_angles(self) -> Float[np.ndarray, " D"]:
        """(D,) sr: integral over the hemisphere of each direction's weight, with `falling`.

        Mueller, Meseth and Klein 2004 (section 4.1) replace light by light from the measured directions: these are the
        weights under uniform light, for values that include the cosine. Their sum is below 2 pi, since weights fall
        towards the horizon.
        """
        theta = (np.arange(_FINE[0]) + 0.5) * (np.pi / 2 / _FINE[0])
        phi = (np.arange(_FINE[1]) + 0.5) * (2.0 * np.pi / _FINE[1])
        total = np.zeros(len(self))
        for angle in theta:
            sin = np.sin(angle)
            ring = np.stack([sin * np.cos(phi), sin * np.sin(phi), np.full_like(phi, np.cos(angle))], axis=1)
            index, share = self.shares(ring, falling=True)
            # Over theta and phi, the cell's share of the sphere is exact.
            cell = np.cos(angle - np.pi / 4 / _FINE[0]) - np.cos(angle + np.pi / 4 / _FINE[0])
            total += np.bincount(index.ravel(), share.ravel() * (cell * 2.0 * np.pi / _FINE[1]), len(self))
        return total


def _plane(directions: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
    """Project unit vectors to theta (cos phi, sin phi)."""
    across = np.hypot(directions[:, 0], directions[:, 1])
    theta = np.arctan2(across, directions[:, 2])
    # At the pole theta / sin(theta) is 1.
    ratio = np.divide(theta, across, out=np.ones_like(theta), where=across > 0.0)
    return directions[:, :2] * ratio[:, None]
