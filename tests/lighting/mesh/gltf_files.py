"""Small glTF files written by hand, one accessor at a time."""

import base64
import json
import struct

import numpy as np

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

# A tetrahedron whose faces look outwards: volume 0.5, bounds 0 to (1, 1.5, 2).
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1.5, 0], [0, 0, 2.0]])
FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


class Gltf:
    """A document and its one buffer, to which arrays are added."""

    def __init__(self, **more):
        self.data = bytearray()
        self.more_buffers = []
        self.document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "body"}],
            "meshes": [{"primitives": []}],
            "accessors": [],
            "bufferViews": [],
        } | more

    def view(self, raw, stride=0):
        """The number of a view of these bytes."""
        self.data += b"\0" * (-len(self.data) % 4)
        told = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)}
        self.document["bufferViews"].append(told | ({"byteStride": stride} if stride else {}))
        self.data += raw
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values, kind="f4", normalized=False, pad=0, sparse=None, empty=False):
        """The number of an accessor of (n, k) or (n,) values, each row followed by `pad` bytes of noise.

        sparse : (indices, their type, rows) put in the place of others; empty: no bytes stand for the others.
        """
        values = np.asarray(values)
        columns = 1 if values.ndim == 1 else values.shape[1]
        stored = coded(values, kind) if normalized else values.astype("<" + kind)
        rows = [row.tobytes() + b"\xa5" * pad for row in stored.reshape(len(values), columns)]
        told = {"componentType": COMPONENTS[kind], "count": len(values), "type": KINDS[columns]}
        if not empty:
            told["bufferView"] = self.view(b"".join(rows), len(rows[0]) if pad else 0)
        if normalized:
            told["normalized"] = True
        if sparse is not None:
            where, where_kind, changed = sparse
            changed = coded(np.asarray(changed), kind) if normalized else np.asarray(changed).astype("<" + kind)
            told["sparse"] = {
                "count": len(where),
                "indices": {
                    "bufferView": self.view(np.asarray(where).astype("<" + where_kind).tobytes()),
                    "componentType": COMPONENTS[where_kind],
                },
                "values": {"bufferView": self.view(changed.tobytes())},
            }
        self.document["accessors"].append(told)
        return len(self.document["accessors"]) - 1

    def primitive(self, attributes, indices=None, mesh=0, **more):
        """Add a primitive of accessors."""
        told = {"attributes": attributes} | ({} if indices is None else {"indices": indices}) | more
        self.document["meshes"][mesh]["primitives"].append(told)
        return told

    def tetrahedron(self, **more):
        """Add the tetrahedron as a primitive."""
        return self.primitive({"POSITION": self.accessor(POINTS)}, self.accessor(FACES.reshape(-1), "u2"), **more)

    def write(self, path):
        """The file: text, or a .glb."""
        document = self.document | {"buffers": [{"byteLength": len(self.data)}, *self.more_buffers]}
        if path.suffix == ".gltf":
            uri = "data:application/octet-stream;base64," + base64.b64encode(bytes(self.data)).decode()
            document["buffers"][0]["uri"] = uri
            path.write_text(json.dumps(document))
            return path
        text, data = json.dumps(document).encode(), bytes(self.data)
        text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return path


def coded(fractions, kind):
    """Whole numbers that stand for fractions."""
    return np.round(np.asarray(fractions) * np.iinfo(kind).max).astype("<" + kind)


def area(mesh):
    """Compute the area of all triangles."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def volume(mesh):
    """Compute the volume of a closed body, positive where its triangles look outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.einsum("fi,fi->f", a, np.cross(b, c)).sum() / 6.0
