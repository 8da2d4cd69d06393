import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from metamer.lighting.mesh.files import cleaned_mesh, load_mesh
from metamer.lighting.mesh.shapes import _grid
from metamer.runtime.errors import InputError

CUBE = trimesh.creation.box()


@pytest.fixture
def cube(tmp_path):
    def write(suffix):
        path = tmp_path / f"cube{suffix}"
        CUBE.export(path)
        return path

    return write


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".gltf"])
def test_a_cube_of_every_format_stays_faceted(suffix, tmp_path, watertight):
    bare = trimesh.Trimesh(CUBE.vertices, CUBE.faces, process=False)
    path = tmp_path / f"cube{suffix}"
    if suffix == ".gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(bare)).items():
            (tmp_path / (path.name if name.endswith(".gltf") else name)).write_bytes(data)
    else:
        bare.export(path)
    mesh = load_mesh(path)
    assert len(mesh.faces) == 12
    assert watertight(mesh)
    # Every vertex normal is that of its flat side: a right angle is a crease.
    corner_normals = mesh.normals[mesh.faces]
    np.testing.assert_allclose(
        corner_normals, np.broadcast_to(mesh.face_normals[:, None], corner_normals.shape), atol=1e-12
    )
    assert any("no normals in the file" in note for note in mesh.notes)


def test_missing_normals_of_a_smooth_shape_are_smooth():
    ball = trimesh.creation.icosphere(subdivisions=3)
    mesh = cleaned_mesh(ball.vertices, ball.faces)
    assert len(mesh.vertices) == len(ball.vertices)
    assert np.einsum("ij,ij->i", mesh.normals, mesh.vertices).min() > 0.9999
    assert mesh.notes == ("mesh: no normals in the file; computed, creased at 40 degrees",)


def test_a_mesh_of_many_vertices_keeps_every_one_where_it_was():
    """Numbers of vertices times numbers of smooth groups leave 32 bits behind at some 46,000 of each."""
    uv, faces = _grid(230, 230)
    vertices = np.c_[uv, np.sin(9.0 * uv[:, 0])]
    mesh = cleaned_mesh(vertices, faces)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[faces])
    assert len(mesh.vertices) == len(vertices)
    assert np.einsum("fki,fi->fk", mesh.normals[mesh.faces], mesh.face_normals).min() > 0.9


def test_a_cylinder_is_smooth_around_and_creased_at_its_rim():
    can = trimesh.creation.cylinder(radius=1, height=2, sections=64)
    mesh = cleaned_mesh(can.vertices, can.faces)
    side = np.abs(mesh.face_normals[:, 2]) < 0.5
    assert np.abs(mesh.normals[mesh.faces[side]][..., 2]).max() < 1e-12
    assert np.abs(mesh.normals[mesh.faces[~side]][..., 2]).min() > 1 - 1e-12
    radial = mesh.vertices[mesh.faces[side]] * [1, 1, 0]
    assert np.einsum("fki,fki->fk", mesh.normals[mesh.faces[side]], radial).min() > 0.998


def test_normals_do_not_depend_on_how_a_square_is_cut():
    corners = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    hull = trimesh.Trimesh(corners, CUBE.faces, process=False)
    mesh = cleaned_mesh(hull.vertices, hull.faces, crease_deg=180)
    np.testing.assert_allclose(np.abs(mesh.normals), np.full((8, 3), 3**-0.5), atol=1e-12)


def test_normals_of_the_file_are_kept(tmp_path):
    path = tmp_path / "tilted.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\n")
    mesh = load_mesh(path)
    np.testing.assert_allclose(mesh.normals, np.tile([0.6, 0, 0.8], (3, 1)), atol=1e-12)
    assert mesh.notes == ()


def test_triangles_that_wind_against_their_normals_are_turned_and_noted():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    mesh = cleaned_mesh(square, [[0, 1, 2], [0, 3, 2]], np.tile([0, 0, 1.0], (4, 1)))
    assert (mesh.face_normals[:, 2] == 1).all()
    assert mesh.notes == ("mesh: turned 1 triangles that wind against their normals",)


def test_degenerate_triangles_are_dropped_and_noted(tmp_path):
    path = tmp_path / "thin.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 2\nf 1 2 4\n")
    mesh = load_mesh(path)
    assert len(mesh.faces) == 1
    assert mesh.notes[0] == "thin: dropped 2 of 3 triangles, which have no area"


def test_a_mesh_of_only_degenerate_triangles_is_an_error(tmp_path):
    path = tmp_path / "line.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"(?s)line\.obj.*every triangle is degenerate.*1 triangles"):
        load_mesh(path)


def test_zero_normals_are_computed_anew_and_noted():
    mesh = cleaned_mesh(CUBE.vertices, CUBE.faces, np.zeros_like(CUBE.vertices))
    assert "8 normals are zero or not finite; all are computed anew" in mesh.notes[0]


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"(?s)nowhere\.obj: no such mesh file"):
        load_mesh(tmp_path / "nowhere.obj")


def test_another_format_is_refused_with_those_that_are_read(tmp_path):
    path = tmp_path / "part.step"
    path.write_text("ISO-10303-21;")
    with pytest.raises(InputError, match=r"(?s)found: \.step.*\.obj, \.ply, \.stl, \.off, \.gltf, \.glb"):
        load_mesh(path)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".glb", ".gltf"])
@pytest.mark.parametrize("content", [b"", b"\x00\x01garbage\xff" * 9], ids=["empty", "garbage"])
def test_a_file_of_nothing_or_noise_is_an_input_error(suffix, content, tmp_path):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert f"bad{suffix}" in str(caught.value)


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".glb"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_truncated_binary_file_is_an_input_error(suffix, share, cube):
    path = cube(suffix)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(InputError, match=f"cube{suffix}"):
        load_mesh(path)


@pytest.mark.parametrize("lines", [1, 5, 12, 19])
def test_a_truncated_text_ply_is_an_input_error(lines, tmp_path):
    path = tmp_path / "cube.ply"
    CUBE.export(path, encoding="ascii")
    header, _, body = path.read_text().partition("end_header\n")
    path.write_text(header + "end_header\n" + "".join(body.splitlines(keepends=True)[:lines]))
    with pytest.raises(InputError, match=rf"(?s)cube\.ply: the mesh file is cut short.*{lines} lines.*20 lines"):
        load_mesh(path)


def test_an_obj_cut_inside_its_faces_or_vertices_is_an_input_error(tmp_path):
    path = tmp_path / "cut.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n")
    with pytest.raises(InputError, match=r"cut\.obj"):
        load_mesh(path)


def test_vertices_that_are_not_numbers_are_an_error(tmp_path):
    path = tmp_path / "hole.obj"
    path.write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"(?s)hole\.obj.*not finite"):
        load_mesh(path)


def test_a_glb_with_a_bad_buffer_is_an_input_error(tmp_path):
    document = {"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 5}}]}]}
    body = json.dumps(document).encode().ljust(200)
    path = tmp_path / "hollow.glb"
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 20 + len(body)) + struct.pack("<I4s", len(body), b"JSON") + body)
    with pytest.raises(InputError, match=r"hollow\.glb"):
        load_mesh(path)


def test_parts_of_a_scene_graph_are_placed_and_keep_their_names(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(CUBE, node_name="low", transform=trimesh.transformations.translation_matrix([0, -2, 0]))
    scene.add_geometry(CUBE, node_name="high", transform=trimesh.transformations.translation_matrix([0, 3, 0]))
    path = tmp_path / "two.glb"
    scene.export(path)
    mesh = load_mesh(path)
    assert sorted(mesh.part_names) == ["high", "low"]
    assert mesh.part("high").bounds[0][1] == pytest.approx(2.5)
    assert mesh.part("low").bounds[1][1] == pytest.approx(-1.5)


def test_real_meshes_load(shared_data):
    ball = load_mesh(shared_data / "meshes" / "shaderball.glb")
    assert set(ball.part_names) == {"Preview_Mesh", "Calibration_Mesh"}
    assert len(ball.faces) == 88264
    assert ball.notes == ()
    cow = load_mesh(shared_data / "meshes" / "spot.obj")
    assert cow.uv is not None
    assert len(cow.faces) == 5856


def gltf_of(tmp_path, nodes, meshes):
    """A glTF file with one triangle, as bytes in the document, that `meshes` may use as accessors 0 and 1."""
    data = np.eye(3, dtype=np.float32).tobytes() + np.arange(3, dtype=np.uint16).tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": primitives} for primitives in meshes],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
    }
    path = tmp_path / "body.gltf"
    path.write_text(json.dumps(document))
    return path


TRIANGLE = {"attributes": {"POSITION": 0}, "indices": 1}


def test_primitives_of_one_gltf_mesh_have_names_that_stay(tmp_path):
    path = gltf_of(tmp_path, [{"name": "door", "mesh": 0}, {"name": "roof", "mesh": 1}], [[TRIANGLE] * 2, [TRIANGLE]])
    for _ in range(2):
        assert load_mesh(path).part_names == ("door/1", "door/2", "roof")


def test_one_gltf_mesh_in_many_places_is_many_parts(tmp_path):
    nodes = [
        {"name": "left", "mesh": 0, "translation": [-5, 0, 0]},
        {"name": "right", "mesh": 0, "translation": [5, 0, 0], "scale": [-1, 1, 1]},
    ]
    mesh = load_mesh(gltf_of(tmp_path, nodes, [[TRIANGLE]]))
    assert mesh.part_names == ("left", "right")
    np.testing.assert_allclose(mesh.part("left").bounds, ([-5, 0, 0], [-4, 1, 1]))
    np.testing.assert_allclose(mesh.part("right").bounds, ([4, 0, 0], [5, 1, 1]))
    flat = np.einsum("fi,fki->fk", mesh.face_normals, mesh.normals[mesh.faces])
    np.testing.assert_allclose(flat, 1.0, err_msg="a mirrored part turned inside out")


def test_lines_beside_triangles_are_left_out_and_said(tmp_path):
    nodes = [{"name": "solid", "mesh": 0}, {"name": "wire", "mesh": 1}]
    mesh = load_mesh(gltf_of(tmp_path, nodes, [[TRIANGLE], [{**TRIANGLE, "mode": 1}]]))
    assert mesh.part_names == ("solid",)
    assert mesh.notes[-1] == "wire: left out, it holds lines or points and no triangles"


def test_an_obj_with_latin_comments_loads(tmp_path):
    path = tmp_path / "latin.obj"
    path.write_bytes("# Körper\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode("latin-1"))
    assert len(load_mesh(path).faces) == 1


TEXTS = {
    "a.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "a.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "a.ply": "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\n",
    "a.stl": "solid a\n\tfacet normal 0 0 1\n",
    "a.gltf": '{"asset": {"version": "2.0"}}',
}


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", TEXTS)
def test_a_text_of_two_bytes_a_character_is_called_so(tmp_path, name, encoding):
    path = tmp_path / name
    path.write_bytes(TEXTS[name].encode(encoding))
    with pytest.raises(InputError, match="UTF-16") as caught:
        load_mesh(path)
    assert caught.value.file == path and "UTF-8" in caught.value.hint


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
@pytest.mark.parametrize("place", ["coordinate", "index"])
def test_digits_with_an_underscore_between_them_are_no_number(tmp_path, suffix, place):
    """They are one to Python: 2_0 would be drawn at 20."""
    x, last = ("2_0", "2") if place == "coordinate" else ("2", "0_2")
    ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    texts = {
        ".obj": f"v 0 0 0\nv {x} 0 0\nv 0 1 0\nf 1 2 {last.replace('2', '3')}\n",
        ".off": f"OFF\n3 1 0\n0 0 0\n{x} 0 0\n0 1 0\n3 0 1 {last}\n",
        ".ply": f"{ply}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        f"0 0 0\n{x} 0 0\n0 1 0\n3 0 1 {last}\n",
    }
    path = tmp_path / f"a{suffix}"
    path.write_text(texts[suffix])
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert "_" in str(caught.value)
    path.write_text(texts[suffix].replace("2_0", "20").replace("0_", ""))
    assert len(load_mesh(path).faces) == 1
