"""Cache of traced rays on disk, in blocks of sites, each a file that is complete or absent.

A block is named by a hash of everything that its rays depend on: origins, normals, number of rays, triangles, the
tracing code and the libraries, but no materials, lights or cameras. So an interrupted build resumes from existing
blocks, processes may build concurrently, and the bytes are the same in any case. A block holds a hash of its content; a
damaged one is reported and traced again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt16

from ...runtime.code_hash import files_hash
from ...runtime.dask_cluster import numbered_on_cluster
from ...runtime.files import check_writable, made_folder
from ...runtime.fingerprint import fingerprint
from ...runtime.kept_arrays import UNREADABLE, read_arrays, write_arrays
from ...runtime.worker_pool import numbered
from ..scene import Scene
from ..visibility.cache_limits import most_bytes, pruned, used
from .edge_refinement import PlacedSites, placed
from .hits import RAYS, Hits, RayTracer, check_rays_fit, hits_of, ray_blocks

Progress = Callable[[int, int, str], None]
# Libraries that the rays depend on: Embree for hits, numpy for directions.
_LIBRARIES = ("numpy", "embreex")
# Number of blocks that justifies starting a further process.
_A_PROCESS = 4


@dataclass(frozen=True)
class CachedRays:
    """Files of a scene's rays in the cache.

    key : hash in the files' names. files : of the blocks, in order. sites, rays : number of sites, and of rays per
    site. there : number of blocks that already existed. nbytes : of all files.
    """

    key: str
    files: tuple[Path, ...]
    sites: int
    rays: int
    there: int
    nbytes: int


@dataclass(frozen=True, eq=False)
class _Block:
    """Rays of the sites `rows`; `there` if they were read from disk."""

    number: int
    rows: slice
    triangle: Int[np.ndarray, "n N"]
    place: UInt16[np.ndarray, "n N 2"]
    there: bool


def build_rays(
    scene: Scene,
    folder: Path | str,
    rays: int = RAYS,
    jobs: int = 1,
    progress: Progress = lambda done, total, what: None,
    longest_edge: float | None = None,
    say: Callable[[str], object] = lambda words: None,
    most: int | None = None,
    scheduler: str | None = None,
) -> CachedRays:
    """Trace and store the rays of a scene that are not in `folder` yet, with few blocks in memory at once.

    Parameters
    ----------
    folder : created if missing. rays, progress : see `PlacedSites.traced`. longest_edge : see `refined`.
    jobs : largest number of processes; the files' bytes do not depend on it.
    say : called with a message for each damaged block.
    most : size limit of the folder, bytes; least recently used files are removed, but never these. None removes
        nothing.
    scheduler : address of a Dask scheduler whose workers trace; needs the extra `cluster`.

    Raises
    ------
    InputError : the folder cannot be created or written to; see `numbered_on_cluster`. NoRoomError : its disk is full;
    finished blocks stay.
    """
    bodies = placed(scene, longest_edge)
    key = ray_key(bodies, rays)
    folder = made_folder(folder)
    there = 0
    for block in _blocks(bodies, key, folder, rays, jobs, progress, say, scheduler):
        there += block.there
    files = tuple(_files(folder, key, len(ray_blocks(len(bodies.sites), rays))))
    if most is not None:
        pruned(folder, most, keep=files)
    return CachedRays(key, files, len(bodies.sites), rays, there, sum(file.stat().st_size for file in files))


def kept_hits(
    scene: Scene,
    folder: Path | str | None,
    rays: int = RAYS,
    jobs: int = 1,
    progress: Progress = lambda done, total, what: None,
    longest_edge: float | None = None,
    say: Callable[[str], object] = lambda words: None,
    bodies: PlacedSites | None = None,
) -> Hits:
    """Return `PlacedSites.traced`, read from `folder` if cached, else traced and stored there, within
    `$METAMER_CACHE_GB`.

    folder : None or a limit of 0 disables caching. bodies : of the scene, if known. Other parameters: see `build_rays`.

    Raises
    ------
    InputError : it would not fit into memory; and what `build_rays` raises.
    """
    limit = 0 if folder is None else most_bytes()
    where = None if folder is None or not limit else Path(folder)
    bodies = placed(scene, longest_edge) if bodies is None else bodies
    count = len(bodies.sites)
    check_rays_fit(count, rays)
    triangle, place = np.empty((count, rays), dtype=np.int32), np.empty((count, rays, 2), dtype=np.uint16)
    key = "" if where is None else ray_key(bodies, rays)
    for block in _blocks(bodies, key, where, rays, jobs, progress, say):
        triangle[block.rows], place[block.rows] = block.triangle, block.place
    if where is not None:
        pruned(where, limit, keep=_files(where, key, len(ray_blocks(count, rays))))
    return hits_of(bodies.sites, bodies.corners, bodies.triangles, triangle, place)


def ray_key(bodies: PlacedSites, rays: int) -> str:
    """Hash everything that the rays of sites depend on."""
    where = bodies.sites
    given = (where.starts, where.normals, bodies.triangles, bodies.corners.face_normals, rays)
    return fingerprint(given, len(ray_blocks(len(where), rays)), tracing_code())


@cache
def tracing_code() -> str:
    """Hash the tracing modules and the versions of libraries."""
    here = Path(__file__).parent
    files = (here / "hits.py", here.parent / "vectors.py", here.parent / "mesh" / "ray_index.py")
    return files_hash(here.parents[1], files, _LIBRARIES)


def _files(folder: Path, key: str, count: int) -> list[Path]:
    return [folder / f"{key}-{number:05d}.npz" for number in range(count)]


def _blocks(
    bodies: PlacedSites,
    key: str,
    folder: Path | None,
    rays: int,
    jobs: int,
    progress: Progress,
    say: Callable[[str], object],
    scheduler: str | None = None,
) -> Iterator[_Block]:
    """Yield all blocks, each once: first those on disk, then the others as they are traced and stored."""
    rows = ray_blocks(len(bodies.sites), rays)
    files = [] if folder is None else _files(folder, key, len(rows))
    missing, done = [], 0

    def passed(block: _Block) -> _Block:
        nonlocal done
        done += block.rows.stop - block.rows.start
        progress(done, len(bodies.sites), "interreflection")
        return block

    for number, some in enumerate(rows):
        found = _read(files[number], key, number, (some.stop - some.start, rays), say) if files else None
        if found is None:
            missing.append(number)
        else:
            yield passed(_Block(number, some, *found, there=True))
    if not missing:
        return
    if files:
        # Before the work; remains of these files left by killed processes are removed as well.
        made_folder(files[0].parent)
        for number in missing:
            check_writable(files[number])
    tasks = ((bodies.sites.starts[rows[n]], bodies.sites.normals[rows[n]], rows[n].start, rays) for n in missing)
    held = bodies.triangles, bodies.corners.face_normals
    jobs = max(1, min(jobs, len(missing) // _A_PROCESS))
    if scheduler is not None:
        traced = numbered_on_cluster(_traced, tasks, scheduler, tracing_code, (_start_worker, held))
    elif jobs > 1:
        traced = numbered(_traced, tasks, jobs, (_start_worker, held))
    else:
        traced = _traced_here(tasks, held)
    with closing(traced) as results:
        for which, (triangle, place) in results:
            number = missing[which]
            if files:
                write_arrays(files[number], {"of": _of(key, number), "triangle": triangle, "place": place})
            yield passed(_Block(number, rows[number], triangle, place, there=False))


def _of(key: str, number: int) -> np.ndarray:
    return np.array(f"{key} {number}")


def _read(
    file: Path, key: str, number: int, shape: tuple[int, int], say: Callable[[str], object]
) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]] | None:
    """Read a block; None if it is missing or unusable."""
    try:
        held = read_arrays(file)
        if str(held["of"]) != str(_of(key, number)) or held["triangle"].shape != shape:
            raise ValueError("another block")
        used(file)
        return held["triangle"], held["place"]
    except FileNotFoundError:
        return None
    except UNREADABLE:
        say(f"{file} is damaged; the rays in it are traced again")
        return None


def _traced_here(
    tasks: Iterable[tuple[np.ndarray, np.ndarray, int, int]], held: tuple[np.ndarray, np.ndarray]
) -> Generator[tuple[int, tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]], None, None]:
    """Trace in this process, with a separate BVH, since another scene may be traced concurrently."""
    tracer = RayTracer(*held)
    for number, task in enumerate(tasks):
        yield number, _traced(*task, tracer)


# State of a worker process, since all blocks have the same triangles.
class _Worker(threading.local):
    tracer: RayTracer


_worker = _Worker()


def _start_worker(triangles: Float[np.ndarray, "F 3 3"], face_normals: Float[np.ndarray, "F 3"]) -> None:
    _worker.tracer = RayTracer(triangles, face_normals)


def _traced(
    starts: Float[np.ndarray, "n 3"],
    normals: Float[np.ndarray, "n 3"],
    first: int,
    rays: int,
    tracer: RayTracer | None = None,
) -> tuple[Int[np.ndarray, "n N"], UInt16[np.ndarray, "n N 2"]]:
    """Trace one block. tracer : None is that of this worker thread."""
    return (_worker.tracer if tracer is None else tracer).ends(starts, normals, first, rays)
