"""What renderers ask of visibility: signed distances, free shares of lobes, transfer.

A point is given by three vertices and their barycentric weights. Everything that is stored of a vertex is linear, in
axes of the world, so it is mixed before it is decoded: nothing jumps from triangle to triangle, and a point costs one
decoding, not three. The same in GLSL: `codes` and `lost` as texels of four signed bytes, `axes` and `mean` as
octahedral maps of four terms a texel, looked up as `octahedral.around` does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ...spectral.errors import InputError
from ..environment import harmonics
from . import octahedral
from .compression import straight
from .free_share import free_share
from .refinement import Refinement
from .tracing import MAP

# Points whose maps are decoded at once: 4 MB.
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class SceneVisibility:
    """Which directions are free at the vertices of a scene, against all of its parts, on both sides of sheets.

    mean (texels,), axes (texels, K) : of bent distances (`compression`).
    codes (S, K), steps (K,) : of each site, whole numbers from -127 to 127, and what one of each is.
    lost (S, 25), lost_steps (25,) : what is hidden of the clamped cosine, in `harmonics`; whole numbers, sr a step.
    fronts (V,), backs (V,) : the site of each vertex on the side that its normal looks to, and on the other one: -1
        inside of solids, where everything is hidden, and for a vertex that no triangle uses.
    refinement : further vertices inside of large triangles.
    """

    mean: Float[np.ndarray, " texels"]
    axes: Float[np.ndarray, "texels K"]
    codes: Int[np.ndarray, "S K"]
    steps: Float[np.ndarray, " K"]
    lost: Int[np.ndarray, "S 25"]
    lost_steps: Float[np.ndarray, " 25"]
    fronts: Int[np.ndarray, " V"]
    backs: Int[np.ndarray, " V"]
    refinement: Refinement

    @property
    def bytes_a_vertex(self) -> float:
        """What is stored for each vertex; mean and axes, the same for all, come to less than 0.2 MB."""
        held = (self.codes, self.lost, self.fronts, self.backs)
        return sum(array.nbytes for array in held) / len(self.fronts)

    def located(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """The vertices and weights to ask with for points on triangles (numbered over all parts): see `Refinement`.

        The corners of the triangles themselves may be asked with too; on a floor of two triangles they know little.
        """
        return self.refinement.located(faces, weights)

    def signed_distances(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        back: Bool[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N Q"]:
        """Angles to the nearest boundary of what is hidden, radians, positive where the direction is free.

        Parameters
        ----------
        directions : world, of any length but 0; above the horizon of the side that is seen. Below it there is no
            answer that means something: who asks cuts there.
        back : where the side is seen that the normals look away from; None: nowhere.

        Raises
        ------
        InputError : a vertex that no triangle uses.
        """
        texels, shares = octahedral.around(np.asarray(directions, dtype=np.float64), MAP)
        sites = self._sites(vertices, back)
        found = np.empty(directions.shape[:2])
        for start in range(0, len(vertices), _BLOCK):
            block = slice(start, start + _BLOCK)
            maps = self._maps(sites[block], weights[block])
            here = np.take_along_axis(maps, texels[block].reshape(len(maps), -1), axis=1)
            found[block] = straight((here.reshape(shares[block].shape) * shares[block]).sum(axis=-1))
        return found

    def free_shares(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        sharpness: Float[np.ndarray, "*lobes"] | float,
        back: Bool[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N Q"]:
        """The share of the spherical Gaussian about each direction that is free, 0 to 1; `sharpness` (Q,) or (N, Q)."""
        return free_share(self.signed_distances(vertices, weights, directions, back), sharpness)

    def transfer(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        normals: Float[np.ndarray, "N 3"],
        back: Bool[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N 25"]:
        """Coefficients (`harmonics`) of visibility times clamped cosine, sr, world axes: their sum with those of the
        luminance from all directions is the illuminance of a matt surface. Few harmonics ring: clip that sum at 0.

        normals : unit, of shading, on the side that is seen. Where nothing is hidden the transfer is exactly theirs.
        """
        sites = self._sites(vertices, back)
        inside = sites < 0
        stored = self.lost[np.maximum(sites, 0)] * self.lost_steps.astype(np.float64)
        whole = harmonics.clamped_cosine(normals)
        lost = np.where(inside[..., None], whole[:, None], stored)
        return whole - np.einsum("nk,nkc->nc", weights, lost)

    def _sites(self, vertices: Int[np.ndarray, "N 3"], back: Bool[np.ndarray, " N"] | None) -> Int[np.ndarray, "N 3"]:
        """The sites of vertices; -1 inside of solids."""
        sites = self.fronts[vertices]
        if (sites < 0).any():
            number = int(np.asarray(vertices)[sites < 0][0])
            raise InputError(
                "no triangle uses this vertex",
                field="vertices",
                found=number,
                hint="ask with the corners of triangles, numbered over all parts, or with what `located` gives",
            )
        return sites if back is None else np.where(back[:, None], self.backs[vertices], sites)

    def _maps(self, sites: Int[np.ndarray, "n 3"], weights: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """(n, texels) bent distances; all hidden where a corner is inside of a solid."""
        codes = np.einsum("nk,nkc->nc", weights, self.codes[np.maximum(sites, 0)])
        maps = (codes * self.steps) @ self.axes.T.astype(np.float64) + self.mean
        maps[(sites < 0).any(axis=1)] = -1.0
        return maps
