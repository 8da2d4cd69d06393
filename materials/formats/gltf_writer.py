"""Writer of glTF 2.0 files (Khronos 2021): materials, each on a sphere, with embedded textures."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt

from ...runtime.files import written_whole
from ...spectral.formats.png_writer import png_bytes
from ..svbrdf.map_set import Placement
from .gltf_container import MAGIC
from .gltf_textures import WRAPS

# Quads of the sphere, around and from pole to pole.
_AROUND, _DOWN = 64, 32
# Distance of the spheres' centres; their radius is 1.
_APART = 2.5
# componentType and target of the specification.
_FLOAT, _SHORT = 5126, 5123
_VERTICES, _INDICES = 34962, 34963
_CODE = {word: code for code, word in WRAPS.items()}


class GltfWriter:
    """File under construction: `texture` and `add` materials, then `write`."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._pictures: dict[bytes, int] = {}
        lists = "bufferViews accessors images samplers textures materials meshes nodes"
        self._lists: dict[str, list[dict[str, Any]]] = {name: [] for name in lists.split()}
        self._extensions: set[str] = set()
        self._sphere: dict[str, Any] | None = None

    def texture(self, codes: UInt[np.ndarray, "H W C"], placement: Placement) -> dict[str, Any]:
        """Add a texture of these codes; return its reference in a material, with its placement on the mesh."""
        data = png_bytes(codes)
        if data not in self._pictures:
            self._pictures[data] = len(self._lists["images"])
            self._lists["images"].append({"bufferView": self._view(data), "mimeType": "image/png"})
        sampler = {"wrapS": _CODE[placement.wrap[0]], "wrapT": _CODE[placement.wrap[1]]}
        texture = {"source": self._pictures[data], "sampler": self._number("samplers", sampler)}
        said: dict[str, Any] = {"index": self._number("textures", texture)}
        (across, down), (left, up) = placement.scale, placement.offset
        if (across, down, left, up) != (1.0, 1.0, 0.0, 0.0):
            # The file's v grows downwards.
            moved = {"scale": [across, down], "offset": [left, 1.0 - down - up]}
            self._extensions.add("KHR_texture_transform")
            said["extensions"] = {"KHR_texture_transform": moved}
        return said

    def add(self, material: dict[str, Any]) -> None:
        """Add a material, on a sphere beside the others."""
        self._extensions |= set(material.get("extensions", ()))
        number = len(self._lists["materials"])
        self._lists["materials"].append(material)
        self._sphere = self._sphere or self._sphere_primitive()
        self._lists["meshes"].append({"name": material["name"], "primitives": [self._sphere | {"material": number}]})
        node = {"name": material["name"], "mesh": number, "translation": [_APART * number, 0.0, 0.0]}
        self._lists["nodes"].append(node)

    def write(self, path: Path, asset: dict[str, Any]) -> None:
        """Write the file whole: binary, or as text with its buffer in base64 if it is called .gltf."""
        text = path.suffix.lower() == ".gltf"
        buffer: dict[str, Any] = {"byteLength": len(self._bytes)}
        if text:
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self._bytes).decode("ascii")
        document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "Metamer"} | asset, "scene": 0}
        document |= {"scenes": [{"nodes": list(range(len(self._lists["nodes"])))}], "buffers": [buffer]}
        document |= {name: entries for name, entries in self._lists.items() if entries}
        if self._extensions:
            document["extensionsUsed"] = sorted(self._extensions)
        written = json.dumps(document, ensure_ascii=False, indent=1 if text else None).encode("utf-8")
        with written_whole(path) as beside:
            beside.write_bytes(written if text else _binary(written, bytes(self._bytes)))

    def _number(self, name: str, entry: dict[str, Any]) -> int:
        """Return the index of an entry in its list, which contains it once."""
        entries = self._lists[name]
        if entry not in entries:
            entries.append(entry)
        return entries.index(entry)

    def _view(self, data: bytes, target: int | None = None) -> int:
        self._bytes += b"\0" * (-len(self._bytes) % 4)
        view = {"buffer": 0, "byteOffset": len(self._bytes), "byteLength": len(data)}
        self._lists["bufferViews"].append(view | ({} if target is None else {"target": target}))
        self._bytes += data
        return len(self._lists["bufferViews"]) - 1

    def _accessor(self, values: np.ndarray, kind: str, target: int, **more: Any) -> int:
        component = _FLOAT if values.dtype.kind == "f" else _SHORT
        entry = {"bufferView": self._view(values.tobytes(), target), "componentType": component}
        self._lists["accessors"].append(entry | {"count": len(values), "type": kind} | more)
        return len(self._lists["accessors"]) - 1

    def _sphere_primitive(self) -> dict[str, Any]:
        """Return a unit sphere: u goes to the right as seen from outside, from -z to -z, the file's v from the top
        down.
        """
        v, u = (each.ravel() for each in np.mgrid[0 : _DOWN + 1, 0 : _AROUND + 1] / [[[_DOWN]], [[_AROUND]]])
        theta, phi = np.pi * v, 2.0 * np.pi * u
        place = np.stack([-np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)], axis=1)
        at = np.arange(_DOWN * (_AROUND + 1)).reshape(_DOWN, -1)[:, :-1].ravel()
        below = at + _AROUND + 1
        upper = np.stack([at, below, at + 1], axis=1)[_AROUND:]
        lower = np.stack([at + 1, below, below + 1], axis=1)[:-_AROUND]
        vertices = place.astype("<f4")
        extent = {"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()}
        attributes = {
            "POSITION": self._accessor(vertices, "VEC3", _VERTICES, **extent),
            "NORMAL": self._accessor(vertices, "VEC3", _VERTICES),
            "TEXCOORD_0": self._accessor(np.stack([u, v], axis=1).astype("<f4"), "VEC2", _VERTICES),
        }
        indices = np.concatenate([upper, lower]).ravel().astype("<u2")
        return {"attributes": attributes, "indices": self._accessor(indices, "SCALAR", _INDICES)}


def _binary(document: bytes, buffer: bytes) -> bytes:
    """Return the container .glb: the document, filled up with blanks, and the buffer, with zeros, to fours of bytes."""
    document += b" " * (-len(document) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    chunks = (
        struct.pack("<I4s", len(document), b"JSON") + document + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    )
    return struct.pack("<4sII", MAGIC, 2, 12 + len(chunks)) + chunks
