"""Importance sampling of directions for any surface, from a table made of the surface itself.

No model needs a sampling method of its own: the density of the table is known exactly, so that a weighted mean is
unbiased. A table that fits its surface badly only costs noise.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from .points import Points
from .surface import Surface

# Half vectors in a table: their polar angles lie in rings whose edges grow by this factor from the first, which holds
# the highlight of what is nearly a mirror, up to where they are this wide; from there they are all as wide.
_FIRST_EDGE, _GROWTH, _WIDEST = 1e-8, 1.25, np.deg2rad(3.0)
# Cells of a ring, and directions to the viewer for which there is a table: polar angles, azimuths.
_SECTORS, _POLAR, _ROUND = 16, 24, 12
# An anisotropic surface has tables for azimuths of the viewer too, and fewer polar angles.
_POLAR_ANISOTROPIC, _SECTORS_ANISOTROPIC = 12, 24
# The cosine lobe's least share: it draws what the table leaves out.
_LEAST_COSINE = 0.15
# The same if f_r varies over a texture: the table is only of its mean.
_LEAST_COSINE_VARIED = 0.4
# Share of all values that may lie below what counts as the diffuse part.
_DIFFUSE_QUANTILE = 0.05
# f_r cos(theta_i) that is nowhere more than this many times its mean over the hemisphere counts as even.
_EVEN = 4.0
# A cell has at least this share of its brightest neighbour's density: a highlight may lie across the border.
_NEAR = 0.25


class DirectionSampler:
    """Sampler of directions to the light, for directions to the viewer, roughly in proportion to f_r cos(theta_i).

    The density is a mixture of a cosine lobe, weighted by the diffuse share of f_r, and of half vectors h in cells of
    constant density p(h), tabulated by the viewer's polar angle (and azimuth, if the surface is anisotropic). For
    directions to the light the latter is p(h) / (4 h.wo) (Walter et al. 2007, eq. 14). f_r is weighted by Y under a
    light of equal energy.

    Parameters
    ----------
    surface : any. If it varies over a texture, its mean is tabulated.
    """

    def __init__(self, surface: Surface) -> None:
        known, least = surface, _LEAST_COSINE
        if surface.uses_uv:
            least = _LEAST_COSINE_VARIED
            with suppress(InputError):  # a mean that no surface can have costs noise, nothing else
                known = surface.average()
        self._isotropic = bool(known.isotropic)
        self._polar = _POLAR if self._isotropic else _POLAR_ANISOTROPIC
        self._round = 1 if self._isotropic else _ROUND
        self._sectors = _SECTORS if self._isotropic else _SECTORS_ANISOTROPIC
        # Rings are told apart by v = sin(theta_h / 2)^2, which is even by solid angle.
        self._edges = np.sin(0.5 * _ring_edges()) ** 2
        nodes = self._polar * self._round
        self._cosine_share = np.ones(nodes)
        self._highest = np.zeros(nodes)
        if known.uses_uv:
            self._highest[:] = np.inf
            return
        self._tabulate(known, least)

    def _tabulate(self, surface: Surface, least: float) -> None:
        rings = len(self._edges) - 1
        solid = 4.0 * np.pi * np.diff(self._edges) / self._sectors
        v = np.repeat(0.5 * (self._edges[1:] + self._edges[:-1]), self._sectors)
        h = _half_vector(v, np.tile((np.arange(self._sectors) + 0.5) * (2.0 * np.pi / self._sectors), rings))
        fold = Folding(observer("1931_2"), [Spectrum(np.ones(2), np.array([360.0, 830.0]), "emission")])
        density = np.zeros((len(self._cosine_share), rings, self._sectors))
        for node in range(len(density)):
            wo = self._node_direction(node)
            h_wo = h @ wo
            wi = 2.0 * h_wo[:, None] * h - wo
            lit = np.flatnonzero((wi[:, 2] > 0.0) & (h_wo > 0.0))
            wi = wi[lit] / np.linalg.norm(wi[lit], axis=1, keepdims=True)
            f_r = np.maximum(surface.xyz(Points(wi, np.tile(wo, (len(wi), 1))), fold)[:, 1], 0.0)
            f_r[~np.isfinite(f_r)] = 0.0
            even = float(np.quantile(f_r, _DIFFUSE_QUANTILE)) if len(f_r) else 0.0
            rest = np.zeros(rings * self._sectors)
            # f_r cos(theta_i) dwi, with dwi = 4 h.wo dwh.
            rest[lit] = np.maximum(f_r - even, 0.0) * wi[:, 2] * 4.0 * h_wo[lit]
            cells = _spread(rest.reshape(rings, self._sectors))
            total = float((cells * solid[:, None]).sum())
            mean = even + total / np.pi
            self._highest[node] = (f_r * wi[:, 2]).max(initial=0.0) / mean if mean > 0.0 else 0.0
            if total > 1e-3 * np.pi * even:
                self._cosine_share[node] = np.clip(np.pi * even / (np.pi * even + total), least, 1.0)
                density[node] = cells / total
        mass = density * solid[None, :, None]
        rings_mass = mass.sum(axis=2)
        self._density = density
        self._rings = _Cells(np.cumsum(rings_mass, axis=1))
        sectors = np.cumsum(mass, axis=2) / np.where(rings_mass > 0.0, rings_mass, 1.0)[:, :, None]
        self._sectors_of = _Cells(sectors.reshape(-1, self._sectors))

    @property
    def even(self) -> bool:
        """True if the surface has no highlight from any direction, so that sampling the light alone suffices."""
        return bool((self._highest <= _EVEN).all())

    def _node_direction(self, node: int) -> Float[np.ndarray, "3"]:
        polar, round_ = divmod(node, self._round)
        theta, phi = (polar + 0.5) * 0.5 * np.pi / self._polar, round_ * 2.0 * np.pi / self._round
        return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])

    def _nodes(self, wo: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the nearest tabulated directions to the viewer."""
        theta = np.arctan2(np.hypot(wo[:, 0], wo[:, 1]), wo[:, 2])
        polar = np.clip((theta * (self._polar / (0.5 * np.pi))).astype(np.int64), 0, self._polar - 1)
        if self._isotropic:
            return polar
        step = np.arctan2(wo[:, 1], wo[:, 0]) * (self._round / (2.0 * np.pi))
        return polar * self._round + np.round(step).astype(np.int64) % self._round

    def drawn(self, wo: Float[np.ndarray, "n 3"], uniform: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
        """Draw a direction to the light for each direction to the viewer and pair of numbers in [0, 1).

        Both are in the surface's frame. Some results are on or below the horizon; they must count as 0.
        """
        node = self._nodes(wo)
        share = self._cosine_share[node]
        even = uniform[:, 0] < share
        wi = np.empty((len(wo), 3))
        first = uniform[:, 0] / share
        radius, phi = np.sqrt(first[even]), 2.0 * np.pi * uniform[even, 1]
        wi[even] = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1.0 - first[even])], axis=1)
        rest = np.flatnonzero(~even)
        if len(rest):
            left = (uniform[rest, 0] - share[rest]) / (1.0 - share[rest])
            h = self._half_vectors(node[rest], left, uniform[rest, 1])
            to = wo[rest]
            if self._isotropic:
                h = _turned(h, to)
            mirrored = 2.0 * _dot(h, to)[:, None] * h - to
            wi[rest] = mirrored / np.sqrt(_dot(mirrored, mirrored))[:, None]
        return wi

    def _half_vectors(
        self, node: Int[np.ndarray, " n"], first: Float[np.ndarray, " n"], second: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        ring, along = self._rings.found(node, first)
        sector, across = self._sectors_of.found(node * self._rings.count + ring, second)
        v = self._edges[ring] + along * (self._edges[ring + 1] - self._edges[ring])
        return _half_vector(v, (sector + across) * (2.0 * np.pi / self._sectors))

    def density(self, wo: Float[np.ndarray, "n 3"], wi: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Compute the density, 1/sr, of directions from `drawn`, above the horizon."""
        node = self._nodes(wo)
        share = self._cosine_share[node]
        out = share * np.maximum(wi[:, 2], 0.0) / np.pi
        some = np.flatnonzero(share < 1.0)
        if not len(some):
            return out
        wo, wi = wo[some], wi[some]
        h = wo + wi
        length = np.sqrt(_dot(h, h))
        h /= np.where(length > 0.0, length, 1.0)[:, None]
        h_wo = _dot(h, wo)
        # sin(theta / 2)^2 without the difference of numbers that are nearly one.
        v = 0.5 * (h[:, 0] ** 2 + h[:, 1] ** 2) / (1.0 + h[:, 2])
        ring = np.clip(np.searchsorted(self._edges, v, side="right") - 1, 0, len(self._edges) - 2)
        phi = np.arctan2(h[:, 1], h[:, 0])
        if self._isotropic:
            phi = phi - np.arctan2(wo[:, 1], wo[:, 0])
        sector = np.floor(phi * (self._sectors / (2.0 * np.pi))).astype(np.int64) % self._sectors
        # h.wo is at least cos(45 deg) or so of each where both are above the horizon, and 0 for no pair of them.
        halves = self._density[node[some], ring, sector] / (4.0 * np.where(h_wo > 0.0, h_wo, 1.0))
        out[some] += (1.0 - share[some]) * halves
        return out


def _ring_edges() -> Float[np.ndarray, " R"]:
    """Compute theta_h at the edges of rings, radians, from 0 to a right angle."""
    edges = [0.0, _FIRST_EDGE]
    while edges[-1] * (_GROWTH - 1.0) < _WIDEST:
        edges.append(edges[-1] * _GROWTH)
    left = 0.5 * np.pi - edges[-1]
    return np.append(edges, edges[-1] + left * np.arange(1, 1 + np.ceil(left / _WIDEST)) / np.ceil(left / _WIDEST))


def _half_vector(v: Float[np.ndarray, " n"], phi: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
    """Return the direction at sin(theta / 2)^2 = v and azimuth phi."""
    sine = 2.0 * np.sqrt(v * (1.0 - v))
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), 1.0 - 2.0 * v], axis=1)


def _turned(h: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Rotate half vectors about the normal, from a viewer at azimuth 0 to one at that of `wo`."""
    across = np.hypot(wo[:, 0], wo[:, 1])
    upright = across == 0.0
    safe = np.where(upright, 1.0, across)
    cosine, sine = np.where(upright, 1.0, wo[:, 0] / safe), wo[:, 1] / safe
    return np.stack([cosine * h[:, 0] - sine * h[:, 1], sine * h[:, 0] + cosine * h[:, 1], h[:, 2]], axis=1)


def _spread(cells: Float[np.ndarray, "R S"]) -> Float[np.ndarray, "R S"]:
    """Raise each cell to at least `_NEAR` of the brightest beside it."""
    padded = np.pad(cells, ((1, 1), (0, 0)), mode="edge")
    beside = np.max([padded[:-2], padded[2:], np.roll(cells, 1, axis=1), np.roll(cells, -1, axis=1)], axis=0)
    return np.maximum(cells, _NEAR * beside)


def _dot(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    """Compute scalar products column by column, several times faster than sums along rows of three."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


class _Cells:
    """Rows of cells; `up_to` (m, k) is the cumulative sum of shares at each cell's end, up to 1 but for rounding."""

    def __init__(self, up_to: Float[np.ndarray, "m k"]) -> None:
        self.count = up_to.shape[1]
        self._last = up_to[:, -1].copy()
        # Each row's sums after a zero, and one row after the other, so that one search finds all.
        self._from = np.pad(up_to, ((0, 0), (1, 0)))
        self._flat = (up_to + 2.0 * np.arange(len(up_to))[:, None]).ravel()

    def found(
        self, row: Int[np.ndarray, " n"], uniform: Float[np.ndarray, " n"]
    ) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Find the cell of a row in which each number in [0, 1) falls, and the position within the cell.

        Numbers are scaled to the row's end.
        """
        sought = uniform * self._last[row]
        first = row * self.count
        cell = np.clip(np.searchsorted(self._flat, sought + 2.0 * row, side="right") - first, 0, self.count - 1)
        at = first + row + cell
        before = self._from.take(at)
        width = self._from.take(at + 1) - before
        return cell, np.clip((sought - before) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
