"""Recursive bisection of triangles at the midpoints of some edges, as a binary tree for point location.

Two triangles that share an edge share its midpoint, so that functions linear over the pieces are continuous. Of the
edges of a piece that get midpoints at the same time the one with the lowest number is cut first, by a line to the
opposite corner; then the edges of the halves. Where longer edges have lower numbers, this is the longest-edge partition
of M.-C. Rivara (International Journal for Numerical Methods in Engineering 20, 1984), whose angles do not degenerate.
Triangles without midpoints are unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int


@dataclass(frozen=True, eq=False)
class Halving:
    """Binary tree of C cuts of F triangles, with T pieces as leaves.

    corners (F, 3) : vertices of the triangles.
    opposite (C,) : corner, 0 to 2, of the bisected triangle to which the cut runs. middle (C,) : vertex at the midpoint
        of the other two.
    next (F + 2 C,) : the cut of each triangle, and then of both halves of each cut, first the one with the corner after
        the opposite one; -1 for a piece.
    pieces (T, 3), of (T,), slot (T,) : the vertices of each piece, its triangle (ascending), and its index in `next`. A
        triangle without cuts is a piece.
    """

    corners: Int[np.ndarray, "F 3"]
    opposite: Int[np.ndarray, " C"]
    middle: Int[np.ndarray, " C"]
    next: Int[np.ndarray, " slots"]
    pieces: Int[np.ndarray, "T 3"]
    of: Int[np.ndarray, " T"]
    slot: Int[np.ndarray, " T"]

    @classmethod
    def none(cls, corners: Int[np.ndarray, "F 3"]) -> Halving:
        """Return the tree without cuts."""
        own, nothing = np.arange(len(corners)), np.zeros(0, dtype=np.int64)
        return cls(corners, nothing, nothing, np.full(len(corners), -1), corners, own, own)

    @property
    def whole(self) -> Bool[np.ndarray, " T"]:
        """Mask of pieces that are uncut triangles."""
        return self.slot < len(self.corners)

    @property
    def halves(self) -> Int[np.ndarray, "C 2"]:
        """Next cuts of both halves of each cut; -1 for a piece."""
        return self.next[len(self.corners) :].reshape(-1, 2)

    @property
    def shares(self) -> Float[np.ndarray, "T 3 3"]:
        """Barycentric weights of each piece's corners in its triangle: dyadic fractions, hence exact."""
        found = np.tile(np.eye(3), (len(self.pieces), 1, 1))
        piece = np.full(len(self.next), -1)
        piece[self.slot] = np.arange(len(self.pieces))
        at = self.next[: len(self.corners)]
        at = at[at >= 0]
        shares = np.tile(np.eye(3), (len(at), 1, 1))
        while len(at):
            row, c = np.arange(len(at)), self.opposite[at]
            p, q = (c + 1) % 3, (c + 2) % 3
            middle = 0.5 * (shares[row, p] + shares[row, q])
            one, other = shares.copy(), shares
            one[row, q] = other[row, p] = middle
            shares = np.concatenate([one, other])
            slot = len(self.corners) + np.concatenate([2 * at, 2 * at + 1])
            ended = piece[slot] >= 0
            found[piece[slot[ended]]] = shares[ended]
            at, shares = self.next[slot[~ended]], shares[~ended]
        return found

    def cut(self, sites: Int[np.ndarray, " V"], pairs: Int[np.ndarray, "A 2"]) -> Halving:
        """Bisect pieces at the midpoints of their edges that are in `pairs`.

        Parameters
        ----------
        sites : of all V vertices; vertices of one site are identified, as along a seam. pairs : of vertices; their
            midpoints are numbered from V, so that new pieces are those with such a vertex.
        """
        if not len(pairs):
            return self
        middles = _Middles(sites, pairs)
        found = middles.of(self.pieces)
        cut = (found >= 0).any(axis=1)
        pieces, of, slot = [self.pieces[~cut]], [self.of[~cut]], [self.slot[~cut]]
        triangles, face, at, found = self.pieces[cut], self.of[cut], self.slot[cut], found[cut]
        cuts, slots, total = [(self.opposite, self.middle)], [], len(self.opposite)
        while len(triangles):
            row, number = np.arange(len(triangles)), total + np.arange(len(triangles))
            c = np.where(found >= 0, found, middles.beyond).argmin(axis=1)
            cuts.append((c, found[row, c]))
            slots.append(at)
            total += len(row)
            one, other = triangles.copy(), triangles.copy()
            one[row, (c + 2) % 3] = other[row, (c + 1) % 3] = found[row, c]
            triangles, face = np.concatenate([one, other]), np.tile(face, 2)
            at = len(self.corners) + np.concatenate([2 * number, 2 * number + 1])
            found = middles.of(triangles)
            cut = (found >= 0).any(axis=1)
            for kept, each in ((pieces, triangles), (of, face), (slot, at)):
                kept.append(each[~cut])
            triangles, face, at, found = triangles[cut], face[cut], at[cut], found[cut]
        opposite, middle = (np.concatenate(each) for each in zip(*cuts, strict=True))
        following = np.full(len(self.corners) + 2 * total, -1)
        following[: len(self.next)] = self.next
        following[np.concatenate(slots)] = len(self.opposite) + np.arange(total - len(self.opposite))
        triangles, face, at = (np.concatenate(each) for each in (pieces, of, slot))
        order = np.argsort(face, kind="stable")
        return Halving(self.corners, opposite, middle, following, triangles[order], face[order], at[order])

    def located(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Locate points, given by triangles and barycentric weights: return the vertices of the piece that contains
        each and the barycentric weights in that piece.
        """
        corners, weights = self.corners[faces], np.array(weights, dtype=np.float64)
        at = self.next[faces]
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


class _Middles:
    """Look-up of the midpoints of edges.

    beyond : a number above those of all midpoints.
    """

    def __init__(self, sites: Int[np.ndarray, " V"], pairs: Int[np.ndarray, "A 2"]) -> None:
        self._count = len(sites)
        first = int(sites.max(initial=-1)) + 1
        self._many = first + len(pairs)
        self._sites = np.concatenate([sites.astype(np.int64), first + np.arange(len(pairs))])
        keys = self._keys(self._sites[pairs.T])
        self._order = np.argsort(keys, kind="stable")
        self._sorted, self.beyond = keys[self._order], self._count + len(pairs)

    def of(self, triangles: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, "n 3"]:
        """Return the midpoint of the edge opposite to each corner; -1 for none."""
        sites = self._sites[triangles]
        one, other = np.roll(sites, -1, axis=1), np.roll(sites, 1, axis=1)
        asked = self._keys(np.stack([one, other]))
        found = np.minimum(np.searchsorted(self._sorted, asked), len(self._sorted) - 1)
        there = (one >= 0) & (other >= 0) & (self._sorted[found] == asked)
        return np.where(there, self._count + self._order[found], -1)

    def _keys(self, ends: Int[np.ndarray, "2 *n"]) -> Int[np.ndarray, "*n"]:
        return ends.min(axis=0) * self._many + ends.max(axis=0)
