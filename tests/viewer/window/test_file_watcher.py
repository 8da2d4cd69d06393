"""Files that change underneath are told of once."""

import os

import numpy as np
import pytest
from metamer.viewer.window.file_watcher import Watch, files_of_scene

SCENE = """
[[part]]
shape = "sphere"
material = "colorchecker/neutral-5-matte"

[[part]]
mesh = "tri.obj"
name = "tri"

[[light]]
spectrum = "lamp.csv"
"""
MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "tri.obj").write_text(MESH)
    nm = np.arange(380, 781, 10)
    (tmp_path / "lamp.csv").write_text("wavelength_nm,lamp W/nm\n" + "".join(f"{one},{one / 500}\n" for one in nm))
    return tmp_path


def settled(watch):
    """Return what has changed, once it has stopped changing."""
    return (*watch.changed(), *watch.changed())


def test_a_scene_is_watched_with_all_that_it_names(folder):
    assert [one.name for one in files_of_scene(folder / "scene.toml")] == ["scene.toml", "tri.obj", "lamp.csv"]
    (folder / "scene.toml").write_text("= broken")
    assert files_of_scene(folder / "scene.toml") == (folder / "scene.toml",)
    (folder / "scene.toml").write_text('a = "\\u0000"\nb = "' + "x" * 5000 + '"\n')
    assert files_of_scene(folder / "scene.toml") == (folder / "scene.toml",)


def test_a_change_is_told_once_and_only_when_it_has_stopped(folder):
    watch = Watch([folder / "tri.obj", folder / "lamp.csv"])
    assert settled(watch) == ()
    (folder / "tri.obj").write_text(MESH + "# more\n")
    assert watch.changed() == ()
    (folder / "tri.obj").write_text(MESH + "# still more\n")
    assert watch.changed() == ()
    assert watch.changed() == (folder / "tri.obj",) and settled(watch) == ()


def test_a_file_that_is_touched_or_written_alike_has_not_changed(folder):
    watch = Watch([folder / "tri.obj"])
    os.utime(folder / "tri.obj", ns=(1, 1))
    assert settled(watch) == ()
    (folder / "tri.obj").write_text(MESH)
    assert settled(watch) == ()


def test_another_content_of_the_same_size_is_a_change(folder):
    watch = Watch([folder / "tri.obj"])
    (folder / "tri.obj").write_text(MESH.replace("1 2 3", "3 2 1"))
    assert settled(watch) == (folder / "tri.obj",)


def test_a_file_that_goes_or_comes_is_told(folder):
    watch = Watch([folder / "tri.obj", folder / "none"])
    (folder / "tri.obj").rename(folder / "none")
    assert set(settled(watch)) == {folder / "tri.obj", folder / "none"}
