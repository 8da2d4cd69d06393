"""Groups, attributes and arrays as a plain tree: written to HDF5 or as text, read back, with one checksum.

A large array, of `LARGE_BYTES` or more or already in a file, is a group: `values`, written and read block by block, and
the `digests` of its blocks, which enter the checksum instead of the numbers. Or there are no values but attributes that
name their file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from .stored_array import StoredArray, blocks_of, chunks_of, digests_of
from .stored_files import StoredFiles

# HDF5 cannot compress a scalar, and a few numbers only grow.
_WORTH_COMPRESSING = 256
#: Bytes from which an array is not read with its file.
LARGE_BYTES = 64 << 20
_COMPRESSED = {"compression": "gzip", "compression_opts": 2, "shuffle": True}
# Attribute of a data set that is read only when asked for: the number of its blocks.
_IN_BLOCKS = "blocks"


@dataclass
class Node:
    """Group, or data set if `value` is an array; attributes are text, numbers and booleans."""

    attributes: dict[str, Any] = field(default_factory=dict)
    children: dict[str, Node] = field(default_factory=dict)
    value: np.ndarray | StoredArray | None = None

    def __getitem__(self, path: str) -> Node:
        """Return the node below, by a path such as "packs/0/axes"; KeyError if there is none."""
        node = self
        for name in path.split("/"):
            node = node.children[name]
        return node

    @property
    def array(self) -> np.ndarray:
        """Values of the data set; TypeError for a group, and for values that stay in their file."""
        if not isinstance(self.value, np.ndarray):
            raise TypeError("a group where values are expected")
        return self.value

    @property
    def in_blocks(self) -> bool:
        """True for values that are written and read block by block."""
        return self.value is not None and _IN_BLOCKS in self.attributes


def mapping_node(values: Mapping[str, Any], copy: bool = True) -> Node:
    """Make the node of a mapping: text as attributes, numbers and arrays as data sets, large ones as groups.

    copy : write arrays that are already in a file; otherwise their file, place and digests.

    "/" would be a path in HDF5: "/" is written "%2F" and "%" is written "%25".
    """
    node = Node()
    for name, value in values.items():
        if not name or "\0" in name:
            raise InputError("cannot be stored", field="name", found=repr(name), expected="a name without NUL")
        key = name.replace("%", "%25").replace("/", "%2F").replace(".", "%2E" if not name.strip(".") else ".")
        if isinstance(value, str):
            node.attributes[key] = _checked_text(name, value)
        elif isinstance(value, StoredArray):
            node.children[key] = _large_node(value, copy)
        else:
            node.children[key] = _array_node(name, value)
    return node


def _array_node(name: str, value: Any) -> Node:
    array = _checked_array(name, value)
    return _large_node(array, True) if array.nbytes >= LARGE_BYTES else Node(value=array)


def _large_node(array: StoredArray | np.ndarray, copy: bool) -> Node:
    if isinstance(array, StoredArray) and not array.digests:
        array = array.sealed()
    if copy and isinstance(array, StoredFiles):
        # Copied in other blocks, which are hashed first; progress counts the copying alone.
        unheard = replace(array, heard=lambda read: None).joined()
        array = replace(array.joined(), digests=digests_of(unheard))
    digests = Node(value=np.frombuffer(digests_of(array), np.uint8).reshape(-1, 32))
    if copy or not isinstance(array, StoredArray):
        values = Node({_IN_BLOCKS: len(blocks_of(array.shape, array.dtype))}, value=array)
        return Node(children={"values": values, "digests": digests})
    if isinstance(array, StoredFiles):
        names = Node(value=np.frombuffer("\0".join(array.names).encode("utf-8", "surrogateescape"), np.uint8))
        sizes = Node(value=np.array(array.sizes, dtype=np.int64))
        return Node({"folder": str(array.file.absolute())}, {"names": names, "sizes": sizes, "digests": digests})
    where = {"file": str(array.file.absolute()), "file_size": array.file_size, "place": array.place}
    shape = " ".join(map(str, array.shape))
    return Node({**where, "shape": shape, "dtype": array.dtype.str}, {"digests": digests})


def _large_from(node: Node) -> StoredArray:
    said, digests = node.attributes, node["digests"].array.tobytes()
    if "names" in node.children:
        names = tuple(node["names"].array.tobytes().decode("utf-8", "surrogateescape").split("\0"))
        return StoredFiles.of(Path(said["folder"]), names, digests, tuple(node["sizes"].array.tolist()))
    if "values" not in node.children:
        shape = tuple(map(int, said["shape"].split()))
        return StoredArray(
            Path(said["file"]), said["place"], shape, np.dtype(said["dtype"]), digests, said["file_size"]
        )
    values = node["values"].value
    if not isinstance(values, StoredArray):
        raise TypeError("values without the number of their blocks")
    return replace(values, digests=digests)


def mapping_from(node: Node) -> dict[str, Any]:
    """Return the mapping of `mapping_node`: an array without axes as a number, a large one as a `StoredArray`."""
    found = dict(node.attributes)
    for key, child in node.children.items():
        if child.value is None:
            found[key] = _large_from(child)
        else:
            found[key] = child.array if child.array.shape else child.array.item()
    return {key.replace("%2E", ".").replace("%2F", "/").replace("%25", "%"): value for key, value in found.items()}


def form_node(values: Mapping[str, Any]) -> Node:
    """Make the node of a fast form: text, numbers, booleans as attributes, arrays as data sets, mappings as groups."""
    node = Node()
    for name, value in values.items():
        if isinstance(value, Mapping):
            node.children[name] = form_node(value)
        elif isinstance(value, np.ndarray):
            node.children[name] = _array_node(name, value)
        else:
            node.attributes[name] = value
    return node


def form_from(node: Node) -> dict[str, Any]:
    """Return the mapping that `form_node` wrote; a large array is a `StoredArray`."""
    found = dict(node.attributes)
    for name, child in node.children.items():
        if child.value is not None:
            found[name] = child.array
        else:
            found[name] = _large_from(child) if "digests" in child.children else form_from(child)
    return found


def _checked_array(name: str, value: Any) -> np.ndarray:
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError("cannot be stored", field=name, found="a ragged list", expected="numbers or text") from None
    if array.dtype.kind not in "fiub":
        raise InputError("cannot be stored", field=name, found=f"{array.dtype} values", expected="numbers or text")
    return array


def _checked_text(name: str, text: str) -> str:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError("cannot be stored", field=name, found="half a character", expected="unicode text") from None
    if "\0" in text:
        raise InputError("cannot be stored", field=name, found="a NUL character", expected="unicode text")
    return text


def write_tree(group: Any, node: Node, written: Callable[[], None] = lambda: None) -> None:
    """Write `node` into an open h5py group; all but short arrays are compressed without loss.

    written : called after each block of a large array; its exceptions end the writing.
    """
    group.attrs.update(node.attributes)
    for name, child in node.children.items():
        if child.value is None:
            write_tree(group.create_group(name), child, written)
            continue
        if child.in_blocks:
            _write_blocks(group, name, child.value, written)
        else:
            worth = child.array.size > _WORTH_COMPRESSING
            group.create_dataset(name, data=child.value, **(_COMPRESSED if worth else {}))
        group[name].attrs.update(child.attributes)


def _write_blocks(group: Any, name: str, array: Any, written: Callable[[], None]) -> None:
    first = next(iter(blocks_of(array.shape, array.dtype)), None)
    # A block is a chunk of HDF5: it is packed, unpacked and checked as a whole.
    chunk = None if first is None else tuple(along.stop - along.start for along in first)
    options = {} if chunk is None else {"chunks": chunk, **_COMPRESSED}
    values = group.create_dataset(name, array.shape, array.dtype, **options)
    for where, block in chunks_of(array):
        values[where] = block
        written()


def read_tree(group: Any, path: Path) -> Node:
    """Read everything in an open h5py group of the file at `path`; large arrays are read on demand.

    KeyError for a dangling link.
    """
    if group is None:
        raise KeyError("a link that leads nowhere")
    node = Node({name: _plain(value) for name, value in group.attrs.items()})
    if hasattr(group, "shape") and _IN_BLOCKS in node.attributes:
        node.value = StoredArray(path.absolute(), group.name, group.shape, group.dtype)
    elif hasattr(group, "shape"):
        node.value = np.asarray(group[()])
    else:
        node.children = {name: read_tree(child, path) for name, child in group.items()}
    return node


def tree_text(node: Node) -> bytes:
    """Encode a tree without blocks as JSON.

    `attributes` and `children` by their names, an array as its `dtype`, `shape` and `values` in C order, a table as its
    `columns`. Python's numbers round-trip to the last bit.
    """
    return json.dumps(_plain_node(node), ensure_ascii=False, separators=(",", ":")).encode()


def _plain_node(node: Node) -> dict[str, Any]:
    plain: dict[str, Any] = {}
    if node.attributes:
        plain["attributes"] = {name: _plain(value) for name, value in node.attributes.items()}
    if node.children:
        plain["children"] = {name: _plain_node(child) for name, child in node.children.items()}
    return plain if node.value is None else plain | _plain_array(node.array)


def _plain_array(array: np.ndarray) -> dict[str, Any]:
    if array.dtype.names is not None:
        return {"columns": {name: _plain_array(array[name]) for name in array.dtype.names}}
    values = array.ravel().tolist()
    if array.dtype.kind == "S":
        values = [value.decode("utf-8") for value in values]
    return {"dtype": array.dtype.str, "shape": list(array.shape), "values": values}


def tree_from_text(text: Any) -> Node:
    """Decode the tree of `tree_text`; raises ValueError for other text."""
    try:
        return _node_from(json.loads(bytes(text)))
    except (KeyError, TypeError, AttributeError, OverflowError, RecursionError) as reason:
        raise ValueError(f"not the text of a record: {reason}") from None


def _node_from(plain: Mapping[str, Any]) -> Node:
    children = {name: _node_from(child) for name, child in plain.get("children", {}).items()}
    value = _array_from(plain) if plain.keys() & {"values", "columns"} else None
    return Node(dict(plain.get("attributes", {})), children, value)


def _array_from(plain: Mapping[str, Any]) -> np.ndarray:
    if "columns" in plain:
        columns = {name: _array_from(column) for name, column in plain["columns"].items()}
        table = np.empty(len(next(iter(columns.values()))), [(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            table[name] = column
        return table
    values = plain["values"]
    if np.dtype(plain["dtype"]).kind == "S":
        values = [value.encode("utf-8") for value in values]
    return np.array(values, plain["dtype"]).reshape(plain["shape"])


def tree_checksum(root: Node) -> str:
    """Compute the SHA-256 of every attribute and every value in the order of their paths, independent of HDF5's layout.

    Values in blocks enter by their stored digests.

    The root's attribute `checksum`, which holds the result, is left out.
    """
    digest = hashlib.sha256()
    for path, node in sorted(_walk("", root), key=lambda item: item[0]):
        for key in sorted(node.attributes):
            if (path, key) != ("", "checksum"):
                digest.update(f"{path}@{key}={_plain(node.attributes[key])!r}\n".encode())
        if node.value is not None:
            digest.update(f"{path}:{node.value.shape}:{node.value.dtype}\n".encode())
            if not node.in_blocks:
                digest.update(np.ascontiguousarray(node.array).tobytes())
    return digest.hexdigest()


def _walk(path: str, node: Node) -> Iterator[tuple[str, Node]]:
    yield path, node
    for name, child in node.children.items():
        yield from _walk(f"{path}/{name}" if path else name, child)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
