"""The folder of kept visibility: bounded, the least recently used goes first, and two processes may be at it."""

import os
import subprocess
import sys

import pytest
from metamer.lighting.mesh.shapes import speed_shape, sphere
from metamer.lighting.visibility import cache, cache_limits
from metamer.lighting.visibility.cache import scene_visibility, visibility_key
from metamer.runtime.errors import InputError


@pytest.fixture
def folder(tmp_path):
    """Files a, b, c, d of 1000 bytes, last used in this order."""
    for number, name in enumerate("abcd"):
        (tmp_path / f"{name}.npz").write_bytes(b"x" * 1000)
        os.utime(tmp_path / f"{name}.npz", (1000.0 + number, 1000.0 + number))
    return tmp_path


def names(folder):
    return sorted(file.stem for file in folder.iterdir())


def test_what_was_not_used_for_longest_goes_first(folder):
    cache_limits.used(folder / "a.npz")
    assert cache_limits.pruned(folder, 2500) == (2, 2000)
    assert names(folder) == ["a", "d"]


def test_what_fits_stays_and_what_was_just_used_always_does(folder):
    assert cache_limits.pruned(folder, 4000) == (4, 4000)
    assert cache_limits.pruned(folder, 10, keep=[folder / "b.npz"]) == (1, 1000)
    assert names(folder) == ["b"]


def test_other_files_are_left_alone(folder):
    (folder / "notes.txt").write_bytes(b"x" * 5000)
    assert cache_limits.pruned(folder, 0) == (0, 0)
    assert names(folder) == ["notes"]


def test_a_file_that_another_process_has_removed_counts_as_gone(folder, monkeypatch):
    listed = [*cache_limits._files(folder)]
    (folder / "a.npz").unlink()
    monkeypatch.setattr(cache_limits, "_files", lambda _: iter(listed))
    assert cache_limits.pruned(folder, 2000) == (2, 2000)
    assert names(folder) == ["c", "d"]


PRUNING = """
import os, sys
from pathlib import Path
from metamer.lighting.visibility import cache_limits as keeping
folder, name = Path(sys.argv[1]), sys.argv[2]
for number in range(300):
    file = folder / f"{name}{number}.npz"
    file.write_bytes(b"x" * 1000)
    keeping.pruned(folder, 5000, keep=[file])
"""


def test_two_processes_at_once_keep_the_bound(tmp_path):
    both = [
        subprocess.Popen([sys.executable, "-c", PRUNING, str(tmp_path), name], stderr=subprocess.PIPE, text=True)
        for name in ("one", "two")
    ]
    for process in both:
        _, said = process.communicate()
        assert process.returncode == 0, said
    assert cache_limits.pruned(tmp_path, 5000)[1] <= 5000


@pytest.mark.slow
def test_scenes_are_kept_up_to_the_limit(scene_of, tmp_path, monkeypatch):
    scenes = [scene_of(speed_shape(1), sphere(1, 0.2).placed(translate=(0.0, 1.0 + k, 0.0))) for k in range(3)]
    scene_visibility(scenes[0], tmp_path)
    (first,) = tmp_path.iterdir()
    os.utime(first, (1000.0, 1000.0))
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, str(2.5e-9 * first.stat().st_size))
    scene_visibility(scenes[1], tmp_path)
    # Looked up, and so of use: the second is the oldest now.
    os.utime(tmp_path / f"{visibility_key(scenes[1])}.npz", (2000.0, 2000.0))
    scene_visibility(scenes[0], tmp_path)
    scene_visibility(scenes[2], tmp_path)
    assert names(tmp_path) == sorted(visibility_key(scenes[k]) for k in (0, 2))


def test_a_limit_of_nothing_keeps_nothing(scene_of, tmp_path, monkeypatch):
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, "0")
    assert scene_visibility(scene_of(speed_shape(1)), tmp_path / "here") is not None
    assert not (tmp_path / "here").exists()


def test_a_file_removed_while_it_is_looked_up_is_no_damage(scene_of, tmp_path, monkeypatch):
    scene = scene_of(speed_shape(1))
    scene_visibility(scene, tmp_path)

    def gone(file, _scene):
        file.unlink()
        raise FileNotFoundError(file)

    monkeypatch.setattr(cache, "_read", gone)
    said = []
    assert scene_visibility(scene, tmp_path, say=said.append) is not None and not said


@pytest.mark.parametrize("stated", ["much", "-1", "nan", "inf"])
def test_a_limit_that_is_no_size_is_refused(stated, monkeypatch):
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, stated)
    with pytest.raises(InputError, match="METAMER_CACHE_GB"):
        cache_limits.most_bytes()


def test_the_limit_is_a_gigabyte_unless_stated(monkeypatch):
    monkeypatch.delenv(cache_limits.LIMIT_VARIABLE, raising=False)
    assert cache_limits.most_bytes() == 10**9
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, "2.5")
    assert cache_limits.most_bytes() == 2_500_000_000
