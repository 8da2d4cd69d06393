"""What glossy sites send towards a viewer of what other parts give them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..vectors import LEAST_COSINE, unit
from .emission import CellLight
from .glossy_rays import GlossyPart, GlossyRays
from .prepared import Prepared
from .reflection import Reflection

#: Sites whose normals look away from the viewer, by no more than this cosine, are beside triangles that are seen.
BEYOND = 0.35
# Sites at once: what their rays bring should stay in a core's cache. Threads.
_BLOCK, _THREADS = 128, 2
# Bytes of a part's weights up to which they are kept for another light.
_KEPT = 1 << 28


@dataclass(frozen=True, eq=False)
class Sources:
    """What rays of glossy sites bring, pi times radiance: what sites send evenly, what glossy parts send into cells,
    and what rays that end on them bring beside, of lights from one direction.
    """

    evenly: Float[np.ndarray, "S KJ"]
    cells: tuple[CellLight, ...]
    at_ends: Float[np.ndarray, "n KJ"]

    def of_cells(self, rays: GlossyRays, fold: Float[np.ndarray, "KJ c"] | None) -> Float[np.ndarray, "U c"]:
        """Of the cells that rays end on, folded."""
        width = self.evenly.shape[1] if fold is None else fold.shape[1]
        found = np.zeros((rays.towards.shape[1], width), dtype=self.evenly.dtype)
        for one in self.cells:
            spread = one.spread if fold is None else one.spread @ fold
            found[one.part.seen] = one.values[one.part.cells] @ spread
        return found


@dataclass(frozen=True, eq=False)
class Weights:
    """How much each ray of the sites of one glossy part counts for a viewer.

    sites (m,) : of all glossy sites, those that are seen, ascending. of_ray (m, N, R) : f_r of each term times pi / N,
    corrected (`Reflection.correction`).
    """

    rays: GlossyRays
    reflection: Reflection
    to: Float[np.ndarray, "G_p 3"]
    sites: Int[np.ndarray, " m"]
    of_ray: Float[np.ndarray, "m N R"]

    @classmethod
    def of(
        cls,
        prepared: Prepared,
        rays: GlossyRays,
        part: GlossyPart,
        reflection: Reflection,
        to: Float[np.ndarray, "G_p 3"],
        dtype: type,
    ) -> Weights:
        """to : from each of the part's sites towards the viewer, of any length."""
        wo = np.einsum("nij,nj->ni", prepared.frames[rays.sites[part.sites]], unit(to))
        seen = np.flatnonzero(wo[:, 2] > -BEYOND)
        # As at the outlines of pictures (`vectors.facing_viewer`).
        wo[:, 2] = np.maximum(wo[:, 2], LEAST_COSINE)
        wo, sites = unit(wo)[seen], part.sites[seen]
        found = np.empty((len(sites), rays.rays, len(reflection.spectra)), dtype=dtype)

        def work(start: int) -> None:
            mine = slice(start, start + _BLOCK)
            to_viewer = np.repeat(wo[mine].astype(dtype), rays.rays, axis=0)
            wi = rays.local[sites[mine]].reshape(-1, 3).astype(dtype, copy=False)
            f_r = reflection.scalars(wi, to_viewer).reshape(found[mine].shape)
            factor = reflection.correction(f_r, wo[mine, 2]) * (np.pi / rays.rays)
            np.multiply(f_r, factor[:, None], out=found[mine], casting="same_kind")

        with ThreadPoolExecutor(_THREADS) as pool:
            list(pool.map(work, range(0, len(sites), _BLOCK)))
        return cls(rays, reflection, to, sites, found)

    def holds(self, rays: GlossyRays, reflection: Reflection, to: Float[np.ndarray, "G_p 3"], dtype: type) -> bool:
        """Whether `of` would give the same."""
        same = self.rays is rays and self.reflection is reflection and self.of_ray.dtype == dtype
        return same and np.array_equal(self.to, to)

    @cached_property
    def operators(self) -> list[tuple[Any, Any, Any]]:
        """Of each term, from `Sources.evenly`, cells and `Sources.at_ends` to what leaves the m sites."""
        return [
            tuple(
                _weighted(of, self.sites, np.ascontiguousarray(self.of_ray[:, :, term]))
                for of in (self.rays.evenly, self.rays.towards, self.rays.at_ends)
            )
            for term in range(self.of_ray.shape[2])
        ]

    def times(self, sources: Sources, fold: Float[np.ndarray, "R KJ M3"]) -> Float[np.ndarray, "m M3"]:
        """XYZ that the sites send to the viewer."""
        terms, size, width = fold.shape
        if terms * width > size:
            return self._by_ray(sources, fold)
        found = np.zeros((len(self.sites), width), dtype=self.of_ray.dtype)
        for of_term, one in zip(self.operators, fold, strict=True):
            evenly, cells, at_ends = of_term
            found += evenly @ (sources.evenly @ one)
            if sources.cells:
                found += cells @ sources.of_cells(self.rays, one)
            if len(sources.at_ends):
                found += at_ends @ (sources.at_ends @ one)
        return found

    def _by_ray(self, sources: Sources, fold: Float[np.ndarray, "R KJ M3"]) -> Float[np.ndarray, "m M3"]:
        """The same for many terms: what each ray brings is worked out once for all of them."""
        found = np.zeros((len(self.sites), fold.shape[2]), dtype=self.of_ray.dtype)
        cells = sources.of_cells(self.rays, None) if sources.cells else None

        def work(start: int) -> None:
            mine, weights = self.sites[start : start + _BLOCK], self.of_ray[start : start + _BLOCK]
            ones = np.ones((len(mine), self.rays.rays), dtype=weights.dtype)
            brought = _weighted(self.rays.evenly, mine, ones, False) @ sources.evenly
            if cells is not None:
                brought += _weighted(self.rays.towards, mine, ones, False) @ cells
            if len(sources.at_ends):
                brought += _weighted(self.rays.at_ends, mine, ones, False) @ sources.at_ends
            by_term = np.matmul(weights.swapaxes(1, 2), brought.reshape(*weights.shape[:2], -1))
            found[start : start + _BLOCK] = np.einsum("nrk,rkm->nm", by_term, fold, optimize=True)

        with ThreadPoolExecutor(_THREADS) as pool:
            list(pool.map(work, range(0, len(self.sites), _BLOCK)))
        return found


def _weighted(of: Any, sites: Int[np.ndarray, " m"], weights: Float[np.ndarray, "m N"], together: bool = True) -> Any:
    """The rows of these sites' rays, weighted; `together` sums up those of each site, else each ray keeps its row."""
    from scipy.sparse import csr_array

    rays = weights.shape[1]
    first = of.indptr[sites[:, None] * rays + np.arange(rays)]
    counts = of.indptr[sites[:, None] * rays + np.arange(1, rays + 1)] - first
    of_site = counts.sum(axis=1)
    ranges = [slice(a, a + n) for a, n in zip(first[:, 0].tolist(), of_site.tolist(), strict=True)]
    none = [of.data[:0]], [of.indices[:0]]
    data = np.concatenate([of.data[each] for each in ranges] or none[0])
    indices = np.concatenate([of.indices[each] for each in ranges] or none[1])
    data = data * np.repeat(weights.ravel(), counts.ravel())
    ends = np.concatenate([[0], np.cumsum(of_site if together else counts.ravel())]).astype(np.int32)
    return csr_array((data, indices, ends), shape=(len(ends) - 1, of.shape[1]))


@dataclass(frozen=True)
class Seen:
    """The weights of each glossy part for the viewer who looked last: they hold for any light, and any material of
    other parts.
    """

    _last: dict[int, Weights] = field(default_factory=dict, repr=False)

    def weights(
        self,
        prepared: Prepared,
        rays: GlossyRays,
        part: GlossyPart,
        reflection: Reflection,
        to: Float[np.ndarray, "G_p 3"],
        dtype: type,
    ) -> Weights:
        """Those that there are, or others."""
        last = self._last.get(part.part)
        if last is not None and last.holds(rays, reflection, to, dtype):
            return last
        found = Weights.of(prepared, rays, part, reflection, to, dtype)
        self._last.pop(part.part, None)
        if found.of_ray.nbytes <= _KEPT:
            self._last[part.part] = found
        return found


def glossy_exits(
    found: Float[np.ndarray, "S M3"],
    prepared: Prepared,
    rays: GlossyRays,
    reflections: Sequence[Reflection],
    folds: Sequence[Float[np.ndarray, "R KJ M3"] | None],
    sources: Sources,
    to: Float[np.ndarray, "S 3"],
    last: Seen,
) -> None:
    """Add to `found` the sum over a site's rays of f_r times what each brings: their density is cos / pi, so that each
    of N counts pi / N, of which `folds` have the radiance, and the reference illuminance the pi of Y.

    folds : of each part that is glossy, from coefficients to XYZ, term by term. to : from each site towards the viewer,
    of any length. last : keeps what another light or material elsewhere leaves as it is.
    """
    for part in rays.parts:
        fold = folds[part.part]
        assert fold is not None
        where = rays.sites[part.sites]
        weights = last.weights(prepared, rays, part, reflections[part.part], to[where], found.dtype.type)
        found[rays.sites[weights.sites]] += weights.times(sources, fold.astype(found.dtype))
