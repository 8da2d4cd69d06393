"""Directions above the horizon as places on a disc: what lies below them, straight down (Wang et al. 2004).

An even step on the disc is an even step of the cosine-weighted solid angle: light and view factors of a BRDF tensor
(Sun et al. 2007, section 4.3) are tables on a square grid of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

# The rim: directions flatter than 80 degrees are as those at 80, where BRDFs of microfacets grow beyond all bounds.
_RIM = np.sin(np.radians(80.0))


@dataclass(frozen=True)
class Disc:
    """A square grid of `across` x `across` nodes over the disc; those outside of it stand for the rim beside them."""

    across: int = 24

    @cached_property
    def nodes(self) -> Float[np.ndarray, "M 3"]:
        """Unit directions of all nodes, row by row, y before x."""
        at = np.linspace(-1.0, 1.0, self.across)
        flat = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
        return raised(flat)

    @cached_property
    def used(self) -> Bool[np.ndarray, " M"]:
        """Select the nodes that directions are looked up between: those on the disc, and one step beyond."""
        at = np.maximum(np.abs(np.linspace(-1.0, 1.0, self.across)) - 2.0 / (self.across - 1), 0.0)
        return (np.add.outer(at * at, at * at) <= _RIM * _RIM).ravel()

    def look_up(self, table: Float[np.ndarray, "M k"], to: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n k"]:
        """Return a table's values at directions, linear between four nodes."""
        place = (raised(to[:, :2])[:, :2] + 1.0) * (0.5 * (self.across - 1))
        corner = np.clip(np.floor(place).astype(np.int64), 0, self.across - 2)
        right, up = (place - corner).T[:, :, None]
        first = corner[:, 1] * self.across + corner[:, 0]
        low = table[first] * (1.0 - right) + table[first + 1] * right
        high = table[first + self.across] * (1.0 - right) + table[first + self.across + 1] * right
        return low * (1.0 - up) + high * up


def raised(flat: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Unit directions above places in the plane; those off the disc are brought to its rim."""
    radius = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = flat * np.minimum(1.0, _RIM / np.maximum(radius, _RIM))
    return np.concatenate([flat, np.sqrt(1.0 - np.sum(flat * flat, axis=1, keepdims=True))], axis=1)
