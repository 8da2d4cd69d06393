"""Triangles cut in two, and again, at the middles of some of their edges: a point finds its piece in a few steps.

Two triangles that share an edge share its middle, so that whatever is linear over the pieces meets along it. The first
edge of a triangle that has a middle is cut first, by a line to the opposite corner; then the pieces' own edges. Nothing
of a triangle without middles changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class Halving:
    """The cuts of F triangles, C in all.

    roots (F,) : the first cut of each triangle, -1 where it is whole. opposite (C,) : which corner, 0 to 2, the line
    runs to. middle (C,) : the vertex in the middle of the other two. halves (C, 2) : the next cut of the half that has
    the corner after the opposite one, and of the other half; -1 where that is whole.
    """

    roots: Int[np.ndarray, " F"]
    opposite: Int[np.ndarray, " C"]
    middle: Int[np.ndarray, " C"]
    halves: Int[np.ndarray, "C 2"]

    def located(
        self, faces: Int[np.ndarray, " N"], corners: Int[np.ndarray, "N 3"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """The piece that each point lies on and its weights there, from its triangle's; both are changed in place."""
        at = self.roots[faces]
        which = np.flatnonzero(at >= 0)
        at = at[which]
        while len(which):
            c = self.opposite[at]
            p, q = (c + 1) % 3, (c + 2) % 3
            near, far = weights[which, p], weights[which, q]
            first = near >= far
            corners[which, np.where(first, q, p)] = self.middle[at]
            weights[which, p] = np.where(first, near - far, 2.0 * near)
            weights[which, q] = np.where(first, 2.0 * far, far - near)
            at = self.halves[at, np.where(first, 0, 1)]
            which, at = which[at >= 0], at[at >= 0]
        return corners, weights


def halved(
    corners: Int[np.ndarray, "F 3"], sites: Int[np.ndarray, " V"], pairs: Int[np.ndarray, "A 2"]
) -> tuple[Halving, Int[np.ndarray, "L 3"], Int[np.ndarray, " L"]]:
    """Cut triangles wherever two corners are a pair.

    Parameters
    ----------
    sites : of all V vertices; those of one site are one here, as along a seam. pairs : of vertices; their middles are
        numbered from V.

    Returns
    -------
    The cuts; the pieces of all triangles that are cut; and the triangle that each is a piece of.
    """
    count, many = len(sites), int(sites.max(initial=0)) + 1
    ends = np.sort(sites[pairs], axis=1)
    keys = ends[:, 0] * many + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    sites = np.concatenate([sites, np.full(len(pairs), -1)])

    def middles(triangles: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, "n 3"]:
        """Of the edge opposite to each corner; -1 where it has none."""
        ends = np.sort(np.stack([np.roll(sites[triangles], -1, axis=1), np.roll(sites[triangles], 1, axis=1)]), axis=0)
        asked = ends[0] * many + ends[1]
        found = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
        return np.where((ends[0] >= 0) & (keys[found] == asked), count + order[found], -1)

    roots, face = np.full(len(corners), -1), np.arange(len(corners))
    if not len(pairs):
        return Halving(roots, face[:0], face[:0], np.zeros((0, 2), np.int64)), corners[:0], face[:0]
    triangles, parent, side = corners, np.full(len(corners), -1), np.zeros(len(corners), dtype=np.int64)
    cuts: list[tuple[np.ndarray, ...]] = []
    pieces, of_face, total = [], [], 0
    while len(triangles):
        found = middles(triangles)
        cut = (found >= 0).any(axis=1)
        whole = ~cut & (parent >= 0)
        pieces.append(triangles[whole])
        of_face.append(face[whole])
        triangles, face, found = triangles[cut], face[cut], found[cut]
        number, row = total + np.arange(len(triangles)), np.arange(len(triangles))
        c = (found >= 0).argmax(axis=1)
        middle = found[row, c]
        cuts.append((c, middle, parent[cut], side[cut], face))
        one, other = triangles.copy(), triangles.copy()
        one[row, (c + 2) % 3] = middle
        other[row, (c + 1) % 3] = middle
        total += len(triangles)
        triangles, face, parent = np.concatenate([one, other]), np.tile(face, 2), np.tile(number, 2)
        side = np.repeat([0, 1], len(one))
    opposite, middle, parent, side, face = (np.concatenate(each) for each in zip(*cuts, strict=True))
    first, number = parent < 0, np.arange(total)
    roots[face[first]] = number[first]
    halves = np.full((total, 2), -1)
    halves[parent[~first], side[~first]] = number[~first]
    return Halving(roots, opposite, middle, halves), np.concatenate(pieces), np.concatenate(of_face)
