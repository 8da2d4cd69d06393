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
# Terms up to which each has operators of its own.
_FEW = 4
# Sites at once: what their rays bring should stay in a core's cache. Threads.
_BLOCK, _THREADS = 128, 2
# Bytes of a part's weights up to which they are kept for another light.
_KEPT = 1 << 28


@dataclass(frozen=True, eq=False)
class Sources:
    """What rays of glossy sites bring, pi times radiance: what sites send evenly, what the cells that such rays end on
    send, and what rays that end on glossy parts bring beside, of lights from one direction.
    """

    evenly: Float[np.ndarray, "S KJ"]
    cells: Float[np.ndarray, "U KJ"]
    at_ends: Float[np.ndarray, "n KJ"]

    @classmethod
    def of(
        cls,
        rays: GlossyRays,
        evenly: Float[np.ndarray, "S KJ"],
        light: Sequence[CellLight],
        at_ends: Float[np.ndarray, "n KJ"],
    ) -> Sources:
        """light : of each glossy part, none where no light spreads."""
        cells = np.zeros((rays.towards.shape[1], evenly.shape[1]), dtype=evenly.dtype)
        for one in light:
            cells[one.part.seen] = one.values[one.part.cells] @ one.spread
        return cls(evenly, cells, at_ends)

    @property
    def each(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """In the order of `operators_of`."""
        return self.evenly, self.cells, self.at_ends


def operators_of(rays: GlossyRays) -> tuple[Any, Any, Any]:
    """From what `Sources.each` has to what each ray brings."""
    return rays.evenly, rays.towards, rays.at_ends


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
    def operators(self) -> list[tuple[Any, ...]]:
        """Of each term, from `Sources.each` to what leaves the m sites."""
        return [
            tuple(_weighted(of, self.sites, self.of_ray[:, :, term]) for of in operators_of(self.rays))
            for term in range(self.of_ray.shape[2])
        ]

    def times(self, sources: Sources, fold: Float[np.ndarray, "R KJ M3"]) -> Float[np.ndarray, "m M3"]:
        """XYZ that the sites send to the viewer."""
        if len(fold) > _FEW:
            return self._by_ray(sources, fold)
        found = np.zeros((len(self.sites), fold.shape[2]), dtype=self.of_ray.dtype)
        for of_term, one in zip(self.operators, fold, strict=True):
            for operator, source in zip(of_term, sources.each, strict=True):
                if operator.nnz:
                    found += (operator @ source) @ one
        return found

    def _by_ray(self, sources: Sources, fold: Float[np.ndarray, "R KJ M3"]) -> Float[np.ndarray, "m M3"]:
        """The same for many terms: what each ray brings is worked out once for all of them."""
        found = np.zeros((len(self.sites), fold.shape[2]), dtype=self.of_ray.dtype)

        def work(start: int) -> None:
            mine, weights = self.sites[start : start + _BLOCK], self.of_ray[start : start + _BLOCK]
            by_term = np.matmul(weights.swapaxes(1, 2), brought_by(self.rays, mine, sources))
            found[start : start + _BLOCK] = np.einsum("nrk,rkm->nm", by_term, fold, optimize=True)

        with ThreadPoolExecutor(_THREADS) as pool:
            list(pool.map(work, range(0, len(self.sites), _BLOCK)))
        return found


def brought_by(rays: GlossyRays, sites: Int[np.ndarray, " m"], sources: Sources) -> Float[np.ndarray, "m N KJ"]:
    """pi times the radiance that each ray of some glossy sites, ascending, brings."""
    found: Any = 0.0
    for of, source in zip(operators_of(rays), sources.each, strict=True):
        found = found + _rows(of, sites, rays.rays) @ source
    return found.reshape(len(sites), rays.rays, -1)


def _rows(of: Any, sites: Int[np.ndarray, " m"], rays: int) -> Any:
    """Those of the rays of some sites, ascending."""
    first, last = int(sites[0]), int(sites[-1]) + 1
    if last - first == len(sites):
        return of[first * rays : last * rays]
    return of[(sites[:, None] * rays + np.arange(rays)).ravel()]


def _weighted(of: Any, sites: Int[np.ndarray, " m"], weights: Float[np.ndarray, "m N"]) -> Any:
    """The rows of each site's rays, weighted and summed up."""
    from scipy.sparse import csr_array

    count, rays = weights.shape
    if not count:
        return csr_array((0, of.shape[1]), dtype=weights.dtype)
    rows = _rows(of, sites, rays)
    data = rows.data * np.repeat(weights.ravel(), np.diff(rows.indptr))
    return csr_array((data, rows.indices, rows.indptr[::rays]), shape=(count, of.shape[1]))


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
