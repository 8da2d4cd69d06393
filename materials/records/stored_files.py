"""Many files in place as one array of bytes: the concatenated images of a set."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from .stored_array import Block, StoredArray, blocks_of


@dataclass(frozen=True)
class StoredFiles(StoredArray):
    """Concatenated bytes of the files of one folder; each file is a block with a digest of its own.

    `file` is the folder, `place` 0, `shape` the number of all bytes, `dtype` uint8.

    Attributes
    ----------
    names : of the files, in order, relative to the folder, with / between folders.
    sizes : bytes of each.
    """

    names: tuple[str, ...] = ()
    sizes: tuple[int, ...] = ()

    @classmethod
    def of(cls, folder: Path, names: tuple[str, ...], digests: bytes = b"", sizes: tuple[int, ...] = ()) -> StoredFiles:
        """Return the files of these names, with current sizes unless `sizes` is given; OSError if one is missing."""
        sizes = sizes or tuple((folder / name).stat().st_size for name in names)
        return cls(folder, 0, (sum(sizes),), np.dtype(np.uint8), digests, 0, names=names, sizes=sizes)

    def blocks(self) -> list[Block]:
        """One block per file."""
        return [(slice(int(last) - size, int(last)),) for last, size in zip(self._ends, self.sizes, strict=True)]

    @property
    def is_there(self) -> bool:
        """True if all these files exist."""
        return all((self.file / name).is_file() for name in self.names)

    def _touched(self, first: int, last: int) -> Iterator[tuple[int, Block]]:
        """Yield the touched files as `StoredArray` does, without examining the thousands of others."""
        begin = int(np.searchsorted(self._ends, first, side="right"))
        for number in range(begin, len(self.sizes)):
            end = int(self._ends[number])
            if end - self.sizes[number] >= last:
                return
            if self.sizes[number]:
                yield number, (slice(end - self.sizes[number], end),)

    @property
    def _where(self) -> str:
        return "bytes"

    @cached_property
    def _ends(self) -> np.ndarray:
        return np.cumsum(np.asarray(self.sizes, dtype=np.int64))

    def _place_of(self, where: Block) -> Path:
        return self.file / self.names[int(np.searchsorted(self._ends, where[0].start, side="right"))]

    def _opened(self, stack: ExitStack) -> Callable[[Block], np.ndarray]:
        return self._read

    def _read(self, where: Block) -> np.ndarray:
        path, size = self._place_of(where), where[0].stop - where[0].start
        try:
            with path.open("rb") as file:
                data = file.read(size + 1)
        except FileNotFoundError:
            raise self._gone(path) from None
        if len(data) != size:
            found = f"{path.stat().st_size} bytes"
            raise self._changed(found, f"{size} bytes").at(file=path)
        return np.frombuffer(data, np.uint8)

    def check_is_there(self) -> None:
        """Raises `InputError` where a file is gone or has another size."""
        for name, size in zip(self.names, self.sizes, strict=True):
            path = self.file / name
            if not path.is_file():
                raise self._gone(path)
            if (found := path.stat().st_size) != size:
                raise self._changed(f"{found} bytes", f"{size} bytes").at(file=path)

    def joined(self) -> StoredArray:
        """Return the same bytes in blocks like those of any other array, for copying them into a record."""
        return _Joined(self.file, 0, self.shape, self.dtype, heard=self.heard, parts=self)


@dataclass(frozen=True)
class _Joined(StoredArray):
    """Bytes of files, read file by file and returned block by block."""

    parts: StoredFiles | None = None

    def chunks(self, rows: slice = slice(None)) -> Iterator[tuple[Block, np.ndarray]]:
        assert self.parts is not None
        waiting = iter(blocks_of(self.shape, self.dtype))
        where = next(waiting, None)
        pieces: list[np.ndarray] = []
        held = 0
        for _, piece in self.parts.chunks():
            pieces.append(piece)
            held += len(piece)
            while where is not None and held >= (size := where[0].stop - where[0].start):
                joined = np.concatenate(pieces)
                yield where, joined[:size]
                pieces, held, where = [joined[size:]], held - size, next(waiting, None)
