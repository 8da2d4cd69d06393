"""Groups, attributes and arrays as a plain tree: written to HDF5, read back, and summed up in one checksum."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...spectral.errors import InputError

# HDF5 cannot compress a scalar, and a few numbers only grow.
_WORTH_COMPRESSING = 256


@dataclass
class Node:
    """A group, or a data set where `value` is an array; attributes are text, numbers and booleans."""

    attributes: dict[str, Any] = field(default_factory=dict)
    children: dict[str, Node] = field(default_factory=dict)
    value: np.ndarray | None = None

    def __getitem__(self, path: str) -> Node:
        """The node below, by a path such as "packs/0/axes"; KeyError where there is none."""
        node = self
        for name in path.split("/"):
            node = node.children[name]
        return node

    @property
    def array(self) -> np.ndarray:
        """The data set's values; TypeError for a group."""
        if self.value is None:
            raise TypeError("a group where values are expected")
        return self.value


def mapping_node(values: Mapping[str, Any]) -> Node:
    """Text as attributes, numbers and arrays (float, int, bool) as data sets, under their own names.

    "/" would be a path in HDF5: "/" is written "%2F" and "%" is written "%25".
    """
    node = Node()
    for name, value in values.items():
        if not name or "\0" in name:
            raise InputError("cannot be stored", field="name", found=repr(name), expected="a name without NUL")
        key = name.replace("%", "%25").replace("/", "%2F").replace(".", "%2E" if not name.strip(".") else ".")
        if isinstance(value, str):
            node.attributes[key] = _checked_text(name, value)
        else:
            node.children[key] = Node(value=_checked_array(name, value))
    return node


def mapping_from(node: Node) -> dict[str, Any]:
    """The mapping that `mapping_node` wrote; an array without axes comes back as a number."""
    found = dict(node.attributes)
    for key, child in node.children.items():
        found[key] = child.array if child.array.shape else child.array.item()
    return {key.replace("%2E", ".").replace("%2F", "/").replace("%25", "%"): value for key, value in found.items()}


def form_node(values: Mapping[str, Any]) -> Node:
    """What a fast form keeps: text, numbers and booleans as attributes, arrays as data sets, mappings as groups."""
    node = Node()
    for name, value in values.items():
        if isinstance(value, Mapping):
            node.children[name] = form_node(value)
        elif isinstance(value, np.ndarray):
            node.children[name] = Node(value=_checked_array(name, value))
        else:
            node.attributes[name] = value
    return node


def form_from(node: Node) -> dict[str, Any]:
    """The mapping that `form_node` wrote."""
    groups = {name: form_from(child) if child.value is None else child.array for name, child in node.children.items()}
    return {**node.attributes, **groups}


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


def write_tree(group: Any, node: Node) -> None:
    """Write `node` into an open h5py group; large arrays are compressed without loss."""
    group.attrs.update(node.attributes)
    for name, child in node.children.items():
        if child.value is None:
            write_tree(group.create_group(name), child)
            continue
        worth = child.value.size > _WORTH_COMPRESSING
        options = {"compression": "gzip", "compression_opts": 2, "shuffle": True} if worth else {}
        group.create_dataset(name, data=child.value, **options).attrs.update(child.attributes)


def read_tree(group: Any) -> Node:
    """Everything in an open h5py group or file; KeyError where a link leads nowhere."""
    if group is None:
        raise KeyError("a link that leads nowhere")
    node = Node({name: _plain(value) for name, value in group.attrs.items()})
    if hasattr(group, "shape"):
        node.value = np.asarray(group[()])
    else:
        node.children = {name: read_tree(child) for name, child in group.items()}
    return node


def tree_checksum(root: Node) -> str:
    """SHA-256 of every attribute and every value in the order of their paths; independent of HDF5's own layout.

    The root's attribute `checksum` is left out: it is where this goes.
    """
    digest = hashlib.sha256()
    for path, node in sorted(_walk("", root), key=lambda item: item[0]):
        for key in sorted(node.attributes):
            if (path, key) != ("", "checksum"):
                digest.update(f"{path}@{key}={_plain(node.attributes[key])!r}\n".encode())
        if node.value is not None:
            digest.update(f"{path}:{node.value.shape}:{node.value.dtype}\n".encode())
            digest.update(np.ascontiguousarray(node.value).tobytes())
    return digest.hexdigest()


def _walk(path: str, node: Node) -> Iterator[tuple[str, Node]]:
    yield path, node
    for name, child in node.children.items():
        yield from _walk(f"{path}/{name}" if path else name, child)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
