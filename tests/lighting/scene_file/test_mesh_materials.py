"""Several materials on one mesh: by the names that the file itself gives to faces."""

import json

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh, load_mesh_by_material
from metamer.lighting.scene_file.files import load_scene
from metamer.runtime.errors import InputError, UnknownNameError

OBJ = """mtllib missing.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl Leather
f 1/1 2/2 3/3
usemtl Top stitch
f 1/1 3/3 4/4
usemtl Leather
f 2/1 5/2 6/3
"""
LEATHER = {(0, 0), (1, 0), (1, 1), (2, 0), (2, 1)}


class Ids:
    def ids(self):
        return ["maps/leather", "maps/stitches", "paint/black"]


def as_gltf(folder, *names):
    """A file with a triangle of each material; None: without one."""
    data = (
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
        + np.array([[0, 1], [1, 1], [0, 0]], "<f4").tobytes()
    )
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    given = [name for name in dict.fromkeys(names) if name]
    primitives = [{"attributes": attributes} | ({"material": given.index(name)} if name else {}) for name in names]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "seat"}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"name": name} for name in given],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "buffers": [{"byteLength": len(data), "uri": "seat.bin"}],
    }
    (folder / "seat.bin").write_bytes(data)
    (folder / "seat.gltf").write_text(json.dumps(document))
    return folder / "seat.gltf"


def scene(folder, table, mesh="seat.obj", catalogue=None):
    path = folder / "scene.toml"
    path.write_text(f'[[part]]\nname = "seat"\nmesh = "{mesh}"\n{table}\n', encoding="utf-8")
    return load_scene(path, catalogue or Ids())


@pytest.fixture
def seat(tmp_path):
    (tmp_path / "seat.obj").write_text(OBJ)
    return tmp_path


@pytest.mark.parametrize("library", [False, True], ids=["without its library", "with its library"])
def test_faces_of_an_obj_go_by_usemtl(seat, library):
    if library:
        (seat / "missing.mtl").write_text("newmtl Leather\nKd 1 0 0\n")
    found = load_mesh_by_material(seat / "seat.obj")
    assert {name: len(mesh.faces) for name, mesh in found.items()} == {"Leather": 2, "Top stitch": 1}
    assert {tuple(xy) for xy in found["Leather"].vertices[:, :2].tolist()} == LEATHER
    whole = load_mesh(seat / "seat.obj")
    assert sum(len(mesh.faces) for mesh in found.values()) == len(whole.faces)
    assert all(mesh.uv is not None for mesh in found.values())


def test_primitives_of_a_gltf_go_by_their_material(tmp_path):
    found = load_mesh_by_material(as_gltf(tmp_path, "Leather", "Top stitch", None, "Leather"))
    assert {name: len(mesh.faces) for name, mesh in found.items()} == {"Leather": 2, "Top stitch": 1, "": 1}


def test_each_wears_what_it_is_given_and_its_texture_lies_as_told(seat):
    table = (
        'uv_scale = 2\n[part.materials]\nLeather = "maps/leather"\n'
        '"Top stitch" = { material = "maps/stitches", uv_scale = [8, 1], uv_rotate_deg = 90 }'
    )
    parts = {part.name: part for part in scene(seat, table).parts}
    assert {name: part.material for name, part in parts.items()} == {
        "seat/Leather": "maps/leather",
        "seat/Top stitch": "maps/stitches",
    }
    assert parts["seat/Leather"].mesh.uv.max() == 2.0
    plain = load_mesh_by_material(seat / "seat.obj")["Top stitch"]
    turned = plain.placed(uv_scale=[8, 1], uv_rotate_deg=90)
    np.testing.assert_array_equal(parts["seat/Top stitch"].mesh.uv, turned.uv)


@pytest.mark.parametrize("kind", ["obj", "gltf"])
def test_the_rest_wears_the_parts_own(seat, kind):
    as_gltf(seat, "Leather", "Top stitch")
    table = 'material = "paint/black"\n[part.materials]\nLeather = "maps/leather"'
    parts = scene(seat, table, f"seat.{kind}").parts
    assert [(part.name, part.material) for part in parts] == [
        ("seat/Leather", "maps/leather"),
        ("seat/Top stitch", "paint/black"),
    ]


def test_faces_without_a_material_keep_the_name_of_the_part(tmp_path):
    as_gltf(tmp_path, "Leather", None)
    table = 'material = "paint/black"\n[part.materials]\nLeather = "maps/leather"'
    assert [part.name for part in scene(tmp_path, table, "seat.gltf").parts] == ["seat/Leather", "seat"]


@pytest.mark.parametrize(
    "table, words",
    [
        ('[part.materials]\nLeather = "maps/leather"', "nothing for 'Top stitch'"),
        ('[part.materials]\nLether = "maps/leather"', "Leather"),
        ('material = "paint/black"\n[part.materials]\nLeather = "maps/lether"', "maps/leather"),
        ('material = "paint/black"\n[part.materials]\nLeather = { uv_scale = 2 }', "material, an id"),
        ('material = "paint/black"\n[part.materials]\nLeather = { materal = "a" }', "material"),
        ('material = "paint/black"\n[part.materials]\nLeather = 3', "table of ids"),
        ('materials = ["maps/leather"]', "a table of ids"),
        ('mesh_part = "x"\nmaterials = { Leather = "maps/leather" }', "mesh_part"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(seat, table, words):
    with pytest.raises(InputError, match=words) as refused:
        scene(seat, table)
    assert "part 1" in str(refused.value) or isinstance(refused.value, UnknownNameError)


def test_a_file_without_materials_and_a_shape_have_none_to_name(tmp_path):
    (tmp_path / "bare.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match="names no materials"):
        scene(tmp_path, 'materials = { Leather = "maps/leather" }', "bare.obj")
    path = tmp_path / "shape.toml"
    for shape, words in (("sphere", "expected: material"), ("patches", "a list of ids")):
        path.write_text(f'[[part]]\nshape = "{shape}"\nmaterials = {{ a = "maps/leather" }}\n')
        with pytest.raises(InputError, match=words):
            load_scene(path, Ids())
