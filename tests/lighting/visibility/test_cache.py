"""Visibility kept on disk: found again, never believed blindly, never left half-written."""

from dataclasses import fields, replace

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import patches, speed_shape, sphere
from metamer.lighting.visibility import cache, precompute
from metamer.lighting.visibility.cache import scene_visibility, visibility_key
from metamer.runtime.errors import NoRoomError


@pytest.fixture(scope="module")
def scene(scene_of):
    return scene_of(speed_shape(2))


@pytest.fixture
def kept(scene, tmp_path):
    folder = tmp_path / "made" / "here"
    return folder, scene_visibility(scene, folder)


def no_work(monkeypatch):
    monkeypatch.setattr(cache, "computed_visibility", lambda *_: pytest.fail("computed again"))


def same(one, other):
    names = [each.name for each in fields(one) if each.name != "refinement"]
    equal = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)
    return equal and np.array_equal(one.refinement.corners, other.refinement.corners)


def test_it_is_read_where_it_was_computed(scene, kept, monkeypatch):
    folder, first = kept
    no_work(monkeypatch)
    assert same(scene_visibility(scene, folder), first)
    assert [file.name for file in folder.iterdir()] == [f"{visibility_key(scene)}.npz"]


def test_the_key_is_that_of_the_geometry_alone(scene):
    key = visibility_key(scene)
    assert visibility_key(scene.with_material("0", "another")) == key
    mesh = scene.parts[0].mesh
    moved = mesh.vertices.copy()
    moved[5, 1] = np.nextafter(moved[5, 1], 9.0)
    for other in (
        Mesh(moved, mesh.normals, mesh.faces),
        Mesh(mesh.vertices, np.roll(mesh.normals, 1, axis=0), mesh.faces),
        Mesh(mesh.vertices, mesh.normals, np.roll(mesh.faces, 1, axis=0)),
    ):
        assert visibility_key(replace(scene, parts=(replace(scene.parts[0], mesh=other),))) != key
    assert visibility_key(replace(scene, parts=(*scene.parts, replace(scene.parts[0], name="twin")))) != key


@pytest.mark.slow_cases("empty", "text", "other arrays")
@pytest.mark.parametrize("damage", ["cut", "empty", "text", "bit", "other arrays"])
def test_a_damaged_file_is_computed_again_and_that_is_said(scene, kept, damage):
    folder, first = kept
    (file,) = folder.iterdir()
    data = bytearray(file.read_bytes())
    if damage == "bit":
        data[len(data) // 2] ^= 16
    file.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "text": b"no such thing"}.get(damage, bytes(data)))
    if damage == "other arrays":
        np.savez(file, codes=np.zeros(3))
    said = []
    assert same(scene_visibility(scene, folder, say=said.append), first)
    assert len(said) == 1 and "damaged" in said[0] and file.name in said[0]
    said.clear()
    assert same(scene_visibility(scene, folder, say=said.append), first) and not said


def test_numbers_changed_in_a_file_that_can_be_read_are_not_believed(scene, kept):
    folder, first = kept
    (file,) = folder.iterdir()
    with np.load(file) as held:
        arrays = dict(held)
    arrays["whole"] = arrays["whole"] + np.int8(1)
    np.savez(file, **arrays)
    said = []
    assert same(scene_visibility(scene, folder, say=said.append), first) and len(said) == 1


@pytest.mark.parametrize("keeps", [True, False])
def test_what_takes_long_is_said_before_the_work(scene, tmp_path, monkeypatch, keeps):
    monkeypatch.setattr(precompute, "SECONDS_A_VERTEX", 1.0)
    said, begun = [], []

    def work(*given):
        begun.append(list(said))

    monkeypatch.setattr(cache, "computed_visibility", work)
    scene_visibility(scene, tmp_path if keeps else None, say=said.append)
    ((line,),) = begun
    assert line.startswith("ambient visibility, once for these meshes: 568 triangles, 286 vertices, ")
    if keeps:
        scene_visibility(scene, tmp_path, say=said.append)
        assert len(said) == 1 and len(begun) == 1


def test_an_interruption_leaves_nothing_half_written(scene, tmp_path):
    def stop(done, total, what):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        scene_visibility(scene, tmp_path, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_nothing_half_written(scene, tmp_path, room_for):
    with room_for(10_000), pytest.raises(NoRoomError):
        scene_visibility(scene, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_that_nothing_hides_anything_is_kept_too(scene_of, tmp_path, monkeypatch):
    flat = scene_of(*patches(2))
    assert scene_visibility(flat, tmp_path) is None and len(list(tmp_path.iterdir())) == 1
    no_work(monkeypatch)
    assert scene_visibility(flat, tmp_path) is None


def test_a_convex_body_is_not_even_looked_up(scene_of, tmp_path):
    assert scene_visibility(scene_of(sphere(2)), tmp_path / "never made") is None
    assert not (tmp_path / "never made").exists()


def test_without_a_folder_nothing_is_kept(scene, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert scene_visibility(scene) is not None and list(tmp_path.iterdir()) == []
