"""Accessors of a glTF (Khronos 2021, sections 3.6.2 and 5.1), with buffer views, strides, sparse values and normalised
integers.
"""

from __future__ import annotations

from typing import NoReturn

import numpy as np
from jaxtyping import Float, Int

from ...materials.formats.gltf_container import GltfFile
from ...materials.formats.gltf_json import JsonNode
from .cost import MeshCost

_AGAIN = "the file is damaged or cut short: export or copy it again"
_FLOAT = 5126
_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", _FLOAT: "<f4"}
_INDEX_TYPES = (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
#: Extensions that replace a view's bytes, which may be present as a fallback.
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")


class Accessors:
    """Accessors of a file, each decoded on first use."""

    def __init__(self, gltf: GltfFile) -> None:
        self.gltf = gltf
        self.nodes = gltf.root.children("accessors")
        self.views = gltf.root.children("bufferViews")
        self._buffers: dict[int, bytes] = {}
        self._decoded: dict[int, np.ndarray] = {}

    def vectors(self, owner: JsonNode, name: str, widths: tuple[int, ...]) -> Float[np.ndarray, "n k"]:
        """Decode the accessor `name` of `owner` as floats, one row per element.

        widths : allowed numbers of components. `normalized` integers become fractions, 0 to 1 or -1 to 1; others keep
        their values (KHR_mesh_quantization).
        """
        accessor = self.nodes[owner.whole(name, below=len(self.nodes))]
        raw = self._raw(accessor)
        if raw.shape[1] not in widths:
            expected = " or ".join(kind for kind, width in _WIDTHS.items() if width in widths)
            accessor.refuse("type", f"not what {name} is made of", accessor.text("type"), expected)
        values = raw.astype(np.float64)
        if accessor.values.get("normalized") is True and raw.dtype.kind != "f":
            if raw.dtype.itemsize > 2:
                accessor.refuse("normalized", "fractions of 32 bits", "true", "8 or 16 bits, or floats")
            values = np.maximum(values / np.iinfo(raw.dtype).max, -1.0)
        return values

    def indices(self, owner: JsonNode, name: str) -> Int[np.ndarray, " n"]:
        """Decode the accessor `name` of `owner` as indices."""
        accessor = self.nodes[owner.whole(name, below=len(self.nodes))]
        component = accessor.whole("componentType")
        if component not in _INDEX_TYPES or accessor.text("type") != "SCALAR":
            found = f"{accessor.text('type')} of {component}"
            accessor.refuse("componentType", "not indices", found, "SCALAR of 5121, 5123 or 5125 (unsigned)")
        return self._raw(accessor)[:, 0].astype(np.int64)

    def empty(self, owner: JsonNode, name: str) -> bool:
        """Return whether an accessor has no data of its own, so that an extension must provide it."""
        accessor = self.nodes[owner.whole(name, below=len(self.nodes))]
        return not accessor.has("bufferView") and not accessor.has("sparse")

    def _raw(self, accessor: JsonNode) -> np.ndarray:
        """Return the stored values (count, components), with sparse values applied."""
        number = int(accessor.place.rpartition("[")[2][:-1])
        if number not in self._decoded:
            kind, component = accessor.text("type"), accessor.whole("componentType")
            if kind not in _WIDTHS or component not in _DTYPES:
                expected = f"{', '.join(_WIDTHS)} of {', '.join(map(str, _DTYPES))}"
                accessor.refuse("type", "unknown type of values", f"{kind} of {component}", expected)
            count, width = accessor.whole("count"), _WIDTHS[kind]
            if accessor.has("bufferView"):
                values = self._viewed(accessor, count, width, component)
            else:
                # No bytes limit the count, so memory is checked.
                MeshCost(count).check_room(self.gltf.path)
                values = np.zeros((count, width), _DTYPES[component])
            if accessor.has("sparse"):
                values = self._with_sparse(accessor, values, component)
            self._decoded[number] = values
        return self._decoded[number]

    def _with_sparse(self, accessor: JsonNode, values: np.ndarray, component: int) -> np.ndarray:
        sparse = accessor.child("sparse")
        changed = sparse.whole("count", below=len(values) + 1)
        where, told = sparse.child("indices"), sparse.child("values")
        kind = where.whole("componentType")
        if kind not in _INDEX_TYPES:
            where.refuse("componentType", "not indices", kind, "5121, 5123 or 5125 (unsigned)")
        at = self._viewed(where, changed, 1, kind)[:, 0].astype(np.int64)
        if changed and (at.max() >= len(values) or (np.diff(at) <= 0).any()):
            found = f"up to {at.max()}" if at.max() >= len(values) else "indices out of order"
            where.refuse("bufferView", "sparse values of nothing", found, f"ascending, below {len(values)}", _AGAIN)
        values = values.copy()
        values[at] = self._viewed(told, changed, values.shape[1], component)
        return values

    def _viewed(self, owner: JsonNode, count: int, width: int, component: int) -> np.ndarray:
        """Read (count, width) values from a view with its stride."""
        view = self.views[owner.whole("bufferView", below=len(self.views))]
        number = view.whole("buffer", below=len(self.gltf.root.children("buffers")))
        for name in MESHOPT:
            if view.child("extensions").has(name) and not self.gltf.has_buffer(number):
                refuse_extension(view, "extensions", name)
        if number not in self._buffers:
            self._buffers[number] = self.gltf.buffer(number)
        dtype = np.dtype(_DTYPES[component])
        start = view.whole("byteOffset", 0) + owner.whole("byteOffset", 0)
        stride = view.whole("byteStride", 0) or width * dtype.itemsize
        if stride < width * dtype.itemsize:
            expected = f"{width * dtype.itemsize} or more"
            view.refuse("byteStride", "elements that lie on each other", stride, expected, _AGAIN)
        end = start + (count - 1) * stride + width * dtype.itemsize if count else start
        if end > min(view.whole("byteOffset", 0) + view.whole("byteLength"), len(self._buffers[number])):
            length = view.whole("byteLength")
            owner.refuse("bufferView", "values beyond their view", f"to byte {end}", f"at most {length}", _AGAIN)
        shape, strides = (count, width), (stride, dtype.itemsize)
        return np.ndarray(shape, dtype, self._buffers[number], start, strides) if count else np.empty(shape, dtype)


def refuse_extension(owner: JsonNode, field: str, name: str) -> NoReturn:
    """Raise `InputError` for geometry in an unsupported extension."""
    ways = {"KHR_draco_mesh_compression": "without Draco compression"}
    hint = ways.get(name, "without meshopt compression" if name in MESHOPT else "without this extension")
    owner.refuse(field, "an extension that is not read", name, "plain accessors", f"export the mesh {hint}")
