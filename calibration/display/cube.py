"""Inverse of a display as tables: a matrix, a curve per channel, and a cube of codes.

XYZ less black times a matrix is light of each channel, 1 where the display is white. Its cube root, with the sign of
the light, goes through a curve that makes the display's greys equal codes, and these look up the cube, tetrahedrally:
greys lie on the diagonal that all its tetrahedra share, so that no neighbour of another hue touches them.

The cube extends beyond the display's codes, so that colours out of gamut can be counted: there, codes leave 0 to 1, and
clamping them yields the nearest colour by ΔE94.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...spectral.difference import delta_e_xyz
from .inverse import Inverse
from .model import DisplayModel

#: Nodes along an edge, and entries of a curve.
SIZE, CURVE_SIZE = 33, 4096
# Even codes of the nodes beyond those of the display, below and above.
_BELOW, _ABOVE = (-0.6, -0.2, -0.06, -0.02), (1.06, 1.3)
# Power of the even steps between: nodes gather towards black, where the codes of greys bend most.
_TOWARDS_BLACK = 1.3
# Distances beyond the cube: up to the first codes are extrapolated, from the second on the nearest colour is taken.
_OWN, _NEAREST = 0.03, 0.10
# The box in which codes may go on, and what marks a channel that cannot do more where they do not.
_BEYOND, _MARK = 0.15, 0.05
# Share and gamma of the light that greys have at least, for the curves.
_LEAST, _LEAST_GAMMA = 0.25, 2.4
# ΔE94 by which the nearest colour has to be nearer than codes that are cut off, to be taken wholly: among the darkest
# colours it hardly is, and greys would go back where one channel after the other comes to its end.
_WORTH = 2.0
# Pull towards even codes: ΔE94 for all of the range, and more for the darkest, which a display hardly shows: there,
# greys of another white would go back and forth between codes that look alike.
_PULL = 1.0
_DARK_PULL, _DARK = 20.0, 0.03
# ΔE94 from which on a node is not reached in that box, and the nearest colour is looked for anew.
_MISSED = 0.1
# Codes at which greys are looked at, for the curves.
_GREYS = 2049


@dataclass(frozen=True, eq=False)
class Cube:
    """Three-dimensional table, shared by `look_up` and transforms of OpenColorIO.

    Parameters
    ----------
    light_from_xyz : (3,3) and black_xyz : (3,): light = light_from_xyz @ (xyz - black).
    domain : least and greatest signed cube root of light that the curves cover.
    curves : (CURVE_SIZE,3) from even steps of the domain to places in the cube, 0 to 1.
    nodes : (n,n,n,3) codes, by red, green, blue.
    """

    light_from_xyz: Float[np.ndarray, "3 3"]
    black_xyz: Float[np.ndarray, "3"]
    domain: tuple[float, float]
    curves: Float[np.ndarray, "C 3"]
    nodes: Float[np.ndarray, "n n n 3"]

    def look_up(self, xyz: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Look up codes of XYZ in the unit of the readings; beyond 0 to 1 out of the display's gamut."""
        light = (np.asarray(xyz, dtype=np.float64).reshape(-1, 3) - self.black_xyz) @ self.light_from_xyz.T
        low, high = self.domain
        at = (np.clip(np.cbrt(light), low, high) - low) / (high - low)
        steps = np.linspace(0.0, 1.0, len(self.curves))
        places = np.stack([np.interp(at[:, c], steps, self.curves[:, c]) for c in range(3)], axis=1)
        return tetrahedral(self.nodes, places).reshape(np.shape(xyz))


def tetrahedral(nodes: Float[np.ndarray, "n n n 3"], places: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Interpolate a cube at places from 0 to 1, along the edges of the tetrahedron around each."""
    size = len(nodes)
    at = np.clip(places, 0.0, 1.0) * (size - 1)
    corner = np.minimum(at.astype(np.int64), size - 2)
    share = at - corner
    order = np.argsort(-share, axis=1, kind="stable")
    sorted_share = np.take_along_axis(share, order, axis=1)
    found = nodes[tuple(corner.T)] * (1.0 - sorted_share[:, :1])
    rows = np.arange(len(places))
    for step in range(3):
        corner[rows, order[:, step]] += 1
        following = sorted_share[:, step + 1] if step < 2 else 0.0
        found += nodes[tuple(corner.T)] * (sorted_share[:, step] - following)[:, None]
    return found


def make_cube(model: DisplayModel, size: int = SIZE) -> Cube:
    """Tabulate the inverse of a model; `size` nodes along an edge, 17 at least."""
    greys = _Greys.of(model)
    inner = size - len(_BELOW) - len(_ABOVE)
    levels = np.concatenate([_BELOW, np.linspace(0.0, 1.0, inner) ** _TOWARDS_BLACK, _ABOVE])
    even = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
    xyz = greys.black + greys.light(even) @ np.linalg.inv(greys.light_from_xyz).T
    nodes = _codes(model, xyz, even)
    low, high = (
        float(np.cbrt(ends).min()) if end else float(np.cbrt(ends).max()) for end, ends in _ends(greys, levels)
    )
    u = np.linspace(low, high, CURVE_SIZE)
    places = np.interp(greys.even(u), levels, np.linspace(0.0, 1.0, size))
    return Cube(greys.light_from_xyz, greys.black, (low, high), places, nodes.reshape(size, size, size, 3))


def _ends(greys: _Greys, levels: np.ndarray) -> tuple[tuple[bool, np.ndarray], tuple[bool, np.ndarray]]:
    ends = greys.light(np.stack([np.full(3, levels[0]), np.full(3, levels[-1])]))
    return (True, ends[0]), (False, ends[1])


@dataclass(frozen=True, eq=False)
class _Greys:
    """Greys of a display in light of its channels, 1 at white.

    codes : (G,). shown : (G,3) light, ascending.
    """

    light_from_xyz: np.ndarray
    black: np.ndarray
    codes: np.ndarray
    shown: np.ndarray

    @classmethod
    def of(cls, model: DisplayModel) -> _Greys:
        codes = np.linspace(0.0, 1.0, _GREYS) ** 1.5
        xyz = model.xyz(np.repeat(codes[:, None], 3, axis=1))
        black, white = xyz[0], xyz[-1]
        primaries = model.xyz(np.eye(3)) - black
        light_from_xyz = np.linalg.inv(primaries.T)
        # Scaled so that white is 1: where channels do not add up, their sum is not white.
        light_from_xyz /= (light_from_xyz @ (white - black))[:, None]
        light = np.clip((xyz - black) @ light_from_xyz.T, 0.0, 1.0)
        # Rising everywhere, so that each light has one code: what readings say of the darkest greys is often noise.
        light = np.maximum.accumulate(np.maximum(light, _LEAST * codes[:, None] ** _LEAST_GAMMA), axis=0)
        light += 1e-9 * codes[:, None]
        return cls(light_from_xyz, black, codes, light / light[-1])

    @cached_property
    def _slope(self) -> np.ndarray:
        """Slope of light by code at white."""
        return (1.0 - self.shown[-17]) / (1.0 - self.codes[-17])

    def light(self, even: np.ndarray) -> np.ndarray:
        """Compute light (N,3) of even codes (N,3): of the greys, mirrored below 0, linear above 1."""
        size = np.abs(even)
        roots = np.cbrt(self.shown)
        inside = np.stack([np.interp(size[:, c], self.codes, roots[:, c]) ** 3 for c in range(3)], axis=1)
        return np.sign(even) * (inside + self._slope * np.maximum(size - 1.0, 0.0))

    def even(self, u: np.ndarray) -> np.ndarray:
        """Compute even codes (n,3), each channel's for the signed cube roots of its light (n,)."""
        size = np.abs(u)
        roots = np.cbrt(self.shown)
        columns = []
        for c in range(3):
            inside = np.interp(size, roots[:, c], self.codes)
            columns.append(np.sign(u) * np.where(size > 1.0, 1.0 + (size**3 - 1.0) / self._slope[c], inside))
        return np.stack(columns, axis=1)


def _codes(model: DisplayModel, xyz: np.ndarray, even: np.ndarray) -> np.ndarray:
    """Compute codes of the nodes: exact within the display's gamut and slightly beyond, then of the nearest colour."""
    white = model.white_xyz
    near = ((even > -2.0 * _OWN - 1e-9) & (even < 1.0 + 2.0 * _OWN + 1e-9)).all(axis=1)
    own = np.clip(even, -_BEYOND, 1.0 + _BEYOND)
    wider = Inverse(model, white, -_BEYOND, 1.0 + _BEYOND)
    pull = _PULL + _DARK_PULL * np.exp(-np.abs(even[near]).max(axis=1) / _DARK)
    own[near], left = wider.codes_from(xyz[near], own[near], pull)
    excess = np.maximum(own - 1.0, -own).max(axis=1)
    share = np.clip((excess - _OWN) / (_NEAREST - _OWN), 0.0, 1.0)
    share[~near] = 1.0
    missed = np.zeros(len(even), dtype=bool)
    missed[np.flatnonzero(near)[left > _MISSED]] = True
    share[missed] = 1.0
    outside = np.flatnonzero(share > 0.0)
    nearest, nearest_off = Inverse(model, white).codes(xyz[outside], starts=1)
    cut = delta_e_xyz(xyz[outside], model.xyz(np.clip(own[outside], 0.0, 1.0)), white)
    share[outside] *= np.clip((cut - nearest_off) / _WORTH, 0.0, 1.0)
    # A channel at its bound goes on outwards: what is cut off there is what is counted.
    marked = np.where(nearest >= 1.0, np.maximum(own[outside], 1.0 + _MARK), nearest)
    marked = np.where(nearest <= 0.0, np.minimum(own[outside], -_MARK), marked)
    weight = share[outside, None]
    own[outside] = (1.0 - weight) * own[outside] + weight * marked
    return own
