"""glTF files: numbers of every type, triangles of every mode, poses, places and instances, and what is refused."""

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh
from metamer.runtime.errors import InputError

from .gltf_files import FACES, POINTS, Gltf, area, volume

# Area of the tetrahedron: three right triangles and one whose sides are cut off at 1, 1.5 and 2.
AREA = 0.5 * (1 * 1.5 + 1 * 2 + 1.5 * 2) + 0.5 * np.sqrt((1.5 * 2) ** 2 + (1 * 2) ** 2 + (1 * 1.5) ** 2)
FRACTIONS = POINTS / 2.0
SUFFIXES = pytest.mark.parametrize("suffix", [".gltf", ".glb"])
BODY_NOTE = "body: no normals in the file; computed, creased at 40 degrees"


def read(gltf, tmp_path, suffix=".gltf"):
    return load_mesh(gltf.write(tmp_path / f"made{suffix}"))


def corners(mesh):
    """Triangles from their least corner on, sorted."""
    faces = (mesh.vertices[mesh.faces].round(6) + 0.0).tolist()
    return sorted(min(face[k:] + face[:k] for k in range(3)) for face in faces)


def assert_is_tetrahedron(mesh, scale=1.0, tolerance=1e-6):
    np.testing.assert_allclose(mesh.bounds, ([0, 0, 0], np.multiply(scale, [1, 1.5, 2])), atol=tolerance)
    assert volume(mesh) == pytest.approx(0.5 * scale**3, abs=3 * tolerance)
    assert area(mesh) == pytest.approx(AREA * scale**2, abs=9 * tolerance)


@SUFFIXES
@pytest.mark.parametrize("pad", [0, 1, 4])
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2"])
def test_positions_of_whole_numbers_that_are_fractions(kind, pad, suffix, tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", "scale": [2, 2, 2]}])
    gltf.primitive({"POSITION": gltf.accessor(FRACTIONS, kind, True, pad)}, gltf.accessor(FACES.reshape(-1), "u1"))
    assert_is_tetrahedron(read(gltf, tmp_path, suffix), tolerance=2.0 / np.iinfo(kind).max)


@pytest.mark.parametrize("pad", [0, 2])
@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2"])
def test_positions_of_whole_numbers_are_what_they_are(kind, pad, tmp_path):
    gltf = Gltf(
        nodes=[{"mesh": 0, "name": "body", "scale": [0.5, 0.5, 0.5]}], extensionsRequired=["KHR_mesh_quantization"]
    )
    gltf.primitive({"POSITION": gltf.accessor(2 * POINTS, kind, pad=pad)}, gltf.accessor(FACES.reshape(-1), "u1"))
    assert_is_tetrahedron(read(gltf, tmp_path))


@pytest.mark.parametrize("kind", ["i1", "i2"])
def test_the_least_whole_number_is_minus_one(kind, tmp_path):
    """Both -128 and -127 of 8 bits stand for -1."""
    gltf = Gltf()
    least = np.iinfo(kind).min
    points = gltf.accessor(np.array([[least, 0, 0], [least + 1, least, 0], [0, 0, 0]]), kind)
    gltf.document["accessors"][points]["normalized"] = True
    gltf.primitive({"POSITION": points})
    assert read(gltf, tmp_path).bounds[0].tolist() == [-1.0, -1.0, 0.0]


@pytest.mark.parametrize("indices", ["u1", "u2", "u4", None])
def test_indices_of_every_type_and_none(indices, tmp_path):
    gltf = Gltf()
    if indices is None:
        gltf.primitive({"POSITION": gltf.accessor(POINTS[FACES.reshape(-1)])})
    else:
        gltf.primitive({"POSITION": gltf.accessor(POINTS)}, gltf.accessor(FACES.reshape(-1), indices))
    mesh = read(gltf, tmp_path)
    assert_is_tetrahedron(mesh)
    assert mesh.notes == (BODY_NOTE,)


UV = np.array([[0.25, 0.0], [0.75, 0.0], [0.25, 0.5], [1.0, 1.0]])


@pytest.mark.parametrize("material", [False, True], ids=["bare", "with a material"])
@pytest.mark.parametrize("pad", [0, 2])
@pytest.mark.parametrize("kind", ["f4", "u1", "u2", "i1", "i2"])
def test_texture_coordinates_of_every_type(kind, pad, material, tmp_path):
    gltf = Gltf(materials=[{}]) if material else Gltf()
    place = gltf.accessor(POINTS)
    uv = gltf.accessor(UV * [1, -1] + [0, 1], kind, kind != "f4", pad)
    more = {"material": 0} if material else {}
    gltf.primitive({"POSITION": place, "TEXCOORD_0": uv}, gltf.accessor(FACES.reshape(-1), "u1"), **more)
    mesh = read(gltf, tmp_path)
    of = {tuple(point): told for point, told in zip(POINTS.tolist(), UV, strict=True)}
    expected = np.array([of[tuple(point)] for point in mesh.vertices.tolist()])
    tolerance = 1e-7 if kind == "f4" else 1.0 / np.iinfo(kind).max
    np.testing.assert_allclose(mesh.uv, expected, atol=tolerance)


def test_texture_coordinates_of_whole_numbers_are_what_they_are(tmp_path):
    gltf = Gltf(extensionsRequired=["KHR_mesh_quantization"])
    uv = gltf.accessor(np.array([[0, 1], [3, 1], [0, -2]]), "i2")
    gltf.primitive({"POSITION": gltf.accessor(POINTS[:3]), "TEXCOORD_0": uv})
    assert read(gltf, tmp_path).uv.tolist() == [[0, 0], [3, 0], [0, 3]]


@pytest.mark.parametrize("pad", [0, 1])
@pytest.mark.parametrize("kind", ["f4", "i1", "i2"])
def test_normals_of_every_type(kind, pad, tmp_path):
    gltf = Gltf()
    tilted = np.tile([0.6, 0.0, 0.8], (3, 1))
    normals = gltf.accessor(tilted, kind, kind != "f4", pad)
    gltf.primitive({"POSITION": gltf.accessor(POINTS[:3]), "NORMAL": normals})
    mesh = read(gltf, tmp_path)
    tolerance = 1e-7 if kind == "f4" else 1.0 / np.iinfo(kind).max
    np.testing.assert_allclose(mesh.normals, tilted, atol=tolerance)
    assert mesh.notes == ()


@SUFFIXES
def test_attributes_that_take_turns_in_one_view(suffix, tmp_path):
    gltf = Gltf()
    normals = np.array([[0.0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]])
    rows = np.concatenate([POINTS[:3], normals, UV[:3]], axis=1).astype("<f4")
    view = gltf.view(b"".join(row.tobytes() + b"\xff" * 8 for row in rows), 40)
    for offset, kind in ((0, "VEC3"), (12, "VEC3"), (24, "VEC2")):
        told = {"bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 3, "type": kind}
        gltf.document["accessors"].append(told)
    gltf.primitive({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2})
    mesh = read(gltf, tmp_path, suffix)
    np.testing.assert_allclose(mesh.vertices, POINTS[:3])
    np.testing.assert_allclose(mesh.normals, normals, atol=1e-7)
    np.testing.assert_allclose(mesh.uv, UV[:3] * [1, -1] + [0, 1])


@SUFFIXES
@pytest.mark.parametrize("where", ["u1", "u2", "u4"])
@pytest.mark.parametrize("base", ["a view", "a view with a stride", "none"])
def test_sparse_positions(base, where, suffix, tmp_path):
    gltf = Gltf()
    moved = ([1, 3], where, [[1.0, 0, 0], [0, 0, 4]]) if base != "none" else ([1, 2, 3], where, POINTS[1:] * [1, 1, 2])
    pad = 4 if base.endswith("stride") else 0
    place = gltf.accessor(POINTS, pad=pad, sparse=moved, empty=base == "none")
    gltf.primitive({"POSITION": place}, gltf.accessor(FACES.reshape(-1), "u1"))
    mesh = read(gltf, tmp_path, suffix)
    assert mesh.bounds[1].tolist() == [1.0, 1.5, 4.0]
    assert volume(mesh) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["f4", "u2"])
def test_sparse_texture_coordinates_normals_and_indices(kind, tmp_path):
    gltf = Gltf()
    uv = gltf.accessor(UV[:3], kind, kind != "f4", sparse=([2], "u1", [[0.5, 0.25]]))
    normals = gltf.accessor(np.tile([0, 0, 1.0], (3, 1)), sparse=([0], "u2", [[0.6, 0, 0.8]]))
    indices = gltf.accessor(np.array([0, 0, 2]), "u2", sparse=([1], "u1", [1]))
    gltf.primitive({"POSITION": gltf.accessor(POINTS[:3]), "NORMAL": normals, "TEXCOORD_0": uv}, indices)
    mesh = read(gltf, tmp_path)
    np.testing.assert_allclose(mesh.uv[2], [0.5, 0.75], atol=2e-5)
    np.testing.assert_allclose(mesh.normals, [[0.6, 0, 0.8], [0, 0, 1], [0, 0, 1]], atol=1e-7)


def band(count):
    """Points of a level strip along x, from both sides by turns, whose triangles look up to +z."""
    k = np.arange(count)
    return np.stack([k // 2 + 0.0, k % 2 + 0.0, 0.0 * k], axis=1) * [1, -1, 1]


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize("count", [3, 4, 5, 6, 9])
def test_triangles_of_a_strip_all_look_the_same_way(count, indexed, tmp_path):
    gltf = Gltf()
    points = band(count)
    order = np.arange(count)[::-1] if indexed else np.arange(count)
    told = gltf.accessor(points[order])
    gltf.primitive({"POSITION": told}, gltf.accessor(np.argsort(order), "u2") if indexed else None, mode=5)
    mesh = read(gltf, tmp_path)
    a, b, c = points[0], points[1], points[2]
    up = np.cross(b - a, c - a)
    assert len(mesh.faces) == count - 2
    np.testing.assert_allclose(mesh.face_normals, np.tile(up / np.linalg.norm(up), (count - 2, 1)), atol=1e-12)
    assert area(mesh) == pytest.approx(0.5 * (count - 2))
    assert mesh.notes == (BODY_NOTE,)


def test_strips_that_are_joined_by_repeated_vertices(tmp_path):
    gltf = Gltf()
    points = np.concatenate([band(4), band(4) + np.array([10.0, 0, 0])])
    gltf.primitive(
        {"POSITION": gltf.accessor(points)}, gltf.accessor(np.array([0, 1, 2, 3, 3, 4, 4, 5, 6, 7]), "u1"), mode=5
    )
    mesh = read(gltf, tmp_path)
    assert len(mesh.faces) == 4 and area(mesh) == pytest.approx(2.0)
    assert np.ptp(mesh.face_normals[:, 2]) == 0.0
    assert mesh.notes == (BODY_NOTE,)


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize("count", [3, 4, 7])
def test_triangles_of_a_fan(count, indexed, tmp_path):
    gltf = Gltf()
    angle = np.linspace(0, np.pi / 2, count - 1)
    points = np.concatenate([[[0.0, 0, 0]], np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    indices = gltf.accessor(np.arange(count), "u1") if indexed else None
    gltf.primitive({"POSITION": gltf.accessor(points)}, indices, mode=6)
    mesh = read(gltf, tmp_path)
    assert len(mesh.faces) == count - 2
    assert area(mesh) == pytest.approx(0.5 * (count - 2) * np.sin(np.pi / 2 / (count - 2)), rel=1e-6)
    assert (mesh.face_normals[:, 2] > 0.999).all()


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_points_and_lines_are_left_out_and_said_and_alone_refused(mode, tmp_path):
    gltf = Gltf()
    gltf.tetrahedron(mode=mode)
    with pytest.raises(InputError, match=r"(?s)the mesh is empty.*holds lines or points"):
        read(gltf, tmp_path)
    gltf.tetrahedron()
    mesh = read(gltf, tmp_path)
    assert mesh.part_names == ("body/2",) and mesh.notes[-1].startswith("body/1: left out, it holds lines or points")


def test_an_unknown_mode_is_refused(tmp_path):
    gltf = Gltf()
    gltf.tetrahedron(mode=7)
    with pytest.raises(InputError, match="mode: an unknown kind of primitive"):
        read(gltf, tmp_path)


MORPHS = {
    "weights of the mesh": ({"weights": [1.0]}, {}, 1.0),
    "half of it": ({"weights": [0.5]}, {}, 0.5),
    "backwards": ({"weights": [-0.25]}, {}, -0.25),
    "weights of the node": ({}, {"weights": [1.0]}, 1.0),
    "the node's before the mesh's": ({"weights": [1.0]}, {"weights": [0.25]}, 0.25),
    "none of the node's before the mesh's": ({"weights": [1.0]}, {"weights": [0.0]}, 0.0),
    "an empty list of the node's": ({"weights": [1.0]}, {"weights": []}, 1.0),
    "no weights": ({}, {}, 0.0),
}


@pytest.mark.parametrize("kind", ["f4", "i1", "i2", "sparse"])
@pytest.mark.parametrize("case", MORPHS)
def test_morph_targets_are_added_by_their_weights(case, kind, tmp_path):
    mesh, node, weight = MORPHS[case]
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body"} | node], meshes=[{"primitives": []} | mesh])
    if kind == "sparse":
        # Without a view: what is not said moves by nothing.
        target = gltf.accessor(POINTS, sparse=([1, 2, 3], "u1", POINTS[1:]), empty=True)
    else:
        target = gltf.accessor(POINTS if kind == "f4" else POINTS / 2, kind, kind != "f4")
    gltf.tetrahedron(targets=[{"POSITION": target}])
    mesh = read(gltf, tmp_path)
    scale = 1 + weight * (0.5 if kind in ("i1", "i2") else 1.0)
    assert_is_tetrahedron(mesh, scale, tolerance=0.01 if kind == "i1" else 1e-4)
    assert any("morphed by the weights of the file" in note for note in mesh.notes) == (weight != 0.0)


def test_several_targets_and_their_normals(tmp_path):
    gltf = Gltf(meshes=[{"primitives": [], "weights": [1.0, 0.5, 0.0]}])
    up = np.tile([0, 0, 1.0], (3, 1))
    targets = [
        {
            "POSITION": gltf.accessor(np.tile([0, 0, 3.0], (3, 1))),
            "NORMAL": gltf.accessor(np.tile([0.75, 0, 0], (3, 1))),
        },
        {"POSITION": gltf.accessor(np.tile([4.0, 0, 0], (3, 1)))},
        {"POSITION": gltf.accessor(np.tile([0, 99.0, 0], (3, 1)))},
    ]
    gltf.primitive({"POSITION": gltf.accessor(POINTS[:3]), "NORMAL": gltf.accessor(up)}, targets=targets)
    mesh = read(gltf, tmp_path)
    np.testing.assert_allclose(mesh.vertices, POINTS[:3] + np.array([2, 0, 3]))
    np.testing.assert_allclose(mesh.normals, np.tile([0.6, 0, 0.8], (3, 1)), atol=1e-7)


def test_weights_of_another_count_than_targets_are_refused(tmp_path):
    gltf = Gltf(meshes=[{"primitives": [], "weights": [1.0, 1.0]}])
    gltf.tetrahedron(targets=[{"POSITION": 0}])
    with pytest.raises(InputError, match="weights of another count"):
        read(gltf, tmp_path)


def instanced(gltf, **attributes):
    gltf.document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    gltf.document["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]


@SUFFIXES
def test_instances_stand_at_all_their_places(suffix, tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", "translation": [100, 0, 0], "scale": [2, 2, 2]}])
    gltf.tetrahedron()
    instanced(gltf, TRANSLATION=gltf.accessor(np.array([[0, 0, 0], [5, 0, 0], [0, 7.0, 0]])))
    mesh = read(gltf, tmp_path, suffix)
    assert len(mesh.faces) == 12 and mesh.part_names == ("body",)
    np.testing.assert_allclose(mesh.bounds, ([100, 0, 0], [112, 17, 4]))
    assert area(mesh) == pytest.approx(3 * 4 * AREA)
    assert volume(mesh) == pytest.approx(3 * 8 * 0.5)


@pytest.mark.parametrize("kind", ["f4", "i1", "i2"])
def test_instances_are_turned_scaled_and_mirrored(kind, tmp_path):
    gltf = Gltf()
    normals = np.tile([0, 0.6, 0.8], (4, 1))
    place, told = gltf.accessor(POINTS), gltf.accessor(normals)
    gltf.primitive({"POSITION": place, "NORMAL": told}, gltf.accessor(FACES[:1].reshape(-1), "u1"))
    half = np.sqrt(0.5)
    instanced(
        gltf,
        TRANSLATION=gltf.accessor(np.array([[0, 0, 0], [10, 0, 0.0]])),
        ROTATION=gltf.accessor(np.array([[0, 0, 0, 1], [half, 0, 0, half]]), kind, kind != "f4"),
        SCALE=gltf.accessor(np.array([[1, 1, 1], [-2, 1, 1.0]])),
    )
    mesh = read(gltf, tmp_path)
    second = mesh.vertices[:, 0] > 5.0
    # Mirrored and doubled along x, then a quarter turn about x: y to z and z to -y.
    np.testing.assert_allclose(mesh.vertices[second].max(axis=0), [10, 0, 1.5], atol=0.02)
    np.testing.assert_allclose(mesh.vertices[second].min(axis=0), [8, 0, 0], atol=0.02)
    np.testing.assert_allclose(mesh.normals[second], np.tile([0, -0.8, 0.6], (3, 1)), atol=0.02)
    assert np.einsum("fi,fki->fk", mesh.face_normals, mesh.normals[mesh.faces]).min() > 0.5


def test_instances_of_unlike_counts_are_refused(tmp_path):
    gltf = Gltf()
    gltf.tetrahedron()
    instanced(gltf, TRANSLATION=gltf.accessor(np.zeros((2, 3))), SCALE=gltf.accessor(np.ones((3, 3))))
    with pytest.raises(InputError, match="instances of unlike counts"):
        read(gltf, tmp_path)


@SUFFIXES
@pytest.mark.parametrize(
    "name",
    ["VENDOR_secret_geometry", "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_gaussian_splatting", "X"],
)
def test_an_extension_that_a_file_needs_and_that_is_not_read_is_refused_by_name(name, suffix, tmp_path):
    gltf = Gltf(extensionsUsed=[name], extensionsRequired=["KHR_texture_transform", name])
    gltf.tetrahedron()
    with pytest.raises(InputError, match=rf"(?s)extensionsRequired: an extension that is not read.*found: {name}\n"):
        read(gltf, tmp_path, suffix)


@pytest.mark.parametrize(
    "name", ["KHR_mesh_quantization", "KHR_materials_sheen", "KHR_texture_basisu", "EXT_texture_webp"]
)
def test_an_extension_that_moves_no_triangle_may_be_needed(name, tmp_path):
    gltf = Gltf(extensionsUsed=[name], extensionsRequired=[name])
    gltf.tetrahedron()
    assert_is_tetrahedron(read(gltf, tmp_path))


@pytest.mark.parametrize("empty", ["POSITION", "indices"])
def test_draco_is_refused_by_name_where_nothing_stands_beside_it(empty, tmp_path):
    gltf = Gltf(extensionsUsed=["KHR_draco_mesh_compression"])
    told = gltf.tetrahedron(extensions={"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}})
    assert_is_tetrahedron(read(gltf, tmp_path))
    del gltf.document["accessors"][told["attributes"].get(empty, told["indices"])]["bufferView"]
    with pytest.raises(InputError, match=r"(?s)found: KHR_draco_mesh_compression.*without Draco compression"):
        read(gltf, tmp_path)


def test_meshopt_is_refused_by_name_where_nothing_stands_beside_it(tmp_path):
    gltf = Gltf(extensionsUsed=["EXT_meshopt_compression"])
    gltf.tetrahedron()
    packed = {"buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12, "count": 4, "mode": "ATTRIBUTES"}
    view = gltf.document["bufferViews"][0]
    view["extensions"] = {"EXT_meshopt_compression": packed}
    assert_is_tetrahedron(read(gltf, tmp_path))
    view["buffer"] = 1
    gltf.more_buffers.append({"byteLength": 48, "extensions": {"EXT_meshopt_compression": {"fallback": True}}})
    with pytest.raises(InputError, match=r"(?s)found: EXT_meshopt_compression.*without meshopt compression"):
        read(gltf, tmp_path)


def skinned(gltf, joints_kind="u1", weights_kind="f4"):
    """The tetrahedron with its tip on a second joint, which stands one above the first."""
    joints = np.array([[0, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]])
    weights = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0.75, 0.25, 0, 0], [1, 0, 0, 0]])
    bound = np.stack([np.eye(4), np.eye(4)])
    bound[1, 2, 3] = -1.0
    attributes = {
        "POSITION": gltf.accessor(POINTS),
        "JOINTS_0": gltf.accessor(joints, joints_kind),
        "WEIGHTS_0": gltf.accessor(weights, weights_kind, weights_kind != "f4"),
    }
    gltf.primitive(attributes, gltf.accessor(FACES.reshape(-1), "u1"))
    matrices = gltf.accessor(bound.transpose(0, 2, 1).reshape(2, 16))
    gltf.document["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    gltf.document["scenes"] = [{"nodes": [0, 1]}]


@pytest.mark.parametrize("weights", ["f4", "u1", "u2"])
@pytest.mark.parametrize("joints", ["u1", "u2"])
def test_a_skin_is_bent_as_its_joints_stand(joints, weights, tmp_path):
    """The second joint is moved by (0, 0, 4) from where it was bound; where the mesh's own node stands is nothing."""
    nodes = [
        {"mesh": 0, "name": "body", "skin": 0, "translation": [50, 50, 50]},
        {"name": "root", "children": [2], "translation": [10, 0, 0]},
        {"name": "tip", "translation": [0, 0, 5]},
    ]
    gltf = Gltf(nodes=nodes)
    skinned(gltf, joints, weights)
    mesh = read(gltf, tmp_path)
    expected = POINTS + np.array([[10, 0, 0], [10, 0, 0], [10, 0, 1], [10, 0, 4]])
    assert {tuple(p) for p in mesh.vertices.round(1)} == {tuple(p) for p in expected.round(1)}
    assert "body: bent as the joints of its skeleton stand in the file" in mesh.notes


def test_a_skin_as_it_was_bound_is_the_mesh(tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", "skin": 0}, {"children": [2]}, {"translation": [0, 0, 1]}])
    skinned(gltf)
    assert_is_tetrahedron(read(gltf, tmp_path))


MIRROR = [float(at % 5 == 0) * (-1.0 if at == 10 else 1.0) for at in range(16)]
MIRRORING = {
    "a joint": [{"children": [2]}, {"translation": [0, 0, -1], "scale": [1, 1, -1]}],
    "both joints": [{"children": [2], "scale": [-1, 1, 1]}, {"translation": [0, 0, 1]}],
    "both by a matrix": [{"children": [2], "matrix": MIRROR}, {"translation": [0, 0, 1]}],
    "both in turn": [{"children": [2], "scale": [-1, 1, 1]}, {"translation": [0, 0, 1], "scale": [1, -1, 1]}],
}


@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("case", MIRRORING)
def test_a_skin_that_joints_mirror_still_looks_outwards(case, normals, tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", "skin": 0}, *MIRRORING[case]])
    skinned(gltf)
    (primitive,) = gltf.document["meshes"][0]["primitives"]
    if case == "a joint":
        on_it = gltf.accessor(np.tile([1, 0, 0, 0], (4, 1)), "u1"), gltf.accessor(np.eye(4)[[0] * 4])
        primitive["attributes"] |= dict(zip(("JOINTS_0", "WEIGHTS_0"), on_it, strict=True))
    if normals:
        outwards = POINTS - POINTS.mean(axis=0)
        outwards /= np.linalg.norm(outwards, axis=1)[:, None]
        primitive["attributes"]["NORMAL"] = gltf.accessor(outwards)
    mesh = read(gltf, tmp_path)
    # "in turn" brings the third corner half as far.
    assert volume(mesh) == pytest.approx(0.25 if case == "both in turn" else 0.5, abs=1e-5)
    middle = mesh.vertices.mean(axis=0)
    assert (np.einsum("vi,vi->v", mesh.normals, mesh.vertices - middle) > 0.0).all()
    assert not any("turned" in note for note in mesh.notes)


def test_a_joint_that_is_not_there_is_refused(tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "skin": 0}, {"children": [2]}, {}])
    skinned(gltf)
    gltf.document["skins"][0]["joints"] = [1]
    with pytest.raises(InputError, match="a joint that is not there"):
        read(gltf, tmp_path)


HALF = float(np.sqrt(0.5))
# A quarter turn about z: x to y.
PLACED = {
    "parts": [{"translation": [1, 2, 3], "rotation": [0, 0, HALF, HALF], "scale": [2, 2, 2]}],
    "a matrix": [{"matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1]}],
    "one below another": [{"translation": [1, 2, 3]}, {"rotation": [0, 0, HALF, HALF]}, {"scale": [2, 2, 2]}],
    "a quaternion of another length": [{"translation": [1, 2, 3], "rotation": [0, 0, 3, 3], "scale": [2, 2, 2]}],
    "a camera above": [
        {"translation": [1, 2, 3], "camera": 0},
        {"matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]},
    ],
}


@pytest.mark.parametrize("case", PLACED)
def test_nodes_place_what_is_below_them(case, tmp_path):
    nodes = [dict(node) for node in PLACED[case]]
    for number, node in enumerate(nodes[:-1]):
        node["children"] = [number + 1]
    nodes[-1] |= {"mesh": 0, "name": "body"}
    gltf = Gltf(
        nodes=nodes, cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "aspectRatio": 1}}]
    )
    gltf.tetrahedron()
    mesh = read(gltf, tmp_path)
    np.testing.assert_allclose(mesh.bounds, ([1 - 3, 2, 3], [1, 4, 7]), atol=1e-6)
    assert volume(mesh) == pytest.approx(4.0, abs=1e-6)


@pytest.mark.parametrize(("place", "value"), [(3, 0.5), (7, -1.0), (15, 2.0)])
def test_a_matrix_of_perspective_is_refused(place, value, tmp_path):
    matrix = [float(at % 5 == 0) for at in range(16)]
    matrix[place] = value
    gltf = Gltf(nodes=[{"mesh": 0, "matrix": matrix}])
    gltf.tetrahedron()
    with pytest.raises(InputError, match=r"nodes\[0\]\.matrix"):
        read(gltf, tmp_path)


@pytest.mark.parametrize("moved", [0.0, 1e-6, 5.0])
@pytest.mark.parametrize("part", ["translation", "rotation", "scale"])
def test_a_matrix_and_parts_beside_it_must_agree(part, moved, tmp_path):
    parts = {"translation": [1, 2, 3], "rotation": [0, 0, HALF, HALF], "scale": [2, 2, 2]}
    parts[part] = [parts[part][0] + moved, *parts[part][1:]]
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", **PLACED["a matrix"][0], **parts}])
    gltf.tetrahedron()
    if moved < 1.0:
        np.testing.assert_allclose(read(gltf, tmp_path).bounds, ([1 - 3, 2, 3], [1, 4, 7]), atol=1e-5)
        return
    with pytest.raises(InputError, match=r"nodes\[0\]\.matrix: two places of one node"):
        read(gltf, tmp_path)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -2, 1], [1, 1, -1], [-1, -1, -1], [-1, -1, 1]])
@pytest.mark.parametrize("mode", [4, 5, 6])
def test_a_mirrored_node_still_looks_outwards(scale, mode, tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body", "scale": scale}])
    if mode == 4:
        gltf.tetrahedron()
        assert volume(read(gltf, tmp_path)) == pytest.approx(0.5 * abs(np.prod(scale)))
        return
    gltf.primitive({"POSITION": gltf.accessor(band(4)[[0, 1, 2, 3] if mode == 5 else [0, 1, 3, 2]])}, mode=mode)
    mesh = read(gltf, tmp_path)
    facing = np.cross(band(4)[1] - band(4)[0], band(4)[2] - band(4)[0])[2] * np.sign(scale[2])
    assert (np.sign(mesh.face_normals[:, 2]) == np.sign(facing)).all() and len(mesh.faces) == 2


NOTED = {
    "textures that are moved": (
        {"materials": [{"name": "cloth", "pbrMetallicRoughness": {"baseColorTexture": {
            "index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}}}]},
        "material cloth: the file moves or repeats textures (KHR_texture_transform); uv are those of the mesh",
    ),
    "a second set of coordinates": (
        {"materials": [{"name": "cloth", "normalTexture": {"index": 0, "texCoord": 1}}]},
        "material cloth: the file lays a texture by TEXCOORD_1; uv are those of TEXCOORD_0",
    ),
    "animations": (
        {"animations": [{"channels": [], "samplers": []}]},
        "made: animations are not played: it is drawn as it stands",
    ),
    "an extension that it can do without": (
        {"extensionsUsed": ["KHR_materials_sheen", "VENDOR_secret_geometry"]},
        "made: extensions that are not read: VENDOR_secret_geometry",
    ),
    "scenes": (
        {"scene": 1, "scenes": [{"nodes": []}, {"nodes": [0], "name": "front"}]},
        "made: of 2 scenes only front is drawn",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", NOTED)
def test_what_the_file_says_and_is_not_drawn_is_noted(case, tmp_path):
    more, words = NOTED[case]
    gltf = Gltf(**more)
    gltf.tetrahedron(**({"material": 0} if "materials" in more else {}))
    mesh = read(gltf, tmp_path)
    assert_is_tetrahedron(mesh)
    assert mesh.notes[-1] == words


def test_texture_coordinates_of_another_set_alone_are_left_out_and_said(tmp_path):
    gltf = Gltf()
    gltf.primitive({"POSITION": gltf.accessor(POINTS[:3]), "TEXCOORD_1": gltf.accessor(UV[:3])})
    mesh = read(gltf, tmp_path)
    assert mesh.uv is None and "body: texture coordinates other than TEXCOORD_0 are left out" in mesh.notes


def test_hidden_nodes_and_what_is_below_them_are_left_out_and_said(tmp_path):
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    nodes = [
        {"mesh": 0, "name": "body", "children": [1]},
        {"children": [2], **hidden},
        {"mesh": 0, "name": "ghost", "translation": [9, 0, 0]},
    ]
    gltf = Gltf(nodes=nodes)
    gltf.tetrahedron()
    mesh = read(gltf, tmp_path)
    assert_is_tetrahedron(mesh)
    assert "ghost: left out, the file hides it" in mesh.notes


def test_a_file_without_scenes_is_drawn_from_its_roots(tmp_path):
    gltf = Gltf(nodes=[{"mesh": 0, "name": "body"}, {"children": [0], "scale": [2, 2, 2]}])
    del gltf.document["scenes"], gltf.document["scene"]
    gltf.tetrahedron()
    assert_is_tetrahedron(read(gltf, tmp_path), 2.0)


def test_nodes_of_one_name_are_told_apart(tmp_path):
    nodes = [{"mesh": 0, "name": "leg", "translation": [k, 0, 0]} for k in (0, 5)]
    gltf = Gltf(nodes=nodes, scenes=[{"nodes": [0, 1]}])
    gltf.tetrahedron()
    mesh = read(gltf, tmp_path)
    assert mesh.part_names == ("leg", "leg_1")
    assert mesh.part("leg_1").bounds[0].tolist() == [5, 0, 0]
