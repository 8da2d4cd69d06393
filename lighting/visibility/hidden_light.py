"""Occluded part of a light at the vertices of a scene, and the visibility of its bright parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.environment_form import BENDS, bends
from ..environment.bright_light import BrightLight
from .visibility import SceneVisibility, hidden_shares

# Sites per block: 8 MB of cells.
_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class HiddenLight:
    """Occluded part of one rotated light in one scene of S sites; recomputed when either changes.

    lost (S, 9, K) : occluded illuminance, lux, and its moments (`bends`, in world axes), of all light but the narrow
    bright parts. whole (S, K) : unoccluded illuminance of the same light.
    axes (n, terms), mean (n,) : `SceneVisibility.along` the bright parts' axes.
    """

    lost: Float[np.ndarray, "S 9 K"]
    whole: Float[np.ndarray, "S K"]
    axes: Float[np.ndarray, "n terms"]
    mean: Float[np.ndarray, " n"]

    @classmethod
    def of(cls, visibility: SceneVisibility, bright: BrightLight) -> HiddenLight:
        """Sum over the light's cells at every site: 10 microseconds each."""
        cells, rest = bright.cells, bright.rest
        along, normals = visibility.along(cells.directions), visibility.site_normals.astype(np.float32)
        bent = bends(cells.directions)
        each = (bent[:, :, None] * rest[:, None, :]).reshape(len(rest), -1).astype(np.float32)
        to, count = cells.directions.T.astype(np.float32), rest.shape[1]
        lost, whole = np.empty((len(normals), BENDS, count), np.float32), np.empty((len(normals), count), np.float32)
        for start in range(0, len(normals), _BLOCK):
            rows = np.arange(start, min(start + _BLOCK, len(normals)))
            cosine = np.maximum(normals[rows] @ to, 0.0)
            whole[rows] = cosine @ each[:, :count]
            shares = hidden_shares(along, visibility.codes(rows), cells.solid_angles)
            lost[rows] = ((shares * cosine) @ each).reshape(-1, BENDS, count)
        return cls(lost, whole, *visibility.along(bright.parts.axis))

    def between(
        self, sites: Int[np.ndarray, "N 3"], weights: Float[np.ndarray, "N 3"], bent: int = BENDS
    ) -> tuple[Float[np.ndarray, "N B K"], Float[np.ndarray, "N K"]]:
        """Interpolate the first `bent` moments of `lost`, and `whole`, between three sites; a site of -1 contributes
        0.
        """
        shares = np.where(sites >= 0, weights, 0.0)
        lost = np.einsum("nc,ncbk->nbk", shares, self.lost[sites, :bent])
        return lost, np.einsum("nc,nck->nk", shares, self.whole[sites])
