"""Visibility as renderers use it: signed distances to what is hidden, and shares of light that is.

A point is given by three vertices and their barycentric weights. Codes are linear, in axes of the
world, so they are mixed before they are decoded: nothing jumps from triangle to triangle, and a point costs one
decoding, not three. The same in GLSL: codes as texels of four, `axes` and `mean` as octahedral maps of four terms a
texel, looked up as `octahedral.around` does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from ...runtime.errors import InputError
from ..environment import octahedral
from .compression import SOFT, straight, straightening, unpack_codes
from .edge_bisection import Halving
from .tracing import MAP

# Points per block of decoded maps: 4 MB.
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class SceneVisibility:
    """Free directions at the vertices of a scene, against all of its parts, on both sides of sheets.

    mean (texels,), axes (texels, K) : of bent distances (`compression`).
    whole (S, B), halves (S, H), steps (K,) : codes of each site, `compression.pack_codes`.
    facing (V, 2) : vertex normals, `octahedral.in_two`.
    fronts (V,), backs (V,) : the site of each vertex on the side that its normal looks to, and on the other one: -1
        inside of solids, where everything is hidden, and for a vertex that no triangle uses.
    middles (A, 2) : pairs of vertices between which visibility changes much: the last A of the V lie in their middles.
    refinement : further vertices inside of large triangles, and the triangles that middles cut.
    """

    mean: Float[np.ndarray, " texels"]
    axes: Float[np.ndarray, "texels K"]
    whole: Int[np.ndarray, "S B"]
    halves: UInt8[np.ndarray, "S H"]
    steps: Float[np.ndarray, " K"]
    facing: Int[np.ndarray, "V 2"]
    fronts: Int[np.ndarray, " V"]
    backs: Int[np.ndarray, " V"]
    middles: Int[np.ndarray, "A 2"]
    refinement: Halving

    @property
    def vertices(self) -> int:
        """Vertices of the meshes, those of divided triangles with them; middles are not counted, only paid for."""
        return len(self.fronts) - len(self.middles)

    @property
    def bytes_a_vertex(self) -> float:
        """Bytes stored, middles included, by `vertices`; mean and axes, the same for all, come to less than 0.3 MB."""
        held = (self.whole, self.halves, self.facing, self.fronts, self.backs, self.middles)
        return sum(array.nbytes for array in held) / self.vertices

    @property
    def site_normals(self) -> Float[np.ndarray, "S 3"]:
        """Unit, on the side that a site is of."""
        normals = octahedral.out_of_two(self.facing)
        found = np.empty((len(self.whole), 3))
        for sites, sign in ((self.fronts, 1.0), (self.backs, -1.0)):
            found[sites[sites >= 0]] = sign * normals[sites >= 0]
        return found

    def codes(self, sites: Int[np.ndarray, "*n"]) -> Float[np.ndarray, "*n K"]:
        """Codes of sites; times `axes`, with `mean`, they are bent distances."""
        return unpack_codes(self.whole[sites], self.halves[sites]) * self.steps

    def along(self, to: Float[np.ndarray, "P 3"]) -> tuple[Float[np.ndarray, "P K"], Float[np.ndarray, " P"]]:
        """Return factors and offsets of codes, for compressed distances in fixed directions of the world."""
        texels, shares = octahedral.around(to, MAP)
        shares = shares.astype(np.float32)
        return np.einsum("pt,ptk->pk", shares, self.axes[texels]), (shares * self.mean[texels]).sum(axis=1)

    def located(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Return the vertices and weights to ask with for points on triangles (numbered over all parts): see `Halving`.

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
        found, _ = self._boundaries(vertices, weights, directions, back, sloping=False)
        return found

    def boundaries(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        back: Bool[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N Q"], Float[np.ndarray, "N Q 3"]]:
        """`signed_distances` of unit directions, and how they change with those: vectors across each, world, that point
        away from what is hidden; of length 1 where the boundary is near and straight, 0 where there is none.
        """
        return self._boundaries(vertices, weights, directions, back, sloping=True)

    def _boundaries(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        back: Bool[np.ndarray, " N"] | None,
        sloping: bool,
    ) -> tuple[Float[np.ndarray, "N Q"], Float[np.ndarray, "N Q 3"]]:
        to = np.asarray(directions, dtype=np.float64)
        texels, shares = octahedral.around(to, MAP)
        found, slopes = np.empty(directions.shape[:2]), np.zeros(directions.shape)
        if not found.size:
            return found, slopes
        codes, dark = self.mixed(vertices, weights, back)
        inside = dark > 0.0
        for start in range(0, len(vertices), _BLOCK):
            block = slice(start, start + _BLOCK)
            maps = codes[block] @ self.axes.T.astype(np.float64) + self.mean
            maps[inside[block]] = -1.0
            here = np.take_along_axis(maps, texels[block].reshape(len(maps), -1), axis=1).reshape(shares[block].shape)
            bent = (here * shares[block]).sum(axis=-1)
            found[block] = straight(bent)
            if sloping:
                change = np.einsum("nqt,nqti->nqi", here, octahedral.slopes(to[block], MAP))
                slopes[block] = change * straightening(bent)[..., None]
        return found, slopes

    def mixed(
        self, vertices: Int[np.ndarray, "N 3"], weights: Float[np.ndarray, "N 3"], back: Bool[np.ndarray, " N"] | None
    ) -> tuple[Float[np.ndarray, "N K"], Float[np.ndarray, " N"]]:
        """Codes between the corners that are not inside of solids, and the weight of those that are.

        Raises
        ------
        InputError : a vertex that no triangle uses.
        """
        sites = self.sites(vertices, back)
        outside = weights * (sites >= 0)
        left = outside.sum(axis=1)
        codes = np.einsum("nk,nkc->nc", outside, self.codes(np.maximum(sites, 0)))
        return codes / np.where(left > 0.0, left, 1.0)[:, None], (weights * (sites < 0)).sum(axis=1)

    def sites(self, vertices: Int[np.ndarray, "N 3"], back: Bool[np.ndarray, " N"] | None) -> Int[np.ndarray, "N 3"]:
        """Return the sites of vertices; -1 inside of solids."""
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


def hidden_shares(
    along: tuple[Float[np.ndarray, "P K"], Float[np.ndarray, " P"]],
    codes: Float[np.ndarray, "N K"],
    solid_angles: Float[np.ndarray, " P"],
) -> Float[np.ndarray, "N P"]:
    """Return the share of each cell of directions that is hidden, `along` the middles of cells of these solid angles,
    sr.

    A boundary that crosses a cell is taken for a straight edge across a square. Near a boundary a bent distance is
    the distance over `SOFT`, to 2 % at 10 degrees.
    """
    axes, mean = along
    steep = (SOFT / np.sqrt(solid_angles)).astype(np.float32)
    bent = codes.astype(np.float32) @ (axes * steep[:, None]).T + mean * steep
    return np.clip(np.float32(0.5) - bent, 0.0, 1.0)
