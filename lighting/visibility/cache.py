"""Visibility that was computed before: a file for each geometry, in a folder that may be deleted at any time.

A file is named by a hash of all that it depends on: the vertices, normals and triangles of all parts, the code of this
room, and the libraries that give the numbers. Materials, lights and cameras do not count, but for the plane of a
softbox that only what lies before it can hide. It holds a hash of its content; one that is damaged is computed anew,
and that is said. `cache_limits` bounds what all of them take.
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

# Libraries of which another version may give other numbers.
_LIBRARIES = ("numpy", "scipy", "embreex")
# Arrays of a file; the refinement is made anew, since the scene says it all.
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
    """Return the visibility of a scene, from `folder` where it is there, else computed and kept there.

    Parameters
    ----------
    folder : of the cache, made where it is missing; None keeps nothing, nor does a limit of 0 (`cache_limits`).
    jobs, progress, before, seen, on_seen : as of `computed_visibility`.
    say : hears a sentence where a file of the cache cannot be used, and where the work takes long.

    Returns
    -------
    SceneVisibility or None : None where nothing hides anything from anything.

    Raises
    ------
    InputError : it would not fit into memory; the folder cannot be made or written to; its limit is no size.
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
            # Another process has made room since.
            pass
        except UNREADABLE:
            say(f"{file} is damaged; the visibility of the scene is computed again")
    # Known at once: such scenes have no file.
    if nothing_hides(pieces_of(scene)):
        return None
    # Before the work; this also clears away what a killed process has left of this file.
    made_folder(folder)
    check_writable(file)
    _say_cost(scene, jobs, say)
    found = computed_visibility(scene, jobs, progress, before, seen, on_seen)
    _write(file, found)
    pruned(Path(folder), limit, keep=[file])
    return found


def is_kept(scene: Scene, folder: Path | str | None, before: Before | None = None) -> bool:
    """Return True if `folder` has a file of the visibility of a scene, which may yet be damaged."""
    return folder is not None and _file(scene, Path(folder), before).is_file()


def _file(scene: Scene, folder: Path, before: Before | None) -> Path:
    return folder / f"{visibility_key(scene, before)}.npz"


def _say_cost(scene: Scene, jobs: int, say: Callable[[str], object]) -> None:
    cost = visibility_cost(scene).with_jobs(jobs)
    if cost.seconds >= SAID_FROM_SECONDS:
        say(f"ambient visibility, once for these meshes: {cost.words}")


def visibility_key(scene: Scene, before: Before | None = None) -> str:
    """Return the hash of everything that the visibility of a scene depends on."""
    meshes = tuple((part.mesh.vertices, part.mesh.normals, part.mesh.faces) for part in scene.parts)
    return fingerprint(meshes, _computing_code(), before)


@cache
def _computing_code() -> str:
    """Hash the modules of this room and of what they compute with, and the versions of libraries."""
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
