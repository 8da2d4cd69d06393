"""HDF5 file of a tree behind a head, written so that a full disk raises an exception.

HDF5 ends the whole process if it cannot write its buffers. Small content is made in memory, then written as a whole;
large content goes, block by block, through a file object that hides errors from the library.

HDF5 spends some hundred bytes on each array and each name: a few kilobytes of numbers become thirty. Such a tree is
written as text (`tree_text`) into the only data set of its file, which the library deflates.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .hdf5_tree import Node, read_tree, tree_from_text, tree_text, write_tree
from .stored_array import hdf5_content

# The data set that holds a small tree.
_PACKED = "packed"
# Most bytes of numbers in such a tree.
_SMALL_BYTES = 8 << 10


def write_behind(head: bytes, tree: Node, path: Path) -> None:
    """Write `head`, then the HDF5 file, to `path` and to the disk; raises OSError if there is no room.

    head : of a length that HDF5 allows for a user block: 512 bytes, doubled any number of times.
    """
    image = None if _has_blocks(tree) else _image(tree, len(head))
    with path.open("w+b", buffering=0) as file:
        if image is None:
            _stream(tree, len(head), file)
            file.seek(0)
        _write_all(file, head + (image or b""))
        os.fsync(file.fileno())


def read_behind(path: Path, check: Callable[[Mapping[str, Any]], None]) -> Node:
    """Read the tree of a file that `write_behind` wrote; large arrays are read on demand.

    check : receives the attributes of its root before more is read, and raises on objections.

    Raises
    ------
    OSError, KeyError, ValueError, TypeError, RuntimeError : there is no such file, or it is unreadable.
    """
    with hdf5_content(path) as file:
        packed: Any = file.get(_PACKED)
        if packed is not None:
            tree = tree_from_text(packed[()])
            check(tree.attributes)
            return tree
        check(file.attrs)
        return read_tree(file, path)


def _image(tree: Node, room: int) -> bytes:
    """Build the HDF5 file behind the head in memory, since the library ends the process on a full disk."""
    import h5py

    small = _number_bytes(tree) <= _SMALL_BYTES
    plain = {"driver": "core", "backing_store": False, "userblock_size": room}
    with h5py.File(_short(room)) if small else h5py.File("in memory", "w", **plain) as file:
        if small:
            text = np.frombuffer(tree_text(tree), np.uint8)
            file.create_dataset(_PACKED, data=text, chunks=text.shape, compression="gzip", compression_opts=9)
        else:
            write_tree(file, tree)
        file.flush()
        return file.id.get_file_image()


def _short(room: int) -> Any:
    """Open an HDF5 file in memory with compact headers, without times or room for growth."""
    from h5py import h5f, h5p

    access, creation = h5p.create(h5p.FILE_ACCESS), h5p.create(h5p.FILE_CREATE)
    access.set_fapl_core(backing_store=False)
    # The same by every version of the library.
    access.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
    access.set_meta_block_size(0)
    creation.set_userblock(room)
    creation.set_obj_track_times(False)
    return h5f.create(b"in memory", h5f.ACC_TRUNC, creation, access)


def _number_bytes(node: Node) -> int:
    return (0 if node.value is None else node.value.nbytes) + sum(map(_number_bytes, node.children.values()))


def _has_blocks(node: Node) -> bool:
    return node.in_blocks or any(map(_has_blocks, node.children.values()))


def _stream(tree: Node, room: int, file: io.FileIO) -> None:
    """Write the HDF5 file behind the head's room, for content too large for memory."""
    import h5py

    careful = _Careful(file)
    try:
        with h5py.File(careful, "w", userblock_size=room) as opened:
            write_tree(opened, tree, careful.check)
    except (OSError, RuntimeError, ValueError, KeyError):
        # HDF5's own error on a full disk is dropped: `check` raises the reason.
        if careful.refused is None:
            raise
    careful.check()


class _Careful:
    """Unbuffered file that hides a full disk from HDF5, which would end the process, and records the error."""

    def __init__(self, file: io.FileIO) -> None:
        self._file = file
        self.refused: BaseException | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def write(self, data: Any) -> int:
        """Write all of it, or nothing after a failure."""
        self._tried(lambda: _write_all(self._file, data))
        return len(data)

    def truncate(self, size: int) -> int:
        """Truncate the file, or do nothing after a failure."""
        self._tried(lambda: self._file.truncate(size))
        return size

    def _tried(self, act: Callable[[], object]) -> None:
        if self.refused is None:
            try:
                act()
            except BaseException as reason:
                self.refused = reason

    def check(self) -> None:
        """Raise the recorded error."""
        if self.refused is not None:
            raise self.refused


def _write_all(file: io.FileIO, data: Any) -> None:
    """Write every byte: without a buffer, a call may write only some."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) :]
