"""glTF files that are damaged, or say what cannot be: each is refused with its place in the file."""

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh
from metamer.runtime.errors import InputError

from .gltf_files import FACES, POINTS, Gltf

UV = np.array([[0.25, 0.0], [0.75, 0.0], [0.25, 0.5], [1.0, 1.0]])


def broken(change):
    gltf = Gltf()
    place = gltf.accessor(POINTS, sparse=([1, 3], "u1", POINTS[[1, 3]]))
    uv = gltf.accessor(UV)
    gltf.primitive({"POSITION": place, "TEXCOORD_0": uv}, gltf.accessor(FACES.reshape(-1), "u1"))
    change(gltf.document, gltf)
    return gltf


def set_to(*path):
    """A change of one value of a document."""

    def change(document, gltf):
        at = document
        for key in path[:-2]:
            at = at[key]
        at[path[-2]] = path[-1]

    return change


BROKEN = {
    "an index of nothing": lambda d, g: d["meshes"][0]["primitives"][0].update(
        indices=g.accessor(np.array([0, 1, 4]), "u1")
    ),
    "signed indices": lambda d, g: d["meshes"][0]["primitives"][0].update(
        indices=g.accessor(np.array([0, 1, 2]), "i1")
    ),
    "two corners": lambda d, g: d["meshes"][0]["primitives"][0].update(indices=g.accessor(np.array([0, 1]), "u1")),
    "positions of four": lambda d, g: d["meshes"][0]["primitives"][0]["attributes"].update(
        POSITION=g.accessor(np.ones((4, 4)))
    ),
    "an accessor that is not there": set_to("meshes", 0, "primitives", 0, "attributes", "POSITION", 9),
    "no number for an accessor": set_to("meshes", 0, "primitives", 0, "attributes", "POSITION", "0"),
    "a view that is not there": set_to("accessors", 0, "bufferView", 9),
    "a view of nothing": set_to("bufferViews", 0, "buffer", 3),
    "a view beyond its buffer": set_to("bufferViews", 0, "byteLength", 9999),
    "elements that lie on each other": set_to("bufferViews", 0, "byteStride", 8),
    "more values than there are": set_to("accessors", 0, "count", 5),
    "an unknown type": set_to("accessors", 0, "componentType", 5124),
    "an unknown kind": set_to("accessors", 0, "type", "VEC5"),
    "fewer uv than vertices": set_to("accessors", 1, "count", 3),
    "a sparse index beyond": set_to("accessors", 0, "sparse", "indices", "componentType", 5123),
    "sparse values beyond their view": set_to("accessors", 0, "sparse", "values", "byteOffset", 4),
    "more sparse values than values": set_to("accessors", 0, "sparse", "count", 5),
    "sparse indices of floats": set_to("accessors", 0, "sparse", "indices", "componentType", 5126),
    "a mesh that is not there": set_to("nodes", 0, "mesh", 1),
    "a node below itself": set_to("nodes", 0, "children", [0]),
    "a child that is not there": set_to("nodes", 0, "children", [7]),
    "a scene that is not there": set_to("scene", 2),
    "a matrix of nine": set_to("nodes", 0, "matrix", [1, 0, 0, 0, 1, 0, 0, 0, 1]),
    "a turn by words": set_to("nodes", 0, "rotation", ["a", 0, 0, 1]),
    "a material that is not there": set_to("meshes", 0, "primitives", 0, "material", 0),
    "a skin that is not there": set_to("nodes", 0, "skin", 0),
    "weights of words": set_to("meshes", 0, "weights", ["much"]),
    "names of extensions that are none": set_to("extensionsRequired", [1]),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_is_damaged_is_refused_with_its_place(case, tmp_path):
    with pytest.raises(InputError, match=r"made\.gltf") as refused:
        load_mesh(broken(BROKEN[case]).write(tmp_path / "made.gltf"))
    assert refused.value.field


@pytest.mark.parametrize("order", [[3, 1], [1, 1]])
def test_sparse_indices_out_of_order_are_refused(order, tmp_path):
    gltf = Gltf()
    place = gltf.accessor(POINTS, sparse=(order, "u1", POINTS[[1, 3]]))
    gltf.primitive({"POSITION": place}, gltf.accessor(FACES.reshape(-1), "u1"))
    with pytest.raises(InputError, match="sparse values of nothing"):
        load_mesh(gltf.write(tmp_path / "made.gltf"))
