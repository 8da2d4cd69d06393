"""Visibility for renderers: signed angular distances to occluders, and hidden shares of light.

A point is given by three vertices and their barycentric weights. Codes are linear, in world axes, so they are
interpolated before they are decoded: the result is continuous across triangles, and a point costs one decoding, not
three. The GLSL twin has codes as texels of four, and `axes` and `mean` as octahedral maps of four terms per texel,
sampled as by `octahedral.around`.
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
    """Visibility at the vertices of a scene, occluded by all of its parts, on both sides of sheets.

    mean (texels,), axes (texels, K) : of compressed distances (`compression`).
    whole (S, B), halves (S, H), steps (K,) : codes of each site, `compression.pack_codes`.
    facing (V, 2) : vertex normals, `octahedral.in_two`.
    fronts (V,), backs (V,) : the site of each vertex on the side of its normal, and on the other one; -1 inside of
        solids, where everything is hidden, and for an unused vertex.
    middles (A, 2) : pairs of vertices between which visibility changes much; the last A of the V are their midpoints.
    refinement : further vertices inside large triangles, and the triangles cut at midpoints.
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
        """Number of vertices of the meshes, including those of subdivided triangles, without midpoints."""
        return len(self.fronts) - len(self.middles)

    @property
    def bytes_a_vertex(self) -> float:
        """Bytes stored, midpoints included, per one of `vertices`; the shared mean and axes take less than 0.3 MB
        more.
        """
        held = (self.whole, self.halves, self.facing, self.fronts, self.backs, self.middles)
        return sum(array.nbytes for array in held) / self.vertices

    @property
    def site_normals(self) -> Float[np.ndarray, "S 3"]:
        """Unit normals on each site's side."""
        normals = octahedral.out_of_two(self.facing)
        found = np.empty((len(self.whole), 3))
        for sites, sign in ((self.fronts, 1.0), (self.backs, -1.0)):
            found[sites[sites >= 0]] = sign * normals[sites >= 0]
        return found

    def codes(self, sites: Int[np.ndarray, "*n"]) -> Float[np.ndarray, "*n K"]:
        """Return the codes of sites; `axes` times these plus `mean` are compressed distances."""
        return unpack_codes(self.whole[sites], self.halves[sites]) * self.steps

    def along(self, to: Float[np.ndarray, "P 3"]) -> tuple[Float[np.ndarray, "P K"], Float[np.ndarray, " P"]]:
        """Return factors and offsets that turn codes into compressed distances in fixed world directions."""
        texels, shares = octahedral.around(to, MAP)
        shares = shares.astype(np.float32)
        return np.einsum("pt,ptk->pk", shares, self.axes[texels]), (shares * self.mean[texels]).sum(axis=1)

    def located(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Return the vertices and weights for queries at points on triangles (numbered over all parts): see `Halving`.

        The triangles' own corners are valid for queries too, but coarse, as on a floor of two triangles.
        """
        return self.refinement.located(faces, weights)

    def signed_distances(
        self,
        vertices: Int[np.ndarray, "N 3"],
        weights: Float[np.ndarray, "N 3"],
        directions: Float[np.ndarray, "N Q 3"],
        back: Bool[np.ndarray, " N"] | None = None,
    ) -> Float[np.ndarray, "N Q"]:
        """Return angles to the nearest occlusion boundary, radians, positive where the direction is free.

        Parameters
        ----------
        directions : world, of any non-zero length, above the horizon of the visible side. Below it results are
            meaningless, and callers must clip.
        back : True where the back side is seen, opposite to the normal; None: nowhere.

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
        """Return `signed_distances` of unit directions, and their gradients: world vectors across each direction that
        point away from the occluder, of length 1 where the boundary is near and straight, 0 without one.
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
        """Interpolate codes between the corners outside of solids; return them and the weight of the corners inside.

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
        """Return the sites of vertices; -1 inside solids."""
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
    """Return the hidden share of each cell of directions, given `SceneVisibility.along` their centres and their solid
    angles, sr.

    A boundary across a cell is treated as a straight edge across a square. Near a boundary a compressed distance is the
    distance over `SOFT`, to 2 % at 10 degrees.
    """
    axes, mean = along
    steep = (SOFT / np.sqrt(solid_angles)).astype(np.float32)
    bent = codes.astype(np.float32) @ (axes * steep[:, None]).T + mean * steep
    return np.clip(np.float32(0.5) - bent, 0.0, 1.0)
