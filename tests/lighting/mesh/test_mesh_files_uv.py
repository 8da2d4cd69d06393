"""Texture coordinates of mesh files: v upwards and vertices split at seams, whatever the format."""

import json
import struct

import numpy as np
import pytest
import trimesh
from metamer.lighting.mesh.files import load_mesh
from metamer.runtime.errors import UnknownNameError

# Two squares side by side that share an edge in space and not in uv, the right one mirrored.

SQUARES = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]])
SQUARE_UV = np.array([[0.0, 0], [0.5, 0], [0.5, 0.75], [0, 0.75], [1, 0], [0.6, 0], [0.6, 0.25], [1, 0.25]])
# Corner by corner: (place, uv).
CORNERS = [[(0, 0), (1, 1), (2, 2)], [(0, 0), (2, 2), (3, 3)], [(1, 4), (4, 5), (5, 6)], [(1, 4), (5, 6), (2, 7)]]


def split_squares():
    """(vertices, faces, uv) with a vertex for each place and uv."""
    place = np.array([0, 1, 2, 3, 1, 4, 5, 2])
    return SQUARES[place], np.array([[uv for _, uv in face] for face in CORNERS]), SQUARE_UV


def write_squares_obj(path, normals=True):
    lines = [f"v {x} {y} {z}" for x, y, z in SQUARES] + [f"vt {u} {v}" for u, v in SQUARE_UV] + ["vn 0 0 1"]
    end = "/1" if normals else ""
    lines += ["f " + " ".join(f"{place + 1}/{uv + 1}{end}" for place, uv in face) for face in CORNERS]
    path.write_text("\n".join(lines) + "\n")


def write_squares_ply(path, normals=True):
    """uv by triangle, as scanners' programs write them."""
    names = ["x", "y", "z", *(("nx", "ny", "nz") if normals else ())]
    lines = ["ply", "format ascii 1.0", "element vertex 6", *(f"property float {name}" for name in names)]
    lines += ["element face 4", "property list uchar int vertex_indices", "property list uchar float texcoord"]
    lines += ["end_header", *(f"{x} {y} {z}{' 0 0 1' if normals else ''}" for x, y, z in SQUARES)]
    for face in CORNERS:
        uv = " ".join(f"{u} {v}" for u, v in SQUARE_UV[[number for _, number in face]])
        lines.append("3 " + " ".join(str(place) for place, _ in face) + f" 6 {uv}")
    path.write_text("\n".join(lines) + "\n")


def write_squares_gltf(path, material=True, uv_type="<f4", binary=False):
    """Write squares by hand, with v downwards, as the format has it."""
    vertices, faces, uv = split_squares()
    down = uv * [1, -1] + [0, 1]
    stored = down if uv_type == "<f4" else down * 65535
    arrays = [vertices.astype("<f4"), np.tile([0, 0, 1], (8, 1)).astype("<f4"), stored.astype(uv_type),
              faces.astype("<u2")]  # fmt: skip
    starts = np.cumsum([0, *(array.nbytes for array in arrays)])
    component = 5126 if uv_type == "<f4" else 5123
    primitive = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}
    data = b"".join(array.tobytes() for array in arrays)
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "squares", "mesh": 0}],
        "meshes": [{"primitives": [primitive | ({"material": 0} if material else {})]}],
        "buffers": [{"byteLength": len(data)} | ({} if binary else {"uri": "beside.bin"})],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(start), "byteLength": array.nbytes}
            for start, array in zip(starts[:-1], arrays, strict=True)
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [2, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 2, "componentType": component, "count": 8, "type": "VEC2", "normalized": component == 5123},
            {"bufferView": 3, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
    } | ({"materials": [{}]} if material else {})
    if not binary:
        path.write_text(json.dumps(document))
        (path.parent / "beside.bin").write_bytes(data)
        return
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


WRITERS = {
    "squares.obj": write_squares_obj,
    "bare.obj": lambda path: write_squares_obj(path, normals=False),
    "squares.ply": write_squares_ply,
    "bare.ply": lambda path: write_squares_ply(path, normals=False),
    "squares.gltf": write_squares_gltf,
    "squares.glb": lambda path: write_squares_gltf(path, binary=True),
    "no-material.gltf": lambda path: write_squares_gltf(path, material=False),
    "no-material.glb": lambda path: write_squares_gltf(path, material=False, binary=True),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_uv_and_splits_at_seams(name, tmp_path):
    """v upwards from the lower left corner, whatever the file's own way; the second square mirrored."""
    WRITERS[name](tmp_path / name)
    mesh = load_mesh(tmp_path / name)
    assert len(mesh.vertices) == 8
    found = np.concatenate([mesh.vertices[mesh.faces], mesh.uv[mesh.faces]], axis=-1)
    vertices, faces, uv = split_squares()
    expected = np.concatenate([vertices[faces], uv[faces]], axis=-1)
    # In whatever order, and from whichever corner.
    turned = {tuple(np.roll(face, k, axis=0).round(6).ravel()) for face in expected for k in range(3)}
    assert all(tuple(face.round(6).ravel()) in turned for face in found)
    right = mesh.vertices[mesh.faces][..., 0].max(axis=1) > 1
    tangents = mesh.tangents.directions[mesh.tangents.faces]
    np.testing.assert_allclose(tangents[~right], np.broadcast_to([1.0, 0, 0], (2, 3, 3)), atol=1e-6)
    np.testing.assert_allclose(tangents[right], np.broadcast_to([-1.0, 0, 0], (2, 3, 3)), atol=1e-6)
    assert mesh.tangents.handedness.tolist() == np.where(right, -1, 1).tolist()


@pytest.mark.parametrize("suffix", [".obj", ".glb", ".gltf", ".ply"])
def test_uv_that_another_program_wrote_come_back(suffix, tmp_path):
    vertices, faces, uv = split_squares()
    visual = trimesh.visual.TextureVisuals(uv=uv)
    made = trimesh.Trimesh(vertices, faces, vertex_normals=np.tile([0, 0, 1.0], (8, 1)), visual=visual, process=False)
    path = tmp_path / f"squares{suffix}"
    if suffix == ".gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(made)).items():
            (tmp_path / (path.name if name.endswith(".gltf") else name)).write_bytes(data)
    else:
        made.export(path)
    mesh = load_mesh(path)
    by_place = sorted(map(tuple, np.concatenate([mesh.vertices[mesh.faces], mesh.uv[mesh.faces]], axis=-1)
                          .reshape(-1, 5).round(5).tolist()))  # fmt: skip
    expected = np.concatenate([vertices[faces], uv[faces]], axis=-1).reshape(-1, 5).round(5)
    assert by_place == sorted(map(tuple, expected.tolist()))


def test_gltf_uv_in_whole_numbers_are_fractions(tmp_path):
    write_squares_gltf(tmp_path / "packed.gltf", uv_type="<u2")
    mesh = load_mesh(tmp_path / "packed.gltf")
    np.testing.assert_allclose(mesh.uv, SQUARE_UV, atol=1 / 65535)
    assert mesh.notes == ()


def test_an_obj_with_uv_on_some_corners_only_says_that_they_are_left_out(tmp_path):
    path = tmp_path / "some.obj"
    path.write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1//1 2//1 3//1\n"
    )
    mesh = load_mesh(path)
    assert mesh.uv is None
    assert mesh.notes[-1] == "some: not every corner has texture coordinates; they are left out"


def test_a_part_keeps_its_uv_where_others_have_none(tmp_path):
    """The whole file has none then, and says so."""
    path = tmp_path / "two.obj"
    write_squares_obj(path, normals=False)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, "v 0 0 5", "v 1 0 5", "v 0 1 5", "usemtl other", "f 7 8 9", ""]))
    whole = load_mesh(path)
    assert whole.uv is None and whole.notes[-1].endswith("they are left out") and len(whole.part_names) == 2
    with_uv, without = sorted(
        (load_mesh(path, mesh_part=name) for name in whole.part_names), key=lambda mesh: mesh.uv is None
    )
    assert without.uv is None and len(without.faces) == 1
    again = {
        (tuple(place), tuple(uv)) for place, uv in zip(with_uv.vertices.tolist(), with_uv.uv.tolist(), strict=True)
    }
    vertices, _, uv = split_squares()
    assert again == {(tuple(a), tuple(b)) for a, b in zip(vertices.tolist(), uv.tolist(), strict=True)}
    with pytest.raises(UnknownNameError, match="part of the mesh"):
        load_mesh(path, mesh_part="nothing")
