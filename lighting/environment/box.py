"""Radiosity in a grey box with a bright panel in its ceiling and an open front.

Form factors between patches are closed forms (Ehlert and Smith, View factors for perpendicular and parallel rectangular
plates, Journal of Thermophysics and Heat Transfer 7, 1993), so that energy is conserved exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ..vectors import Number

#: Patches along each side of a face.
PATCHES = 10
#: Patches of the ceiling, from its edges, that the panel leaves free: it is 8 of 10 as wide and as deep as the ceiling.
RIM = 1
#: The faces of a box by axis and side: left, right, floor, ceiling, back, front.
FACES = ((0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1))
_CEILING, _FRONT = 3, 5


@dataclass(frozen=True, eq=False)
class Box:
    """A box about the origin, its front (+z) open to the dark.

    Parameters
    ----------
    size : width, height and depth, along x, y and z.
    wall_reflectance : of walls, floor, and the ceiling around the panel, which are perfectly diffuse. The panel has
        luminance 1 and absorbs all light that falls on it; light that leaves by the front is lost.
    """

    size: tuple[Number, Number, Number]
    wall_reflectance: Number

    @cached_property
    def areas(self) -> Float[np.ndarray, " P"]:
        """Areas of all patches, face after face."""
        return np.concatenate([np.full(PATCHES**2, self._sides(axis).prod() / PATCHES**2) for axis, _ in FACES])

    @cached_property
    def factors(self) -> Float[np.ndarray, "P P"]:
        """Form factors: fraction of the flux leaving patch i that reaches patch j."""
        count = PATCHES**2
        found = np.zeros((6 * count, 6 * count))
        for i, first in enumerate(FACES):
            for j, second in enumerate(FACES):
                if i != j:
                    between = self._parallel if first[0] == second[0] else self._perpendicular
                    block = between(first, second)
                    found[i * count : (i + 1) * count, j * count : (j + 1) * count] = block
        return found

    @cached_property
    def luminances(self) -> Float[np.ndarray, "6 n n"]:
        """Solve the luminances of all patches, the panel's being 1: B = E + rho F B. Rows along the first of the face's
        axes.
        """
        count = PATCHES**2
        panel = np.zeros((6, PATCHES, PATCHES))
        panel[_CEILING, RIM:-RIM, RIM:-RIM] = 1.0
        reflects = np.where(panel > 0.0, 0.0, float(self.wall_reflectance))
        reflects[_FRONT] = 0.0
        system = np.eye(6 * count) - reflects.ravel()[:, None] * self.factors
        return np.linalg.solve(system, panel.ravel()).reshape(panel.shape)

    def luminance(
        self, origin: Float[np.ndarray, "3"], directions: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """Return the luminance seen from a point inside the box: linear between patch centres on walls, constant per
        patch on the ceiling.
        """
        half = 0.5 * np.asarray(self.size, dtype=np.float64)
        with np.errstate(divide="ignore"):
            to_faces = np.where(directions >= 0.0, half - origin, -half - origin) / np.where(
                directions == 0.0, np.inf, directions
            )
        to_faces = np.where(directions == 0.0, np.inf, to_faces)
        axis = np.argmin(to_faces, axis=1)
        met = origin + np.take_along_axis(to_faces, axis[:, None], axis=1) * directions
        face = 2 * axis + (np.take_along_axis(directions, axis[:, None], axis=1)[:, 0] > 0.0)
        place = np.clip((met / half + 1.0) * 0.5, 0.0, 1.0) * PATCHES
        others = np.array([_others(one) for one in range(3)])[axis]
        u, v = (np.take_along_axis(place, others[:, k, None], axis=1)[:, 0] for k in range(2))
        smooth = self._between(face, u, v)
        flat = self.luminances[face, np.minimum(u.astype(int), PATCHES - 1), np.minimum(v.astype(int), PATCHES - 1)]
        return np.where(face == _CEILING, flat, smooth)

    def _between(self, face: Int[np.ndarray, " n"], u: np.ndarray, v: np.ndarray) -> Float[np.ndarray, " n"]:
        u, v = np.clip(u - 0.5, 0.0, PATCHES - 1.0), np.clip(v - 0.5, 0.0, PATCHES - 1.0)
        i, j = np.minimum(u.astype(int), PATCHES - 2), np.minimum(v.astype(int), PATCHES - 2)
        a, b = u - i, v - j
        at = self.luminances
        low = at[face, i, j] * (1.0 - b) + at[face, i, j + 1] * b
        high = at[face, i + 1, j] * (1.0 - b) + at[face, i + 1, j + 1] * b
        return low * (1.0 - a) + high * a

    def _sides(self, axis: int) -> Float[np.ndarray, "2"]:
        return np.asarray(self.size, dtype=np.float64)[list(_others(axis))]

    def _edges(self, axis: int) -> Float[np.ndarray, " n"]:
        """Return the boundaries of patches along an axis, from 0 to the size."""
        return np.linspace(0.0, float(self.size[axis]), PATCHES + 1)

    def _parallel(self, first: tuple[int, int], second: tuple[int, int]) -> Float[np.ndarray, "q q"]:
        u, v = (self._edges(axis) for axis in _others(first[0]))
        apart = float(self.size[first[0]])
        offset_u, offset_v = u[:, None] - u[None], v[:, None] - v[None]
        # Indices: edges along u of the two, edges along v of the two.
        du, dv = offset_u[:, :, None, None], offset_v[None, None]
        far_u, far_v = np.sqrt(du * du + apart**2), np.sqrt(dv * dv + apart**2)
        primitive = dv * far_u * np.arctan(dv / far_u) + du * far_v * np.arctan(du / far_v)
        primitive = primitive - 0.5 * apart**2 * np.log(du * du + dv * dv + apart**2)
        return self._differences(primitive, first)

    def _perpendicular(self, first: tuple[int, int], second: tuple[int, int]) -> Float[np.ndarray, "q q"]:
        """Both measured from their common edge, and along it."""
        common = 3 - first[0] - second[0]
        from_edge = self._edges(second[0])
        x = from_edge if second[1] < 0 else float(self.size[second[0]]) - from_edge
        from_edge = self._edges(first[0])
        xi = from_edge if first[1] < 0 else float(self.size[first[0]]) - from_edge
        along = self._edges(common)
        squared = (x[:, None] ** 2 + xi[None] ** 2)[:, :, None, None]
        offset = (along[:, None] - along[None])[None, None]
        root, both = np.sqrt(squared), squared + offset * offset
        primitive = offset * root * np.arctan2(offset, root)
        logarithm = np.log(np.where(both > 0.0, both, 1.0))
        primitive = primitive - 0.25 * (squared - offset * offset) * logarithm
        # Distances that fall along an axis turn the sign of the differences.
        sign = (1.0 if second[1] < 0 else -1.0) * (1.0 if first[1] < 0 else -1.0)
        found = sign * self._differences(primitive, first, raw=True)
        # found[x, xi, y, eta]; rows are the first face's patches in the order of its axes, columns the second's.
        found = found if _others(first[0])[0] == second[0] else found.transpose(2, 1, 0, 3)
        found = found if _others(second[0])[0] == first[0] else found.transpose(0, 3, 2, 1)
        return found.transpose(0, 2, 1, 3).reshape(PATCHES**2, PATCHES**2)

    def _differences(
        self, primitive: Float[np.ndarray, "a b c d"], first: tuple[int, int], raw: bool = False
    ) -> np.ndarray:
        """Sum a primitive of four edges over each pair of patches with alternating signs, over 2 pi and the area."""
        for axis in range(4):
            primitive = np.diff(primitive, axis=axis)
        found = primitive / (2.0 * np.pi * self._sides(first[0]).prod() / PATCHES**2)
        return found if raw else found.transpose(0, 2, 1, 3).reshape(PATCHES**2, PATCHES**2)


def _others(axis: int) -> tuple[int, int]:
    """Return the two axes along a face."""
    found = [one for one in range(3) if one != axis]
    return found[0], found[1]
