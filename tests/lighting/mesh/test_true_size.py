"""Textures of a stated size on meshes."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.mesh.true_size import uv_lengths
from metamer.lighting.scene_file.files import load_scene
from metamer.runtime.errors import InputError


def spans(mesh):
    return np.ptp(mesh.uv, axis=0)


def test_a_plane_holds_as_many_repeats_as_fit():
    placed = plane(2.0, 1.0).placed(uv_size_mm=100)
    np.testing.assert_allclose(spans(placed), (20.0, 10.0), rtol=1e-9)
    assert not placed.notes


def test_a_texture_may_be_wider_than_it_is_high():
    np.testing.assert_allclose(spans(plane(2.0, 1.0).placed(uv_size_mm=[100, 50])), (20.0, 20.0), rtol=1e-9)


def test_the_size_is_that_on_the_placed_mesh():
    placed = plane(1.0, 1.0).placed(scale=3, rotate_deg=(20, 30, 40), translate=(1, 2, 3), uv_size_mm=250)
    np.testing.assert_allclose(spans(placed), (12.0, 12.0), rtol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 217.0])
def test_a_turned_texture_keeps_its_size(angle):
    """Of a square centimetre of the mesh, uv span as much, whichever way they lie, and where uv are stretched too."""
    mesh = plane(2.0, 0.5).placed(uv_rotate_deg=angle, uv_size_mm=10)
    corners, uv = mesh.vertices[mesh.faces], mesh.uv[mesh.faces]
    found = uv_lengths(corners, uv, "plane")
    np.testing.assert_allclose(found.mean, (0.01, 0.01), rtol=1e-9)


def test_where_uv_are_uneven_it_is_said():
    placed = sphere(3, uv=True).placed(uv_size_mm=50)
    (said,) = [note for note in placed.notes if "on average" in note]
    assert "along u" in said and "along v" in said
    corners, uv = placed.vertices[placed.faces], placed.uv[placed.faces]
    np.testing.assert_allclose(uv_lengths(corners, uv, "ball").mean, (0.05, 0.05), rtol=1e-9)


def test_mirrored_halves_have_one_size():
    """Triangles whose u runs the other way are as long."""
    flat = plane(1.0, 1.0)
    mirrored = Mesh(flat.vertices, flat.normals, flat.faces, flat.uv * (-1.0, 1.0))
    np.testing.assert_allclose(spans(mirrored.placed(uv_size_mm=100)), (10.0, 10.0), rtol=1e-9)


@pytest.mark.parametrize(
    "more", [{"uv_size_mm": 0}, {"uv_size_mm": -3}, {"uv_size_mm": float("nan")}, {"uv_size_mm": 10, "uv_scale": 2}]
)
def test_what_is_no_size_is_refused(more):
    with pytest.raises(InputError, match="not a size of a texture"):
        plane(1.0, 1.0).placed(**more)


def test_uv_without_extent_are_refused():
    flat = plane(1.0, 1.0)
    with pytest.raises(InputError, match="without extent"):
        Mesh(flat.vertices, flat.normals, flat.faces, np.zeros_like(flat.uv)).placed(uv_size_mm=10)
    with pytest.raises(InputError, match="no texture coordinates"):
        Mesh(flat.vertices, flat.normals, flat.faces).placed(uv_size_mm=10)


def test_scene_files_have_it(tmp_path):
    (tmp_path / "one.toml").write_text('[[part]]\nshape = "plane"\nwidth = 3\ndepth = 2\nuv_size_mm = 200\n')
    scene = load_scene(tmp_path / "one.toml")
    np.testing.assert_allclose(spans(scene.parts[0].mesh), (15.0, 10.0), rtol=1e-9)
    for wrong in ("0", '"wide"', "[100, -5]"):
        (tmp_path / "one.toml").write_text(f'[[part]]\nshape = "plane"\nuv_size_mm = {wrong}\n')
        with pytest.raises(InputError, match="uv_size_mm"):
            load_scene(tmp_path / "one.toml")


def test_a_piece_of_a_mesh_has_its_own(tmp_path):
    (tmp_path / "one.obj").write_text(
        "mtllib one.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "usemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 2/1 5/2 6/3 3/4\n"
    )
    (tmp_path / "one.mtl").write_text("newmtl a\nnewmtl b\n")
    (tmp_path / "one.toml").write_text(
        '[[part]]\nmesh = "one.obj"\nuv_scale = 3\n'
        'materials = { a = "x/a", b = { material = "x/b", uv_size_mm = 100 } }\n'
    )
    found = {part.name.rpartition("/")[2]: spans(part.mesh) for part in load_scene(tmp_path / "one.toml").parts}
    np.testing.assert_allclose(found["a"], 3.0, rtol=1e-9)
    np.testing.assert_allclose(found["b"], 10.0, rtol=1e-9)
