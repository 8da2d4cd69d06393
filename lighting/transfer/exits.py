"""What glossy sites send towards a viewer of what other parts give them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float

from ..vectors import LEAST_COSINE, unit
from .glossy_rays import GlossyRays
from .prepared import Prepared
from .reflection import Reflection

#: Sites whose normals look away from the viewer, by no more than this cosine, are beside triangles that are seen.
BEYOND = 0.35
# Sites at once: what their rays bring should stay in a core's cache. Threads.
_BLOCK, _THREADS = 128, 2


def glossy_exits(
    found: Float[np.ndarray, "S M3"],
    prepared: Prepared,
    rays: GlossyRays,
    reflections: Sequence[Reflection],
    folds: Sequence[Float[np.ndarray, "R KJ M3"] | None],
    sources: tuple[Float[np.ndarray, "S KJ"], Float[np.ndarray, "GO KJ"], Float[np.ndarray, "n KJ"]],
    to: Float[np.ndarray, "S 3"],
) -> None:
    """Add to `found` the sum over a site's rays of f_r times what each brings: their density is cos / pi, so that each
    of N counts pi / N, of which `folds` have the radiance, and the reference illuminance the pi of Y.

    folds : of each part that is glossy, from coefficients to XYZ, term by term. sources : what sites send evenly, what
    glossy ones send into cells, and what rays that end on them bring beside. to : from each site towards the viewer,
    of any length.
    """
    part = prepared.hits.part_of_site[rays.sites]
    wo = np.einsum("nij,nj->ni", prepared.frames[rays.sites], unit(to[rays.sites]))
    seen = np.flatnonzero(wo[:, 2] > -BEYOND)
    # As at the outlines of pictures (`vectors.facing_viewer`).
    wo[:, 2] = np.maximum(wo[:, 2], LEAST_COSINE)
    wo = unit(wo)
    seen = seen[np.argsort(part[seen], kind="stable")]
    edges = np.searchsorted(part[seen], np.arange(len(reflections) + 1))
    blocks = [
        (number, seen[start : min(start + _BLOCK, edges[number + 1])])
        for number in range(len(reflections))
        for start in range(edges[number], edges[number + 1], _BLOCK)
    ]
    ends = _of_glossy(rays) if sources[2].any() else None

    def work(block: tuple[int, np.ndarray]) -> None:
        number, mine = block
        fold = folds[number]
        assert fold is not None
        brought = _brought(rays, mine, sources, ends)
        to_viewer = np.repeat(wo[mine].astype(brought.dtype), rays.rays, axis=0)
        wi = rays.local[mine].reshape(-1, 3).astype(brought.dtype, copy=False)
        f_r = reflections[number].scalars(wi, to_viewer).astype(brought.dtype)
        f_r = f_r.reshape(len(mine), rays.rays, f_r.shape[1])
        by_term = np.matmul(f_r.swapaxes(1, 2), brought)
        by_term *= reflections[number].correction(f_r, wo[mine, 2])[:, :, None]
        found[rays.sites[mine]] += np.einsum("nrk,rkm->nm", by_term, fold * (np.pi / rays.rays), optimize=True)

    with ThreadPoolExecutor(_THREADS) as pool:
        list(pool.map(work, blocks))


def _of_glossy(rays: GlossyRays) -> tuple[np.ndarray, np.ndarray]:
    """Rays of glossy sites that end on glossy parts: numbers among those of glossy sites, ascending, and in `ray`."""
    row = rays.number[rays.ray // rays.rays]
    which = np.flatnonzero(row >= 0)
    return row[which] * rays.rays + rays.ray[which] % rays.rays, which


def _brought(
    rays: GlossyRays,
    mine: np.ndarray,
    sources: tuple[np.ndarray, np.ndarray, np.ndarray],
    ends: tuple[np.ndarray, np.ndarray] | None,
) -> Float[np.ndarray, "m N KJ"]:
    """pi times the radiance that each ray of some glossy sites (ascending) brings."""
    evenly, cells, beside = sources
    first, last, size = int(mine[0]), int(mine[-1]) + 1, evenly.shape[1]
    # Rows one after the other are read much sooner than chosen ones, even where not all of them are asked for.
    together = last - first <= 2 * len(mine)
    rows = np.arange(first, last) if together else mine
    some = slice(first * rays.rays, last * rays.rays)
    if not together:
        some = (mine[:, None] * rays.rays + np.arange(rays.rays)).ravel()
    found = rays.evenly[some] @ evenly
    found += rays.towards[some] @ cells
    found = found.reshape(len(rows), rays.rays, size)[mine - first if together else slice(None)]
    if ends is not None:
        number, which = ends
        for place, site in enumerate(mine):
            a, b = np.searchsorted(number, (site * rays.rays, (site + 1) * rays.rays))
            found[place, number[a:b] - site * rays.rays] += beside[which[a:b]]
    return found
