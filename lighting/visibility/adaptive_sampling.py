"""Adaptive sampling in large scenes: sites are traced where visibility changes, and interpolated elsewhere.

Sites are traced from coarse to fine: one in each cell of a grid over position and normal, then of a grid half as wide,
and so on, but only near sites that were mispredicted. A site is predicted by a plane fitted to its neighbours' codes.
Small objects close by may be missed from afar; so sites near which the scene rises above their horizon are sampled
finely in any case.

The remaining sites are interpolated from the traced sites around them, by the same plane, with the accuracy of linear
interpolation in a mesh with as many vertices. Where a decision depends on rounding, both answers are good.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from ..vectors import welded
from .tracing import MAP

#: Largest number of sites of a scene that is traced completely: some seconds.
WHOLE = 8192
#: Tolerance of predictions of a traced site by its neighbours, root mean square of compressed distances. Sites between
#: traced ones are nearer to their neighbours than these to each other, and mispredicted by about a quarter of it. Of a
#: smooth shape of 82,000 triangles a fifth is traced; with 0.12 the error of the illuminance was four times as large,
#: with 0.08 no smaller.
MISSED = 0.1
# Width of the coarsest cells, and the distance equivalent to a change of the normal by 1, both in radii of the scene.
_COARSEST, _NORMAL = 0.3, 0.5
# A shell close behind a surface is dark, and predicts nothing about the surface. A site is traced if dark sites
# contribute more than this share to its prediction, but not all of it (the error between sites is a quarter of that
# between neighbours), or if they are off its plane by more than this sine.
_MIXED, _ASIDE = 0.25 * MISSED, 0.5
# Numbers of neighbours for the fit of a plane, and of those of which one has to request finer sites.
_AROUND, _NEAR = 8, 4
# Test for a rising scene: number of nearest sites, refinement of their grid, and least sine of their elevation.
_LOOKED_AT, _FINER, _SINE = 64, 4.0, 0.1
# Ridge on the plane's slopes, for collinear neighbours.
_LEVEL = 1e-3
# Largest number of grids; sites per block, some 60 MB of codes.
_GRIDS, _BLOCK = 16, 1 << 14


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Positions and unit normals of n sites in a scene of radius 1 about the origin."""

    places: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]

    @cached_property
    def both(self) -> Float[np.ndarray, "n 6"]:
        """Joint coordinates of position and scaled normal."""
        return np.concatenate([self.places, _NORMAL * self.normals], axis=1)

    @cached_property
    def _known_cells(self) -> dict[float, Int[np.ndarray, " m"]]:
        return {}

    def one_a_cell(self, width: float) -> Int[np.ndarray, " m"]:
        """Return the first site of each non-empty cell; widths must differ by powers of 2."""
        known, count = self._known_cells, len(self.places)
        if width not in known:
            # Cells of half the width lie in whole ones: those of a site each stay so.
            apart = [wider for wider, found in known.items() if wider > width and len(found) == count]
            known[width] = (
                known[apart[0]]
                if apart
                else np.sort(np.unique(welded(np.floor(self.both / width))[1], return_index=True)[1])
            )
        return known[width]

    def coarsest(self, least: int) -> Int[np.ndarray, " m"]:
        """Return one site per cell of the coarsest grid with at least `least` non-empty cells; `thinned` begins with
        these.
        """
        found = np.arange(0)
        for number in range(_GRIDS):
            if len(found) >= min(least, len(self.places)):
                break
            found = self.one_a_cell(_COARSEST * 0.5**number)
        return found


def thinned(
    around: Surroundings,
    codes: Float[np.ndarray, "n K"],
    known: Int[np.ndarray, " k"],
    trace: Callable[[Int[np.ndarray, " m"]], object],
    dark: Bool[np.ndarray, " n"],
) -> Int[np.ndarray, " t"]:
    """Fill in the codes of all sites; return the indices of the traced ones.

    Parameters
    ----------
    codes : filled in place. known : indices of sites with known codes, sorted; they should be spread over all sites.
    trace : called with sorted sites; writes their `codes` and `dark`.
    dark : mask of known sites that see nothing; a scene rising near them hides nothing more.
    """
    both = around.both
    asking = np.ones(len(known), dtype=bool)
    # Sites with no scene rising near them, so far as tested; only the others are tested on finer grids.
    level = np.zeros(len(codes), dtype=bool)
    before = 0
    for number in range(_GRIDS):
        width = _COARSEST * 0.5**number
        cells = around.one_a_cell(width)
        asked, total = np.union1d(cells, known), len(cells)
        asked = asked[asking[_nearest(KDTree(both[known]), both[asked], _NEAR)[1]].any(axis=1)]
        new = np.setdiff1d(asked, known)
        trace(new)
        known = np.union1d(known, new)
        missed = _missed(around, codes, known, asked) > MISSED
        quiet = np.flatnonzero(~missed & ~dark[asked] & ~level[asked])
        rising = _rising(around, asked[quiet], 0.5 * width)
        missed[quiet], level[asked[quiet]] = rising, ~rising
        if not missed.any() or (not len(new) and total == before):
            break
        asking, before = np.isin(known, asked[missed]), total
    rest, tree, unsure = np.setdiff1d(np.arange(len(codes)), known), KDTree(both[known]), []
    for start in range(0, len(rest), _BLOCK):
        some = rest[start : start + _BLOCK]
        near, shares = _plane(around, known, tree, some)
        doubted = _between_shells(around, some, near, shares * dark[near])
        unsure.append(some[doubted])
        codes[some[~doubted]] = _mixed(codes, near[~doubted], shares[~doubted])
    for some in unsure:
        trace(some)
        known = np.union1d(known, some)
    return known


def _missed(
    around: Surroundings, codes: Float[np.ndarray, "n K"], known: Int[np.ndarray, " k"], which: Int[np.ndarray, " m"]
) -> Float[np.ndarray, " m"]:
    """Compute the error of predicting known sites from their neighbours, root mean square over the map."""
    found, tree = np.empty(len(which)), KDTree(around.both[known])
    for start in range(0, len(which), _BLOCK):
        some = which[start : start + _BLOCK]
        off = _mixed(codes, *_plane(around, known, tree, some)) - codes[some].astype(np.float32)
        found[start : start + _BLOCK] = np.linalg.norm(off, axis=1) / MAP
    return found


def _plane(
    around: Surroundings, known: Int[np.ndarray, " k"], tree: KDTree, which: Int[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, "m c"], Float[np.ndarray, "m c"]]:
    """Return the nearest known sites, and their shares in predicting each site by a plane; a site does not predict
    itself.

    tree : over `around.both` of the known sites.

    Least squares over steps in the tangent plane of each site, with weights that fall to 0 at the farthest neighbour.
    """
    # One more than needed, since a known site is nearest to itself.
    far, near = _nearest(tree, around.both[which], _AROUND + 1)
    near = known[near]
    reach = np.maximum(far[:, -1:], 1e-30)
    far = far / reach
    weights = np.where(near == which[:, None], 0.0, np.square(1.0 - far / 1.05) / (far + 0.05))
    normals = around.normals[which]
    side = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    one = np.cross(normals, side)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    steps = (around.places[near] - around.places[which][:, None]) / reach[..., None]
    plane = np.concatenate([np.ones((*far.shape, 1)), steps @ np.stack([one, np.cross(normals, one)], axis=2)], axis=2)
    sums = np.einsum("nka,nk,nkb->nab", plane, weights, plane)
    sums[:, [1, 2], [1, 2]] += _LEVEL * weights.sum(axis=1)[:, None]
    here = np.linalg.solve(sums, np.broadcast_to([[1.0], [0.0], [0.0]], (len(which), 3, 1)))[..., 0]
    return near, (np.einsum("nka,na->nk", plane, here) * weights).astype(np.float32)


def _mixed(
    codes: Float[np.ndarray, "n K"], near: Int[np.ndarray, "m c"], shares: Float[np.ndarray, "m c"]
) -> Float[np.ndarray, "m K"]:
    """Predict codes from neighbours and their shares."""
    used, at = np.unique(near, return_inverse=True)
    ends = near.shape[1] * np.arange(len(near) + 1)
    return csr_array((shares.ravel(), at.ravel(), ends), (len(near), len(used))) @ codes[used].astype(np.float32)


def _between_shells(
    around: Surroundings,
    which: Int[np.ndarray, " m"],
    near: Int[np.ndarray, "m c"],
    shares: Float[np.ndarray, "m c"],
) -> Bool[np.ndarray, " m"]:
    """Return a mask of sites whose prediction mixes dark sites of another surface.

    shares : of dark neighbours; 0 for all others.
    """
    dim = shares.sum(axis=1)
    found = (dim > _MIXED) & (dim < 1.0 - _MIXED)
    some = np.flatnonzero((shares != 0.0).any(axis=1) & ~found)
    offset = around.places[near[some]] - around.places[which[some]][:, None]
    rise = np.abs(np.einsum("nki,ni->nk", offset, around.normals[which[some]]))
    found[some] = ((rise > _ASIDE * np.linalg.norm(offset, axis=2)) & (shares[some] != 0.0)).any(axis=1)
    return found


def _rising(around: Surroundings, which: Int[np.ndarray, " m"], width: float) -> Bool[np.ndarray, " m"]:
    """Return a mask of sites above whose horizon the scene rises, within about `width`."""
    # Nearest by position alone, since a wall's normals are far from the floor's.
    few = around.one_a_cell(width / _FINER)
    tree, found = KDTree(around.places[few]), np.zeros(len(which), dtype=bool)
    for start in range(0, len(which), _BLOCK):
        some = which[start : start + _BLOCK]
        far, near = _nearest(tree, around.places[some], _LOOKED_AT)
        offset = around.places[few[near]] - around.places[some][:, None]
        rise = np.einsum("nki,ni->nk", offset, around.normals[some])
        found[start : start + _BLOCK] = (rise > _SINE * far + 1e-6).any(axis=1)
    return found


def _nearest(
    tree: KDTree, asked: Float[np.ndarray, "m d"], count: int
) -> tuple[Float[np.ndarray, "m c"], Int[np.ndarray, "m c"]]:
    """Return distances and indices of the nearest points in a tree."""
    far, near = (np.asarray(each).reshape(len(asked), -1) for each in tree.query(asked, min(count, tree.n)))
    return far, near
