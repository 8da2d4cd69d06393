"""From a scene to its visibility: sites traced, tile by tile, by several processes where wanted.

Those of all vertices, or in large scenes of enough of them (`thinning`); then further ones where that is too few
(`finer`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from ...spectral.memory import available_bytes, check_room, gigabytes
from ...spectral.processes import in_order
from ..scene import Scene
from . import compression, octahedral, thinning
from .before import Before
from .compression import Basis
from .finer import far_apart, middle_sites, most_middles, most_terms
from .occluders import Occluders
from .pieces import Pieces
from .refinement import Vertices, edges_between, refined
from .shut import beside_shut, edges, rim_of_shut, shut_sites
from .sites import Sites, corners_of, nothing_hides, pieces_of, scaled_triangles, sites_at
from .thinning import Surroundings
from .tracing import Traced, traced
from .visibility import SceneVisibility

Progress = Callable[[int, int, str], None]
#: CPU seconds a vertex, at most: 0.5 ms were measured of a shape of 88,000 triangles on a floor, 1.0 ms a vertex of a
#: sheet, on one core of a small machine that was busy with other work.
SECONDS_A_VERTEX = 1.2e-3
#: Work that takes longer than this is announced.
SAID_FROM_SECONDS = 10.0
#: Bytes at the peak a triangle and a vertex, measured with two million triangles; a triangle in each further process;
#: and of a process itself.
BYTES_A_TRIANGLE, BYTES_A_VERTEX, BYTES_SHARED, BYTES_A_PROCESS = 1000, 700, 300, 250_000_000
# Sites that are traced together: some 30 MB of rays.
_TILE = 128
# Sites that make a further process worth its start.
_A_PROCESS = 4096
# Sites, evenly spread over all, that the axes are found from: a quarter of them, at least so many and at most.
_FEW, _TRAINING = 1024, 2048


@dataclass(frozen=True)
class VisibilityCost:
    """What the visibility of a scene costs at most, known before the work.

    vertices, triangles : of all parts together, divided ones as they are divided. jobs : processes.
    """

    vertices: int
    triangles: int
    jobs: int = 1

    @property
    def cpu_seconds(self) -> float:
        """Of all processes together."""
        return SECONDS_A_VERTEX * self.vertices

    @property
    def seconds(self) -> float:
        """On as many free cores as there are processes."""
        return self.cpu_seconds / max(1, self.jobs)

    @property
    def memory_bytes(self) -> int:
        """At the peak, all processes together: each worker has the triangles."""
        ours = BYTES_A_TRIANGLE * self.triangles + BYTES_A_VERTEX * self.vertices + BYTES_A_PROCESS
        workers = self.jobs if self.jobs > 1 else 0
        return ours + workers * (BYTES_SHARED * self.triangles + BYTES_A_PROCESS)

    @property
    def words(self) -> str:
        """For a person."""
        return (
            f"{self.triangles:,} triangles, {self.vertices:,} vertices, {gigabytes(self.memory_bytes)} of memory and "
            f"at most {max(1.0, self.seconds):.0f} s"
        )

    def with_jobs(self, most: int) -> VisibilityCost:
        """The same with as many processes as there is work and memory for, at most `most`."""
        free = available_bytes()
        found = replace(self, jobs=max(1, min(most, self.vertices // _A_PROCESS)))
        while found.jobs > 1 and free is not None and found.memory_bytes > free:
            found = replace(found, jobs=found.jobs - 1)
        return found

    def check_room(self) -> None:
        """Raise `InputError` where this does not fit into the memory that there is."""
        check_room(
            self.memory_bytes,
            "the visibility of this scene does not fit into memory",
            self.words,
            "thin the meshes out",
        )


def visibility_cost(scene: Scene, jobs: int = 1) -> VisibilityCost:
    """What `computed_visibility` costs at most; some vertices may turn out to be one site, or foretold."""
    meshes = [part.mesh for part in refined(scene)[0].parts]
    return VisibilityCost(sum(len(mesh.vertices) for mesh in meshes), sum(len(mesh.faces) for mesh in meshes), jobs)


def computed_visibility(
    scene: Scene,
    jobs: int = 1,
    progress: Progress = lambda done, total, what: None,
    before: Before | None = None,
) -> SceneVisibility | None:
    """Find the visibility of all vertices of a scene, against all of its parts, and between them where it takes more.

    Parameters
    ----------
    jobs : processes at most: fewer where there is little to do, or no memory for more of them. The result is the same,
        bit for bit, where BLAS works in one thread, as commands have it (`processes.one_thread`).
    progress : called with (sites done, sites in all at most, what is done) after each tile.
    before : what may hide anything, where that is not all of the scene.

    Returns
    -------
    SceneVisibility or None : None where nothing hides anything from anything. Of one convex body that is known at once.

    Raises
    ------
    InputError : it would not fit into memory.
    """
    found = pieces_of(scene)
    if nothing_hides(found):
        return None
    try:
        return _computed(scene, found, jobs, progress, before)
    finally:
        _worker.clear()


def _computed(
    scene: Scene, found: tuple[Pieces, ...], jobs: int, progress: Progress, before: Before | None
) -> SceneVisibility | None:
    fine, refinement, order = refined(scene)
    meshes = [part.mesh for part in fine.parts]
    cost = VisibilityCost(sum(len(mesh.vertices) for mesh in meshes), sum(len(mesh.faces) for mesh in meshes))
    cost.check_room()
    jobs = cost.with_jobs(jobs).jobs
    triangles = scaled_triangles(scene).astype(np.float32)
    occluders = Occluders(triangles)
    bodies = corners_of(scene, found)
    corners = bodies.cut(fine, refinement.of)
    where = sites_at(corners, occluders)
    shut = shut_sites(where, occluders, bodies.face_normals, bodies.solid)
    # Those that are shut come last: what is foretold is foretold from open ones.
    where, shut = where.ordered(np.argsort(shut, kind="stable")), np.sort(shut)
    if before is not None:
        triangles = scaled_triangles(scene, before).astype(np.float32)
    total, seen = len(where), int(np.count_nonzero(~shut)) or len(where)
    # How many middles there will be is known when all vertices are: until then, as many as there may be.
    whole = total + most_middles(refinement)
    some = min(seen, max(_FEW, seen // 4), _TRAINING)
    training = np.unique(np.linspace(0, seen - 1, some).astype(np.int64))
    first: list[Traced] = []
    for one in _in_tiles(triangles, where, training, None, jobs):
        first.append(one)
        progress(sum(len(each.distances) for each in first), whole, "visibility")
    distances = np.concatenate([one.distances for one in first])
    weights, values = compression.importance(distances, where.normals[training]), compression.bent(distances)
    basis = compression.fitted_basis(values, weights, most_terms(len(order), total))

    codes = np.empty((total, basis.axes.shape[1]), dtype=np.float16)
    free = all(one.all_free for one in first)
    codes[training] = np.concatenate([compression.encoded(basis, values[t], weights[t]) for t in _tiles(len(training))])
    dark = np.zeros(total, dtype=bool)
    dark[training] = np.concatenate([one.dark for one in first])
    del first, distances, weights, values

    done = len(training)

    def trace(which: Int[np.ndarray, " m"]) -> None:
        """Work out the codes of some sites."""
        nonlocal free, done
        at = 0
        for coded, tile_free, tile_dark in _in_tiles(
            triangles, where, which, basis, jobs if len(which) > _A_PROCESS else 1
        ):
            these = which[at : at + len(coded)]
            codes[these], dark[these] = coded, tile_dark
            free, at, done = free and tile_free, at + len(coded), done + len(coded)
            progress(done, whole, "visibility")

    ends = [edges(sites_of[corners.vertex.reshape(-1, 3)]) for sites_of in (where.fronts, where.backs)]
    known = training
    if seen > thinning.WHOLE:
        around = Surroundings(where.starts[:seen], where.normals[:seen])
        known = thinning.thinned(around, codes[:seen], training, trace, dark)
    else:
        trace(np.setdiff1d(np.arange(seen), known))
        known = np.arange(seen)
    # Sites that are shut are seen from nowhere; those beside open ones say where middles are needed.
    rim = rim_of_shut(shut, np.concatenate(ends))
    trace(rim)
    inner = np.setdiff1d(np.arange(seen, total), rim)
    codes[inner] = compression.encoded(basis, *compression.hidden())
    # Nothing is taken for nothing before every site says so.
    if free:
        trace(np.setdiff1d(np.arange(total), np.concatenate([known, rim])))
    if free:
        progress(whole, whole, "visibility")
        return None
    vertices = Vertices.of(fine).at(order).scaled(*scene.bounds)
    fronts, backs = where.fronts[order], where.backs[order]
    most = most_middles(refinement, codes, bool((backs >= 0).any()))
    pairs = far_apart(
        edges_between(refinement.pieces[refinement.whole], fronts), vertices.facing, fronts, backs, codes, most
    )
    if len(pairs):
        count, vertices = len(fronts), vertices.with_middles(pairs)
        refinement, finer = middle_sites(bodies, refinement, vertices, fronts, pairs, occluders)
        more, done, number = [], 0, len(finer)
        for coded, _, _ in _in_tiles(triangles, finer, np.arange(number), basis, jobs):
            more.append(coded.astype(np.float16))
            done += len(coded)
            progress(total + (whole - total) * done // (number + 1), whole, "visibility")
        codes = np.concatenate([codes, *more])
        shut = np.concatenate([shut, shut_sites(finer, occluders, bodies.face_normals, bodies.solid)])
        fronts, backs = (
            np.concatenate([one, np.where(other >= 0, other + total, -1)])
            for one, other in ((fronts, finer.fronts), (backs, finer.backs))
        )
        middles = np.arange(count, len(fronts))
        ends += [of[np.stack([pairs[:, end], middles], axis=1)] for of in (fronts, backs) for end in (0, 1)]
    codes = beside_shut(codes, shut, np.concatenate(ends))
    progress(whole, whole, "visibility")
    return SceneVisibility(
        basis.mean,
        basis.axes,
        *compression.packed(codes.astype(np.float32)),
        octahedral.in_two(vertices.facing),
        fronts.astype(np.int32),
        backs.astype(np.int32),
        pairs.astype(np.int32),
        refinement,
    )


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
    """What `_tile` gives for these sites, tile by tile, in order."""
    if not len(which):
        return
    tiles = [which[tile] for tile in _tiles(len(which))]
    tasks = ((where.starts[tile], where.normals[tile]) for tile in tiles)
    start = _start_worker, (triangles, basis)
    with closing(in_order(_tile, tasks, min(jobs, len(tiles)), start)) as results:
        yield from results


class _Worker(threading.local):
    """What a process holds, since triangles are many and the same for every tile: set by `_start_worker`. Each thread
    has its own: another one may be at another scene.
    """

    triangles: Float[np.ndarray, "F 3 3"] | None = None
    occluders: Occluders | None = None
    basis: Basis | None = None

    def clear(self) -> None:
        """Let go of it."""
        self.triangles = self.occluders = self.basis = None


_worker = _Worker()


def _start_worker(triangles: Float[np.ndarray, "F 3 3"], basis: Basis | None) -> None:
    if _worker.triangles is not triangles:
        _worker.triangles, _worker.occluders = triangles, Occluders(triangles)
    _worker.basis = basis


def _tile(starts: np.ndarray, normals: np.ndarray) -> Traced | tuple:
    """`Traced` of a tile, with codes (n, K) in place of distances where there is a basis."""
    assert _worker.occluders is not None
    found, basis = traced(starts, normals, _worker.occluders), _worker.basis
    if basis is None:
        return found
    weights = compression.importance(found.distances, normals)
    return compression.encoded(basis, compression.bent(found.distances), weights), found.all_free, found.dark
