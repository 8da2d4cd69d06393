"""Cache of visibility on disk: a file for each geometry, in a folder that may be deleted at any time.

A file is named by a hash of all that it depends on: the vertices, normals and triangles of all parts, the code of this
package, and the numerical libraries. Materials, lights and cameras do not matter, except the plane of a softbox, since
only geometry in front of it can occlude it. A file holds a hash of its content; a damaged one is reported and computed
again. `cache_limits` bounds their total size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from pathlib import Path

import numpy as np

from ...runtime.code_hash import files_hash
from ...runtime.files import check_writable, made_folder
from ...runtime.fingerprint import fingerprint
from ...runtime.kept_arrays import UNREADABLE, read_arrays, write_arrays
from ..scene import Scene
from .cache_limits import most_bytes, pruned, used
from .half_space import Before
from .precompute import SAID_FROM_SECONDS, Progress, SeenPoints, computed_visibility, visibility_cost
from .refinement import cuts
from .sites import nothing_hides, pieces_of
from .visibility import SceneVisibility

# Libraries whose version may change results.
_LIBRARIES = ("numpy", "scipy", "embreex")
# Arrays of a file; the refinement is recomputed from the scene.
_ARRAYS = tuple(each.name for each in fields(SceneVisibility) if each.name != "refinement")
_NOTHING_HIDES = "nothing_hides"


def scene_visibility(
    scene: Scene,
    folder: Path | str | None = None,
    jobs: int = 1,
    progress: Progress = lambda done, total, what: None,
    say: Callable[[str], object] = lambda words: None,
    before: Before | None = None,
    seen: SeenPoints | None = None,
    on_seen: Callable[[SceneVisibility], object] = lambda found: None,
) -> SceneVisibility | None:
    """Return the visibility of a scene, read from `folder` if cached there, else computed and stored.

    Parameters
    ----------
    folder : of the cache, created if missing; None or a limit of 0 (`cache_limits`) disables caching.
    jobs, progress, before, seen, on_seen : see `computed_visibility`.
    say : called with a message if a cache file cannot be used, and before long work.

    Returns
    -------
    SceneVisibility or None : None if nothing occludes anything.

    Raises
    ------
    InputError : it would not fit into memory; the folder cannot be created or written to; its limit is no size.
    """
    limit = 0 if folder is None else most_bytes()
    if folder is None or not limit:
        _say_cost(scene, jobs, say)
        return computed_visibility(scene, jobs, progress, before, seen, on_seen)
    file = _file(scene, Path(folder), before)
    if file.is_file():
        try:
            found = _read(file, scene)
            used(file)
            return found
        except FileNotFoundError:
            # Another process has freed space since.
            pass
        except UNREADABLE:
            say(f"{file} is damaged; the visibility of the scene is computed again")
    # Known without tracing: such scenes have no file.
    if nothing_hides(pieces_of(scene)):
        return None
    # Before the work; this also removes remains of this file left by a killed process.
    made_folder(folder)
    check_writable(file)
    _say_cost(scene, jobs, say)
    found = computed_visibility(scene, jobs, progress, before, seen, on_seen)
    _write(file, found)
    pruned(Path(folder), limit, keep=[file])
    return found


def is_kept(scene: Scene, folder: Path | str | None, before: Before | None = None) -> bool:
    """Return whether `folder` has a file with the visibility of a scene; it may still be damaged."""
    return folder is not None and _file(scene, Path(folder), before).is_file()


def _file(scene: Scene, folder: Path, before: Before | None) -> Path:
    return folder / f"{visibility_key(scene, before)}.npz"


def _say_cost(scene: Scene, jobs: int, say: Callable[[str], object]) -> None:
    cost = visibility_cost(scene).with_jobs(jobs)
    if cost.seconds >= SAID_FROM_SECONDS:
        say(f"ambient visibility, once for these meshes: {cost.words}")


def visibility_key(scene: Scene, before: Before | None = None) -> str:
    """Hash everything that the visibility of a scene depends on."""
    meshes = tuple((part.mesh.vertices, part.mesh.normals, part.mesh.faces) for part in scene.parts)
    return fingerprint(meshes, _computing_code(), before)


@cache
def _computing_code() -> str:
    """Hash the modules of this package and of its numerical dependencies, and the versions of libraries."""
    room = Path(__file__).parent
    beside = (
        "vectors.py",
        "mesh/ray_index.py",
        "reference/geometry.py",
        "environment/octahedral.py",
    )
    return files_hash(room.parents[1], [*room.glob("*.py"), *(room.parent / name for name in beside)], _LIBRARIES)


def _write(file: Path, visibility: SceneVisibility | None) -> None:
    arrays = {} if visibility is None else {name: getattr(visibility, name) for name in _ARRAYS}
    write_arrays(file, {**arrays, _NOTHING_HIDES: np.array(visibility is None)})


def _read(file: Path, scene: Scene) -> SceneVisibility | None:
    content = read_arrays(file)
    if content.pop(_NOTHING_HIDES):
        return None
    middles = content["middles"]
    fronts = content["fronts"][: len(content["fronts"]) - len(middles)]
    return SceneVisibility(**content, refinement=cuts(scene)[0].cut(fronts, middles))
