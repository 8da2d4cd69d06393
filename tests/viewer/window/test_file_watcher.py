"""Files that change underneath are read again, and what was good stays while they are not."""

import os
import shutil

import numpy as np
import pytest
from metamer.lighting.scene_file.files import load_scene
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.viewer.window.file_watcher import Reloading, Watch, files_of_materials, files_of_scene

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


def test_a_broken_scene_is_told_and_the_last_good_one_stays(folder):
    path = folder / "scene.toml"
    scene = Reloading(lambda: load_scene(path), lambda _: files_of_scene(path))
    first = scene.good
    assert not scene.poll() and scene.problem is None
    path.write_text(SCENE.replace("sphere", "spehre"))
    scene.poll()
    assert scene.poll() and scene.good is first
    assert "spehre" in scene.problem and "nearest: sphere" in scene.problem
    path.write_text(SCENE.replace("sphere", "cloth"))
    scene.poll()
    assert scene.poll() and scene.problem is None
    assert [part.name for part in scene.good.parts] == ["cloth", "tri"]


def test_a_mesh_that_goes_is_told_and_is_there_again_when_it_comes_back(folder):
    path = folder / "scene.toml"
    scene = Reloading(lambda: load_scene(path), lambda _: files_of_scene(path))
    first = scene.good
    (folder / "tri.obj").rename(folder / "away.obj")
    scene.poll()
    assert scene.poll() and scene.good is first and "tri.obj" in scene.problem
    (folder / "away.obj").rename(folder / "tri.obj")
    scene.poll()
    assert scene.poll() and scene.problem is None


def test_files_that_a_scene_names_anew_are_watched(folder):
    path = folder / "scene.toml"
    scene = Reloading(lambda: load_scene(path), lambda _: files_of_scene(path))
    shutil.copy(folder / "tri.obj", folder / "other.obj")
    path.write_text(SCENE.replace("tri.obj", "other.obj"))
    scene.poll()
    assert scene.poll()
    assert {one.name for one in scene.watch.files} == {"scene.toml", "other.obj", "lamp.csv"}


def test_a_material_that_is_imported_again_is_read_again(tmp_path, write_matt):
    write_matt(tmp_path, "a/red", 0.3)
    catalogue, ids = Catalogue.open(tmp_path), ("a/red",)
    material = Reloading(lambda: catalogue["a/red"], lambda _: files_of_materials(catalogue, ids))
    before = material.good.lab()
    write_matt(tmp_path, "a/red", 0.6)
    material.poll()
    assert material.poll() and material.good.lab()[0] > before[0] + 10.0
    shutil.rmtree(tmp_path / "a")
    material.poll()
    assert material.poll() and "unknown material" in material.problem and material.good.lab()[0] > before[0] + 10.0


def test_what_cannot_be_read_at_first_is_raised(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        Reloading(lambda: load_scene(tmp_path / "none.toml"), lambda _: ())
