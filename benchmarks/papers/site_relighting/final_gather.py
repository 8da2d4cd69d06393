"""Final gather: light of other parts that glossy sites reflect to a viewer."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ....lighting.transfer.first_bounce import CellLight
from ....lighting.transfer.glossy_part import GlossyPart
from ....lighting.transfer.glossy_rays import GlossyRays
from ....lighting.transfer.operator import columns_times
from ....lighting.transfer.precomputation import Precomputation
from ....lighting.transfer.reflection import Reflection
from ....lighting.vectors import LEAST_COSINE, unit

# Terms up to which each has an operator of its own.
_FEW = 2
# Sites at once: what their rays bring should stay in a core's cache. Threads.
_BLOCK, _THREADS = 128, 2
# Bytes of a part's weights up to which they are kept for another light; viewers of whom a static part keeps some.
_KEPT, _VIEWS = 1 << 28, 4


@dataclass(frozen=True, eq=False)
class GatherSources:
    """Incident light along rays of glossy sites, pi times radiance: what sites send evenly, what cells of glossy sites
    send, and what rays that end on glossy parts bring beside, of lights from one direction.

    light : of each glossy part, none where no light spreads. at_ends : None where there is nothing of this.
    """

    rays: GlossyRays
    evenly: Float[np.ndarray, "S F"]
    light: Sequence[CellLight]
    at_ends: Float[np.ndarray, "n F"] | None
    _whole: dict[int, tuple[np.ndarray, np.ndarray | None]] = field(default_factory=dict, repr=False)

    def before(self, part: GlossyPart, fold: Float[np.ndarray, "F m"]) -> Float[np.ndarray, "m columns"]:
        """Return all that `GlossyPart.brings` takes, folded."""
        count, to = len(self.evenly), fold.T.astype(self.evenly.dtype)
        found = np.zeros((len(to), part.brings.shape[1]), dtype=self.evenly.dtype)
        np.matmul(to, self.evenly.T, out=found[:, :count])
        for other, columns, cells in part.cells if self.light else ():
            one = self.light[other]
            seen = np.stack([values.take(cells) for values in one.values])
            found[:, count:][:, columns] = (to @ one.spread.T) @ seen
        return found

    def after(self, part: GlossyPart, fold: Float[np.ndarray, "F m"]) -> Float[np.ndarray, "e m"] | None:
        """Add the light of rays `GlossyPart.at`, folded."""
        return None if self.at_ends is None else self.at_ends[part.end] @ fold.astype(self.evenly.dtype)

    def brought(self, part: GlossyPart, sites: Int[np.ndarray, " m"]) -> Float[np.ndarray, "m N F"]:
        """Return all of it, of each ray of some of a part's sites."""
        before, after = self._known(part)
        rays = self.rays.rays
        found = part.brings[(sites[:, None] * rays + np.arange(rays)).ravel()] @ before
        if after is not None:
            row = np.full(len(part.sites), -1)
            row[sites] = np.arange(len(sites))
            site, ray = np.divmod(part.at, rays)
            some = np.flatnonzero(row[site] >= 0)
            found[row[site[some]] * rays + ray[some]] += after[some]
        return found.reshape(len(sites), rays, -1)

    def _known(self, part: GlossyPart) -> tuple[np.ndarray, np.ndarray | None]:
        if part.part not in self._whole:
            even = np.eye(self.evenly.shape[1])
            self._whole[part.part] = self.before(part, even).T.copy(), self.after(part, even)
        return self._whole[part.part]


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of the rays of one glossy part for a viewer.

    sites (m,) : those of the part that are seen, ascending. of_ray (R, G_p, N) : of these, f_r of each term times
    pi / N, corrected (`Reflection.correction`); of others anything.
    """

    part: GlossyPart
    reflection: Reflection
    to: Float[np.ndarray, "G_p 3"]
    sites: Int[np.ndarray, " m"]
    of_ray: Float[np.ndarray, "R G_p N"]

    @classmethod
    def of(
        cls,
        prepared: Precomputation,
        rays: GlossyRays,
        part: GlossyPart,
        reflection: Reflection,
        to: Float[np.ndarray, "G_p 3"],
        sites: Int[np.ndarray, " m"],
        dtype: type,
        pool: ThreadPoolExecutor,
    ) -> Weights:
        """to : from each of the part's sites towards the viewer, of any length. sites : those that are seen."""
        where = part.sites[sites]
        wo = np.einsum("nij,nj->ni", prepared.frames[rays.sites[where]], unit(to[sites]))
        # As at the outlines of pictures (`vectors.facing_viewer`).
        wo[:, 2] = np.maximum(wo[:, 2], LEAST_COSINE)
        wo = unit(wo)
        found = np.empty((len(reflection.spectra), len(part.sites), rays.rays), dtype=dtype)

        def work(start: int) -> None:
            mine = slice(start, start + _BLOCK)
            to_viewer = np.repeat(wo[mine].astype(dtype), rays.rays, axis=0)
            wi = rays.local[where[mine]].reshape(-1, 3).astype(dtype, copy=False)
            f_r = reflection.scalars(wi, to_viewer).reshape(-1, rays.rays, len(found))
            factor = reflection.correction(f_r, wo[mine, 2]) * (np.pi / rays.rays)
            for term, of_term in enumerate(found):
                of_term[sites[mine]] = f_r[:, :, term] * factor[:, term, None]

        list(pool.map(work, range(0, len(sites), _BLOCK)))
        return cls(part, reflection, to, sites, found)

    def holds(self, part: GlossyPart, reflection: Reflection, to: Float[np.ndarray, "G_p 3"], dtype: type) -> bool:
        """Return whether `of` would give the same."""
        same = self.part is part and self.reflection is reflection and self.of_ray.dtype == dtype
        return same and np.array_equal(self.to, to)

    @cached_property
    def operators(self) -> list[Any]:
        """Make the operator of each term (m, S + u), from what `GatherSources.before` has to what leaves the sites."""
        from scipy.sparse import csr_array

        numbers, ray = (one[self.sites] for one in self.part.by_site)
        of_term = (numbers.data * one.ravel()[ray.data] for one in self.of_ray)
        return [csr_array((data, numbers.indices, numbers.indptr), shape=numbers.shape) for data in of_term]

    def times(
        self, sources: GatherSources, fold: Float[np.ndarray, "R F M3"], pool: ThreadPoolExecutor
    ) -> Float[np.ndarray, "m M3"]:
        """XYZ that the sites send to the viewer."""
        if len(fold) > _FEW:
            return self._by_ray(sources, fold, pool)
        found = np.zeros((len(self.sites), fold.shape[2]), dtype=self.of_ray.dtype)
        for of_term, operator, one in zip(self.of_ray, self.operators, fold, strict=True):
            found += columns_times(operator, sources.before(self.part, one)).T
            after = sources.after(self.part, one)
            if after is not None:
                found += self._of_ends(of_term, after)
        return found

    def _of_ends(
        self, of_ray: Float[np.ndarray, "G_p N"], after: Float[np.ndarray, "e M3"]
    ) -> Float[np.ndarray, "m M3"]:
        """Add up the contribution of `GatherSources.after`."""
        count, rays = of_ray.shape
        row = np.full(count, -1)
        row[self.sites] = np.arange(len(self.sites))
        row = row[self.part.at // rays]
        seen = np.flatnonzero(row >= 0)
        weight, row = of_ray.ravel()[self.part.at[seen]], row[seen]
        found = np.stack([np.bincount(row, weight * each[seen], len(self.sites)) for each in after.T], axis=1)
        return found.astype(of_ray.dtype)

    def _by_ray(
        self, sources: GatherSources, fold: Float[np.ndarray, "R F M3"], pool: ThreadPoolExecutor
    ) -> Float[np.ndarray, "m M3"]:
        """Return the same for many terms: what each ray brings is worked out once for all of them."""
        found = np.zeros((len(self.sites), fold.shape[2]), dtype=self.of_ray.dtype)

        def work(start: int) -> None:
            mine = self.sites[start : start + _BLOCK]
            by_term = self.of_ray[:, mine].swapaxes(0, 1) @ sources.brought(self.part, mine)
            found[start : start + _BLOCK] = np.einsum("nrk,rkm->nm", by_term, fold, optimize=True)

        list(pool.map(work, range(0, len(self.sites), _BLOCK)))
        return found


@dataclass(frozen=True)
class SeenTexels:
    """The weights of each glossy part for the viewer who looked last: they hold for any light, and any material of
    other parts. Of static parts those for the last few viewers: no change of material throws them away.
    """

    _last: dict[int, list[Weights]] = field(default_factory=dict, repr=False)

    def weights(
        self,
        prepared: Precomputation,
        rays: GlossyRays,
        part: GlossyPart,
        reflection: Reflection,
        to: Float[np.ndarray, "G_p 3"],
        sites: Int[np.ndarray, " m"],
        dtype: type,
        pool: ThreadPoolExecutor,
        static: bool = False,
    ) -> Weights:
        """Return the weights that are kept, or make others."""
        known = self._last.setdefault(part.part, [])
        for place, one in enumerate(known):
            if one.holds(part, reflection, to, dtype):
                known.insert(0, known.pop(place))
                return one
        # Memory of what is thrown away is free for what comes.
        del known[(_VIEWS if static else 1) - 1 :]
        found = Weights.of(prepared, rays, part, reflection, to, sites, dtype, pool)
        if found.of_ray.nbytes <= _KEPT:
            known.insert(0, found)
        while sum(one.of_ray.nbytes for one in known) > _KEPT:
            known.pop()
        return found


def glossy_exits(
    found: Float[np.ndarray, "S M3"],
    prepared: Precomputation,
    rays: GlossyRays,
    reflections: Sequence[Reflection],
    folds: Sequence[Float[np.ndarray, "R F M3"] | None],
    sources: GatherSources,
    to: Float[np.ndarray, "S 3"],
    seen: Bool[np.ndarray, " S"],
    last: SeenTexels,
) -> None:
    """Add to `found` the sum over a site's rays of f_r times what each brings: their density is cos / pi, so that each
    of N counts pi / N, of which `folds` have the radiance, and the reference illuminance the pi of Y.

    folds : of each part that is glossy, from coefficients to XYZ, term by term. to : from each site towards the viewer,
    of any length. seen : of which sites this is asked. last : keeps what another light or material elsewhere leaves as
    it is.
    """
    with ThreadPoolExecutor(_THREADS) as pool:
        for part in rays.parts:
            fold = folds[part.part]
            assert fold is not None
            where = rays.sites[part.sites]
            some, dtype = np.flatnonzero(seen[where]), found.dtype.type
            static = prepared.scene.parts[part.part].static
            weights = last.weights(prepared, rays, part, reflections[part.part], to[where], some, dtype, pool, static)
            found[where[some]] += weights.times(sources, fold.astype(dtype), pool)
