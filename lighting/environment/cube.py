"""Directions as texels of a cube map, 6 x n x n, and light as their means."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int

from .environment import EnvironmentLight

#: Least number of texels across a face at which a light is sampled for its means.
FINEST = 256


@dataclass(frozen=True)
class CubeMap:
    """`across` x `across` texels on each of six faces, +x, -x, +y, -y, +z, -z; row by row."""

    across: int

    def __len__(self) -> int:
        return 6 * self.across**2

    @cached_property
    def directions(self) -> Float[np.ndarray, "D 3"]:
        """Unit directions of texel centres."""
        at = (np.arange(self.across) + 0.5) / self.across * 2.0 - 1.0
        down, right = (each.ravel() for each in np.meshgrid(at, at, indexing="ij"))
        faces = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                face = np.empty((self.across**2, 3))
                face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = sign, down, right
                faces.append(face)
        found = np.concatenate(faces)
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    @cached_property
    def solid_angles(self) -> Float[np.ndarray, " D"]:
        """sr; exact, by the four corners of each texel."""
        edge = np.arange(self.across + 1) / self.across * 2.0 - 1.0
        corner = np.arctan2(np.multiply.outer(edge, edge), np.sqrt(1.0 + np.add.outer(edge**2, edge**2)))
        face = corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]
        return np.tile(face.ravel(), 6)

    def texel_of(self, to: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the index of the texel that contains each direction."""
        axis, rows = np.abs(to).argmax(axis=1), np.arange(len(to))
        large = to[rows, axis]
        places = [(to[rows, (axis + step) % 3] / np.abs(large) + 1.0) * (0.5 * self.across) for step in (1, 2)]
        down, right = (np.clip(place.astype(np.int64), 0, self.across - 1) for place in places)
        return ((2 * axis + (large < 0.0)) * self.across + down) * self.across + right

    def coarser(self, across: int) -> Int[np.ndarray, " D"]:
        """Return the texel of a coarser map that contains each texel; `across` divides this map's."""
        number = np.arange(len(self))
        face, down, right = number // self.across**2, number // self.across % self.across, number % self.across
        by = self.across // across
        return (face * across + down // by) * across + right // by

    def means(self, light: EnvironmentLight, finest: int = FINEST) -> Float[np.ndarray, "K D"]:
        """Return the mean luminance of each field of a light over each texel, cd/m^2.

        finest : least number of texels across a face at which the light is sampled.
        """
        fine = _kept(self.across * max(1, -(-finest // self.across)))
        part, angle = fine.coarser(self.across), fine.solid_angles
        values = light.luminance(np.zeros((len(fine), 3)), fine.directions).T
        sums = np.stack([np.bincount(part, angle * field, len(self)) for field in values])
        return sums / self.solid_angles


@lru_cache(maxsize=2)
def _kept(across: int) -> CubeMap:
    """Return a cached cube map with its directions, needed again for each rotation of a light."""
    return CubeMap(across)
