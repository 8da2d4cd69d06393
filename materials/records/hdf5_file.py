"""A tree as an HDF5 file behind a head, written so that a full disk is an exception.

HDF5 ends the whole process where it cannot write what it holds. What is small is made in memory, then written as a
whole; what is large goes, block by block, through a file that never tells the library.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .hdf5_tree import Node, write_tree


def write_behind(head: bytes, tree: Node, path: Path) -> None:
    """Write `head`, then the HDF5 file, to `path` and to the disk; raises OSError where there is no room.

    head : of a length that HDF5 allows for what comes before it: 512 bytes, doubled any number of times.
    """
    image = None if _has_blocks(tree) else _image(tree, len(head))
    with path.open("w+b", buffering=0) as file:
        if image is None:
            _stream(tree, len(head), file)
            file.seek(0)
        _write_all(file, head + (image or b""))
        os.fsync(file.fileno())


def _image(tree: Node, room: int) -> bytes:
    """Return the HDF5 file behind the head, made in memory: the library ends the whole process where a disk gets
    full."""
    import h5py

    with h5py.File("in memory", "w", driver="core", backing_store=False, userblock_size=room) as file:
        write_tree(file, tree)
        file.flush()
        return file.id.get_file_image()


def _has_blocks(node: Node) -> bool:
    return node.in_blocks or any(map(_has_blocks, node.children.values()))


def _stream(tree: Node, room: int, file: io.FileIO) -> None:
    """The HDF5 file behind the room for the head, for what is too large to be made in memory."""
    import h5py

    careful = _Careful(file)
    try:
        with h5py.File(careful, "w", userblock_size=room) as opened:
            write_tree(opened, tree, careful.check)
    except (OSError, RuntimeError, ValueError, KeyError):
        # What HDF5 makes of a disk that takes no more is not worth telling.
        if careful.refused is None:
            raise
    careful.check()


class _Careful:
    """A file without a buffer that never tells HDF5 of a full disk, over which the library would end the whole process:
    it keeps the reason, and writes no more."""

    def __init__(self, file: io.FileIO) -> None:
        self._file = file
        self.refused: BaseException | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def write(self, data: Any) -> int:
        """Write all of it, or do nothing once that has failed."""
        self._tried(lambda: _write_all(self._file, data))
        return len(data)

    def truncate(self, size: int) -> int:
        """Make the file so long, or do nothing once something has failed."""
        self._tried(lambda: self._file.truncate(size))
        return size

    def _tried(self, act: Callable[[], object]) -> None:
        if self.refused is None:
            try:
                act()
            except BaseException as reason:
                self.refused = reason

    def check(self) -> None:
        """Raise what writing met."""
        if self.refused is not None:
            raise self.refused


def _write_all(file: io.FileIO, data: Any) -> None:
    """Write every byte: without a buffer, a call may write some."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) :]
