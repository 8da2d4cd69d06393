"""Half space in front of a near light: only triangles in it can occlude the light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..vectors import VectorLike


@dataclass(frozen=True, eq=False)
class Before:
    """Half space that a light shines into, world: bounded by the plane through `point` (3,), towards unit `facing`
    (3,).
    """

    point: VectorLike
    facing: VectorLike

    def holds(self, points: Float[np.ndarray, "n 3"]) -> bool:
        """Return whether all points, world, are in the half space."""
        return bool((self._heights(points) >= 0.0).all())

    def cut(self, triangles: Float[np.ndarray, "F 3 3"]) -> Float[np.ndarray, "G 3 3"]:
        """Clip triangles, world, to the half space."""
        heights = self._heights(triangles)
        up = heights > 0.0
        count = up.sum(axis=1)
        found = [triangles[count == 3]]
        for above in (1, 2):
            some = count == above
            # Rotated so that the corner alone on its side comes first.
            alone = (up[some] if above == 1 else ~up[some]).argmax(axis=1)
            order = (alone[:, None] + np.arange(3)) % 3
            corners = np.take_along_axis(triangles[some], order[..., None], axis=1)
            high = np.take_along_axis(heights[some], order, axis=1)
            one, two = (
                corners[:, 0] + (high[:, 0] / (high[:, 0] - high[:, k]))[:, None] * (corners[:, k] - corners[:, 0])
                for k in (1, 2)
            )
            if above == 1:
                found.append(np.stack([corners[:, 0], one, two], axis=1))
            else:
                found.append(np.stack([one, corners[:, 1], corners[:, 2]], axis=1))
                found.append(np.stack([one, corners[:, 2], two], axis=1))
        return np.concatenate(found)

    def _heights(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
        return (points - self.point) @ self.facing
