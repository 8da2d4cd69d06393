"""Large scenes: sites are traced where visibility changes, and foretold from those where it does not.

Sites are asked for from coarse to fine: one in each cell of a grid over place and normal, then of a grid half as wide,
and so on, but only near such as were not foretold. A site was foretold where its codes are what a plane through its
neighbours' says. A map may not show from afar how small a thing is that stands close by; so sites near which the scene
rises above their horizon are asked about finely too, whatever their maps say.

What is left in the end is taken from the traced sites around it, by the same plane: as coarsely as linear interpolation
in a mesh of so many vertices would do. A place where a choice hangs on rounding is one where both answers are good.
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

#: Most sites of a scene that is traced whole: some seconds.
WHOLE = 8192
#: Root mean square of bent distances by which a traced site's own neighbours may miss it. Sites between them are nearer
#: to their neighbours than these are to each other, and missed by about a quarter of it. Of a smooth shape of 82,000
#: triangles a fifth is traced then; with 0.12 the illuminance was off by four times as much, with 0.08 by no less.
MISSED = 0.1
# Width of the coarsest cells, and the distance that a normal's change by 1 counts as, both in radii of the scene.
_COARSEST, _NORMAL = 0.3, 0.5
# A shell close behind a surface sees nothing, and predicts nothing of the surface. A site predicted by such sites with
# more than this share, but not wholly, is traced (sites between others are missed by a quarter of what these miss each
# other by), and so is one from whose plane they lie off by more than this sine.
_MIXED, _ASIDE = 0.25 * MISSED, 0.5
# Neighbours that a plane is fitted to, and those of which one has to ask for finer sites.
_AROUND, _NEAR = 8, 4
# Test for a rising scene: nearest sites tested, how much finer their grid is, and the sine that one has to rise by.
_LOOKED_AT, _FINER, _SINE = 64, 4.0, 0.1
# Weight that holds the plane's slopes to 0 where neighbours stand in a row.
_LEVEL = 1e-3
# Most grids; sites per block, some 60 MB of codes.
_GRIDS, _BLOCK = 16, 1 << 14


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Surroundings of n sites in a scene of radius 1 about the origin: places and unit normals."""

    places: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]

    @cached_property
    def both(self) -> Float[np.ndarray, "n 6"]:
        """Place of a site among places and normals."""
        return np.concatenate([self.places, _NORMAL * self.normals], axis=1)

    @cached_property
    def _known_cells(self) -> dict[float, Int[np.ndarray, " m"]]:
        return {}

    def one_a_cell(self, width: float) -> Int[np.ndarray, " m"]:
        """Return the first site of each cell that has any, for widths of which each is another times a power of 2."""
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
        """Return one site a cell of the coarsest grid that has so many: `thinned` asks for these at first, too."""
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
    """Fill in the codes of all sites; returns which of them were traced.

    Parameters
    ----------
    codes : filled in place. known : which sites have theirs; they should be spread over all, sorted.
    trace : called with sites, sorted, whose codes it writes, and `dark`.
    dark : which of the known see nothing at all: what rises near them hides nothing from them any more.
    """
    both = around.both
    asking = np.ones(len(known), dtype=bool)
    # Sites near which nothing rises, as far as tested: finer tests are for the others.
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
    """Compute by how much neighbours miss known sites, root mean square over the map."""
    found, tree = np.empty(len(which)), KDTree(around.both[known])
    for start in range(0, len(which), _BLOCK):
        some = which[start : start + _BLOCK]
        off = _mixed(codes, *_plane(around, known, tree, some)) - codes[some].astype(np.float32)
        found[start : start + _BLOCK] = np.linalg.norm(off, axis=1) / MAP
    return found


def _plane(
    around: Surroundings, known: Int[np.ndarray, " k"], tree: KDTree, which: Int[np.ndarray, " m"]
) -> tuple[Int[np.ndarray, "m c"], Float[np.ndarray, "m c"]]:
    """Return the nearest known sites, and the shares by which the plane through them, the sites themselves left out,
    predicts sites.

    tree : of `around.both` of the known sites.

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
    """Codes that neighbours predict by their shares."""
    used, at = np.unique(near, return_inverse=True)
    ends = near.shape[1] * np.arange(len(near) + 1)
    return csr_array((shares.ravel(), at.ravel(), ends), (len(near), len(used))) @ codes[used].astype(np.float32)


def _between_shells(
    around: Surroundings,
    which: Int[np.ndarray, " m"],
    near: Int[np.ndarray, "m c"],
    shares: Float[np.ndarray, "m c"],
) -> Bool[np.ndarray, " m"]:
    """Return whether sites that see nothing may predict sites of another surface.

    shares : of neighbours that see nothing; 0 for all others.
    """
    dim = shares.sum(axis=1)
    found = (dim > _MIXED) & (dim < 1.0 - _MIXED)
    some = np.flatnonzero((shares != 0.0).any(axis=1) & ~found)
    offset = around.places[near[some]] - around.places[which[some]][:, None]
    rise = np.abs(np.einsum("nki,ni->nk", offset, around.normals[which[some]]))
    found[some] = ((rise > _ASIDE * np.linalg.norm(offset, axis=2)) & (shares[some] != 0.0)).any(axis=1)
    return found


def _rising(around: Surroundings, which: Int[np.ndarray, " m"], width: float) -> Bool[np.ndarray, " m"]:
    """Return whether the scene rises above the horizons of sites, within about `width`."""
    # Nearest by places alone: a wall's normals are far from the floor's.
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
    """Find how far off the nearest in a tree are, and which these are."""
    far, near = (np.asarray(each).reshape(len(asked), -1) for each in tree.query(asked, min(count, tree.n)))
    return far, near
