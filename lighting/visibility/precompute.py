"""Precomputation of the visibility of a scene: sites are traced in tiles, optionally by several processes.

These are the sites of all vertices, in large scenes a subset (`adaptive_sampling`), and then further ones at midpoints
(`edge_refinement`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from ...runtime.memory import available_bytes, check_room, gigabytes
from ...runtime.worker_pool import in_order
from ..environment import octahedral
from ..scene import Scene
from . import adaptive_sampling, compression
from .adaptive_sampling import Surroundings
from .blocked_probes import beside_shut, edges, rim_of_shut, shut_sites
from .compression import Basis
from .edge_refinement import far_apart, middle_sites, most_middles, most_terms
from .half_space import Before
from .occluders import Occluders
from .pieces import Pieces
from .refinement import Vertices, edges_between, refined
from .sites import Sites, faces_of, nothing_hides, pieces_of, scaled_triangles, sites_at
from .tracing import MAP, Traced, traced
from .visibility import SceneVisibility

Progress = Callable[[int, int, str], None]
_Count = Callable[[int, bool], None]
#: Upper bound of CPU seconds per vertex: 0.5 ms were measured for a shape of 88,000 triangles on a floor, 1.0 ms per
#: vertex of a sheet, on one core of a small machine that was busy with other work.
SECONDS_A_VERTEX = 1.2e-3
# Number of midpoints that take as long as one site, for progress.
_A_SITE = 8
#: Seconds of work above which it is announced.
SAID_FROM_SECONDS = 10.0
#: Peak bytes per triangle and per vertex, measured with two million triangles; per triangle in each further process;
#: and per process.
BYTES_A_TRIANGLE, BYTES_A_VERTEX, BYTES_SHARED, BYTES_A_PROCESS = 1000, 700, 300, 250_000_000
# Sites per tile: some 30 MB of rays.
_TILE = 128
# Sites that justify starting a further process.
_A_PROCESS = 4096
# Smallest and largest number of evenly spread sites used to fit the axes; between these, a quarter of all.
_FEW, _TRAINING = 1024, 2048


@dataclass(frozen=True)
class VisibilityCost:
    """Upper bound of the cost of the visibility of a scene, known beforehand.

    vertices, triangles : of all parts together, after refinement. jobs : processes.
    """

    vertices: int
    triangles: int
    jobs: int = 1

    @property
    def cpu_seconds(self) -> float:
        """CPU seconds of all processes together."""
        return SECONDS_A_VERTEX * self.vertices

    @property
    def seconds(self) -> float:
        """Seconds, with a free core for each process."""
        return self.cpu_seconds / max(1, self.jobs)

    @property
    def memory_bytes(self) -> int:
        """Peak memory of all processes together, bytes; each worker has a copy of the triangles."""
        ours = BYTES_A_TRIANGLE * self.triangles + BYTES_A_VERTEX * self.vertices + BYTES_A_PROCESS
        workers = self.jobs if self.jobs > 1 else 0
        return ours + workers * (BYTES_SHARED * self.triangles + BYTES_A_PROCESS)

    @property
    def words(self) -> str:
        """Description of the cost."""
        return (
            f"{self.triangles:,} triangles, {self.vertices:,} vertices, {gigabytes(self.memory_bytes)} of memory and "
            f"at most {max(1.0, self.seconds):.0f} s"
        )

    def with_jobs(self, most: int) -> VisibilityCost:
        """Return the cost with as many processes as work and memory justify, at most `most`."""
        free = available_bytes()
        found = replace(self, jobs=max(1, min(most, self.vertices // _A_PROCESS)))
        while found.jobs > 1 and free is not None and found.memory_bytes > free:
            found = replace(found, jobs=found.jobs - 1)
        return found

    def check_room(self) -> None:
        """Raise `InputError` if this does not fit into free memory."""
        check_room(
            self.memory_bytes,
            "the visibility of this scene does not fit into memory",
            self.words,
            "thin the meshes out",
        )


def visibility_cost(scene: Scene, jobs: int = 1) -> VisibilityCost:
    """Bound the cost of `computed_visibility`; vertices may share a site or be interpolated, which costs less."""
    meshes = [part.mesh for part in refined(scene)[0].parts]
    return VisibilityCost(sum(len(mesh.vertices) for mesh in meshes), sum(len(mesh.faces) for mesh in meshes), jobs)


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """Points of a scene whose visibility is needed first.

    faces (n,), weights (n, 3) : triangles, numbered over all parts, and barycentric weights in them.
    back (n,) : True where the back side is seen, opposite to the normal.
    """

    faces: Int[np.ndarray, " n"]
    weights: Float[np.ndarray, "n 3"]
    back: Bool[np.ndarray, " n"]


def computed_visibility(
    scene: Scene,
    jobs: int = 1,
    progress: Progress = lambda done, total, what: None,
    before: Before | None = None,
    seen: SeenPoints | None = None,
    on_seen: Callable[[SceneVisibility], object] = lambda found: None,
) -> SceneVisibility | None:
    """Compute the visibility at all vertices of a scene, occluded by all of its parts, and at midpoints where it
    changes much.

    Parameters
    ----------
    jobs : largest number of processes; fewer are used for little work or little memory. The result is bit-identical if
        BLAS runs in one thread, as in commands (`worker_pool.one_thread`).
    progress : called with (sites done, upper bound of all sites, name of the work) after each tile.
    before : half space that contains all relevant occluders; None is all of the scene.
    seen, on_seen : points around which visibility is computed first, and a callback that receives it: as accurate as
        the result around these points, and dark elsewhere, in a basis of its own. The result does not depend on it,
        since all sites are traced again.

    Returns
    -------
    SceneVisibility or None : None if nothing occludes anything; for one convex body that is known without tracing.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    found = pieces_of(scene)
    if nothing_hides(found):
        return None
    try:
        return _Computation(scene, found, jobs, progress, before).result(seen, on_seen)
    finally:
        _worker.clear()


class _Computation:
    """State of the computation: sites of a scene, the basis of their codes, and the codes known so far."""

    def __init__(
        self, scene: Scene, found: tuple[Pieces, ...], jobs: int, progress: Progress, before: Before | None
    ) -> None:
        fine, self._refinement, order = refined(scene)
        meshes = [part.mesh for part in fine.parts]
        cost = VisibilityCost(sum(len(mesh.vertices) for mesh in meshes), sum(len(mesh.faces) for mesh in meshes))
        cost.check_room()
        # One process until the seen points are done, where starting more would take longer than it saves.
        self._most_jobs, self._jobs, self._progress = cost.with_jobs(jobs).jobs, 1, progress
        triangles = scaled_triangles(scene).astype(np.float32)
        self._occluders = Occluders(triangles)
        if before is None:
            _worker.triangles, _worker.occluders = triangles, self._occluders
        self._faces = faces_of(scene, found)
        corners = self._faces.cut(fine, self._refinement.of)
        where = sites_at(corners, self._occluders)
        shut = self._shut_sites(where)
        # Blocked sites come last, since codes are predicted from open sites alone.
        self._where, self._shut = where.ordered(np.argsort(shut, kind="stable")), np.sort(shut)
        self._triangles = triangles if before is None else scaled_triangles(scene, before).astype(np.float32)
        self._vertices = Vertices.of(fine).at(order).scaled(*scene.bounds)
        self._fronts, self._backs = self._where.fronts[order], self._where.backs[order]
        self._ends = [edges(of[corners.vertex.reshape(-1, 3)]) for of in (self._where.fronts, self._where.backs)]
        self._total = len(self._where)
        self._open = int(np.count_nonzero(~self._shut)) or self._total
        # Blocked sites are never seen; those beside open ones show where midpoints are needed.
        self._rim = rim_of_shut(self._shut, np.concatenate(self._ends))
        # Estimates for the progress, since the counts of traced sites and of middles are known only afterwards: half of
        # the sites, and the most middles.
        self._middles = most_middles(self._refinement) // _A_SITE
        foretold = self._open > adaptive_sampling.WHOLE
        self._filling = max(self._open // 2, min(self._open, _TRAINING)) if foretold else self._open
        # `_most` caps the progress at the end of each of these three parts.
        self._whole, self._most, self._done = self._filling + len(self._rim) + self._middles, self._filling, 0
        self._free = True

    def result(self, seen: SeenPoints | None, on_seen: Callable[[SceneVisibility], object]) -> SceneVisibility | None:
        """Compute the visibility of all sites; see `computed_visibility`."""
        if seen is not None:
            on_seen(self._around(seen))
        training = self._find_basis()
        self._jobs = self._most_jobs
        codes, dark, opened = self._codes, self._dark, np.arange(self._open)
        known = self._filled(opened, codes[: self._open], dark[: self._open], training, self._count)
        self._done, self._most = self._filling, self._whole - self._middles
        everywhere = np.arange(self._total)
        self._trace(everywhere, self._rim, codes, dark, self._count)
        inner = np.setdiff1d(np.arange(self._open, self._total), self._rim)
        codes[inner] = self._basis.hidden
        # A scene counts as unoccluded only if every site is.
        if self._free:
            rest = np.setdiff1d(everywhere, np.concatenate([known, self._rim]))
            self._trace(everywhere, rest, codes, dark, self._count)
        found = None
        if not self._free:
            pieces = self._refinement.pieces[self._refinement.whole]
            found = self._assembled(codes, pieces, self._ends, self._count_middles)
        self._progress(self._whole, self._whole, "visibility")
        return found

    def _find_basis(self) -> Int[np.ndarray, " t"]:
        """Fit the basis to sites spread evenly over the open ones, set their codes, and return their indices."""
        where, some = self._where, min(self._open, max(_FEW, self._open // 4), _TRAINING)
        training = np.unique(np.linspace(0, self._open - 1, some).astype(np.int64))
        first: list[Traced] = []
        for one in _in_tiles(self._triangles, where, training, None, self._jobs):
            first.append(one)
            self._progress(sum(len(each.distances) for each in first), self._whole, "visibility")
        distances = np.concatenate([one.distances for one in first])
        weights, values = compression.importance(distances, where.normals[training]), compression.bent(distances)
        dark, most = np.concatenate([one.dark for one in first]), most_terms(len(self._fronts), self._total)
        self._basis, codes = compression.fitted_basis(values, weights, where.normals[training], dark, most)
        self._codes = np.empty((self._total, self._basis.axes.shape[1]), dtype=np.float16)
        self._codes[training] = codes
        self._dark = np.zeros(self._total, dtype=bool)
        self._dark[training] = dark
        self._free, self._done = all(one.all_free for one in first), len(training)
        return training

    def _filled(
        self,
        sites: Int[np.ndarray, " n"],
        codes: Float[np.ndarray, "n K"],
        dark: Bool[np.ndarray, " n"],
        known: Int[np.ndarray, " k"],
        count: _Count,
    ) -> Int[np.ndarray, " t"]:
        """Fill in the codes of n open sites, traced or interpolated; return the indices of the traced ones.

        known : indices of those with known codes. count : see `_trace`.
        """
        if len(sites) <= adaptive_sampling.WHOLE:
            self._trace(sites, np.setdiff1d(np.arange(len(sites)), known), codes, dark, count)
            return np.arange(len(sites))
        around = Surroundings(self._where.starts[sites], self._where.normals[sites])
        return adaptive_sampling.thinned(
            around, codes, known, lambda which: self._trace(sites, which, codes, dark, count), dark
        )

    def _trace(
        self,
        sites: Int[np.ndarray, " n"],
        which: Int[np.ndarray, " m"],
        codes: Float[np.ndarray, "n K"],
        dark: Bool[np.ndarray, " n"],
        count: _Count,
    ) -> None:
        """Trace some of n sites; write their `codes` and `dark`.

        count : called after each tile with the number of its sites, and whether all of them are unoccluded.
        """
        at = 0
        for coded, free, tile_dark in self._traced(self._where, sites[which]):
            these = which[at : at + len(coded)]
            codes[these], dark[these] = coded, tile_dark
            at += len(coded)
            count(len(coded), free)

    def _traced(self, where: Sites, which: Int[np.ndarray, " m"]) -> Generator:
        jobs = self._jobs if len(which) > _A_PROCESS else 1
        return _in_tiles(self._triangles, where, which, self._basis, jobs)

    def _count(self, number: int, free: bool) -> None:
        """Count traced sites and report progress."""
        self._free, self._done = self._free and free, min(self._done + number, self._most)
        self._progress(self._done, self._whole, "visibility")

    def _count_middles(self, done: int, number: int) -> None:
        """Report progress of the midpoints."""
        before = self._whole - self._middles
        self._progress(before + self._middles * done // (number + 1), self._whole, "visibility")

    def _around(self, seen: SeenPoints) -> SceneVisibility:
        """Compute the visibility around some points only, in a basis fitted there."""
        refinement = self._refinement
        near, _ = refinement.located(seen.faces, seen.weights)
        pieces, wanted, ends = np.zeros(len(refinement.pieces), dtype=bool), [], []
        for sites, vertices in ((self._fronts, near[~seen.back]), (self._backs, near[seen.back])):
            touched = np.zeros(len(sites), dtype=bool)
            touched[vertices] = True
            # Adjacent pieces may be seen too, between two points.
            beside = touched[refinement.pieces].any(axis=1)
            pieces |= beside
            ends.append(edges(sites[refinement.pieces[beside]]))
            wanted.append(ends[-1].ravel())
        wanted = np.unique(np.concatenate(wanted))
        wanted = wanted[(wanted >= 0) & (wanted < self._open)]

        def count(number: int, free: bool) -> None:
            """Report progress, so that the caller can cancel."""
            self._progress(self._done, self._whole, "visibility")

        known = Surroundings(self._where.starts[wanted], self._where.normals[wanted]).coarsest(_FEW // 2)
        first: list[Traced] = []
        for one in _in_tiles(self._triangles, self._where, wanted[known], None, self._jobs):
            first.append(one)
            count(len(one.dark), one.all_free)
        distances = np.concatenate([np.empty((0, MAP**2), dtype=np.float32), *(one.distances for one in first)])
        values, dark = compression.bent(distances), np.zeros(len(wanted), dtype=bool)
        dark[known] = np.concatenate([np.zeros(0, dtype=bool), *(one.dark for one in first)])
        self._basis = compression.quick_basis(values, dark[known], most_terms(len(self._fronts), self._total))
        codes = np.tile(self._basis.hidden.astype(np.float16), (self._total, 1))
        mine = codes[wanted]
        light = ~dark[known]
        normals = self._where.normals[wanted[known[light]]]
        weights = compression.importance(distances[light], normals)
        mine[known[light]] = compression.encoded(self._basis, values[light], weights, normals)
        self._filled(wanted, mine, dark, known, count)
        codes[wanted] = mine
        rim = rim_of_shut(self._shut, np.concatenate(ends))
        self._trace(np.arange(self._total), rim, codes, np.zeros(self._total, dtype=bool), count)
        return self._assembled(codes, refinement.pieces[pieces & refinement.whole], ends)

    def _assembled(
        self,
        codes: Float[np.ndarray, "S K"],
        pieces: Int[np.ndarray, "n 3"],
        ends: Sequence[Int[np.ndarray, "m 2"]],
        on_middle: Callable[[int, int], object] = lambda done, number: None,
    ) -> SceneVisibility:
        """Assemble the visibility from the codes of all sites, with midpoints where codes differ along the edges of
        some pieces.

        ends : of edges, by site, along which blocked sites take over the codes of open ones.
        """
        fronts, backs, shut, vertices = self._fronts, self._backs, self._shut, self._vertices
        refinement, ends = self._refinement, list(ends)
        most = most_middles(refinement, codes, bool((backs >= 0).any()))
        pairs = far_apart(edges_between(pieces, fronts), vertices.facing, fronts, backs, codes, most)
        if len(pairs):
            count, vertices = len(fronts), vertices.with_middles(pairs)
            refinement, finer = middle_sites(self._faces, refinement, vertices, fronts, pairs, self._occluders)
            more, done, number = [], 0, len(finer)
            for coded, _, _ in self._traced(finer, np.arange(number)):
                more.append(coded.astype(np.float16))
                done += len(coded)
                on_middle(done, number)
            codes = np.concatenate([codes, *more])
            shut = np.concatenate([shut, self._shut_sites(finer)])
            fronts, backs = (
                np.concatenate([one, np.where(other >= 0, other + self._total, -1)])
                for one, other in ((fronts, finer.fronts), (backs, finer.backs))
            )
            middles = np.arange(count, len(fronts))
            ends += [of[np.stack([pairs[:, end], middles], axis=1)] for of in (fronts, backs) for end in (0, 1)]
        codes = beside_shut(codes, shut, np.concatenate(ends))
        return SceneVisibility(
            self._basis.mean,
            self._basis.axes,
            *compression.pack_codes(codes.astype(np.float32)),
            octahedral.in_two(vertices.facing),
            fronts.astype(np.int32),
            backs.astype(np.int32),
            pairs.astype(np.int32),
            refinement,
        )

    def _shut_sites(self, where: Sites) -> Bool[np.ndarray, " n"]:
        return shut_sites(where, self._occluders, self._faces.face_normals, self._faces.solid)


def _tiles(count: int) -> Iterator[slice]:
    for low, high in pairwise([*range(0, count, _TILE), count]):
        yield slice(low, high)


def _in_tiles(
    triangles: Float[np.ndarray, "F 3 3"],
    where: Sites,
    which: Int[np.ndarray, " n"],
    basis: Basis | None,
    jobs: int,
) -> Generator:
    """Yield the results of `_tile` for these sites, in order."""
    if not len(which):
        return
    tiles = [which[tile] for tile in _tiles(len(which))]
    tasks = ((where.starts[tile], where.normals[tile]) for tile in tiles)
    start = _start_worker, (triangles, basis)
    with closing(in_order(_tile, tasks, min(jobs, len(tiles)), start)) as results:
        yield from results


class _Worker(threading.local):
    """State of a worker, set by `_start_worker`, so that triangles are not sent with every tile. It is local to a
    thread, since another thread may work on another scene.
    """

    triangles: Float[np.ndarray, "F 3 3"] | None = None
    occluders: Occluders | None = None
    basis: Basis | None = None

    def clear(self) -> None:
        """Release the state."""
        self.triangles = self.occluders = self.basis = None


_worker = _Worker()


def _start_worker(triangles: Float[np.ndarray, "F 3 3"], basis: Basis | None) -> None:
    if _worker.triangles is not triangles:
        _worker.triangles, _worker.occluders = triangles, Occluders(triangles)
    _worker.basis = basis


def _tile(starts: np.ndarray, normals: np.ndarray) -> Traced | tuple:
    """Trace a tile; with a basis return codes (n, K), `all_free` and `dark` instead of `Traced`."""
    assert _worker.occluders is not None
    found, basis = traced(starts, normals, _worker.occluders), _worker.basis
    if basis is None:
        return found
    codes, light = np.tile(basis.hidden, (len(starts), 1)), ~found.dark
    distances = found.distances[light]
    codes[light] = compression.encoded(
        basis, compression.bent(distances), compression.importance(distances, normals[light]), normals[light]
    )
    return codes, found.all_free, found.dark
