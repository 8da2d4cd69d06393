"""Array that stays in its file: read in blocks, each verified by its digest.

It consists of a few numbers and words, so that it can be sent to a worker process, which opens the file itself. One
type serves arrays in a user's file and in a material's own file: both are read block by block, and a block that has
changed since it was first read is refused by the name of its file.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from ...runtime.remote import is_remote

#: A block: large enough that a disk reads it in one go, small enough that a few of them are nothing.
BLOCK_BYTES = 4 << 20
# Hint for a file that has changed.
_AGAIN = "put it back as it was, or import the material again: metamer catalogue import --again SOURCE"
# Bytes of a SHA-256.
_DIGEST = 32

#: One slice an axis.
Block = tuple[slice, ...]


def _nobody(read: int) -> None:
    """Ignore the count of bytes read."""


@dataclass(frozen=True)
class StoredArray:
    """An array in a file.

    Attributes
    ----------
    file : that contains it.
    place : the name of the data set in an HDF5 file; or the offset of the numbers in any other file, in bytes, in C
        order.
    shape, dtype : as of numpy; one axis or more.
    digests : the SHA-256 of each block (`blocks_of`), 32 bytes each, one behind the other; b"" before `sealed`.
    file_size : bytes of the whole file when it was sealed; 0 if unknown.
    heard : callback for every block read, in bytes; a `StoredArray` with one is not sent to other processes.
    """

    file: Path
    place: str | int
    shape: tuple[int, ...]
    dtype: np.dtype
    digests: bytes = field(default=b"", repr=False)
    file_size: int = 0
    heard: Callable[[int], None] = field(default=_nobody, repr=False, compare=False)
    _kept: list[tuple[int, np.ndarray]] = field(default_factory=list, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "dtype", np.dtype(self.dtype))
        wrong = not self.shape or min(self.shape) < 0 or self.dtype.kind not in "fiub"
        if wrong or (self.digests and len(self.digests) != _DIGEST * len(self.blocks())):
            found = f"{self.dtype} {self.shape}, {len(self.digests)} bytes of digests"
            raise InputError("not an array that can be stored", file=self.file, field=str(self.place), found=found)

    @property
    def nbytes(self) -> int:
        """Bytes of all its numbers."""
        return math.prod(self.shape) * self.dtype.itemsize

    @property
    def ndim(self) -> int:
        """Axes."""
        return len(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """Return the whole of it, in memory."""
        return np.asarray(self.read(), dtype=dtype)

    def blocks(self) -> list[Block]:
        """Blocks that are read and checked as a whole: see `blocks_of`."""
        return blocks_of(self.shape, self.dtype)

    def read(self, rows: slice = slice(None)) -> np.ndarray:
        """Read rows of the first axis, all by default, as an array of their own; raises as `chunks` does.

        A partially requested block is cached: the next rows are usually requested soon, and unpacking and checking a
        block takes far longer than copying some rows.
        """
        first, last, step = rows.indices(len(self))
        if step != 1:
            raise ValueError("rows that follow each other are read")
        for start, block in self._kept:
            if start <= first and last <= start + len(block):
                self._check_size()
                return block[first - start : last - start].copy()
        found = np.empty((max(0, last - first), *self.shape[1:]), self.dtype)
        for (along, *rest), block in self.chunks(slice(first, last)):
            low, high = max(along.start, first), min(along.stop, last)
            found[(slice(low - first, high - first), *rest)] = block[low - along.start : high - along.start]
            if high - low < len(block) and block.shape[1:] == self.shape[1:]:
                self._kept[:] = [(along.start, block)]
        return found

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for another process, where blocks are read."""
        return self.__dict__ | {"_kept": []}

    def chunks(self, rows: slice = slice(None)) -> Iterator[tuple[Block, np.ndarray]]:
        """Yield every block with some of these rows of the first axis, in C order: its place, and its numbers.

        Raises
        ------
        InputError : the file is missing or unreadable; it, or a block, has changed since it was sealed.
        """
        first, last, _ = rows.indices(len(self))
        with ExitStack() as stack:
            read = self._opened(stack)
            for number, where in self._touched(first, last):
                try:
                    block = np.ascontiguousarray(read(where))
                except (OSError, ValueError, RuntimeError) as reason:
                    raise self._unreadable(reason, _words(where)).at(file=self._place_of(where)) from None
                if self.digests and _digest(block) != self.digests[_DIGEST * number : _DIGEST * (number + 1)]:
                    raise self._changed(f"other numbers in {_words(where)}").at(file=self._place_of(where))
                self.heard(block.nbytes)
                yield where, block

    def sealed(self, also: Callable[[memoryview], None] = lambda data: None) -> StoredArray:
        """Return this array with its digests, computed by reading all of it once, or compared if it has some.

        also : receives the bytes of each block, in order: together they are the array's own.
        """
        size = _size_of(self.file)
        found = bytearray()
        for _, block in self.chunks():
            also(raw(block))
            found += _digest(block)
        return replace(self, digests=bytes(found), file_size=self.file_size or size, heard=_nobody)

    @property
    def is_there(self) -> bool:
        """True if the file exists, as far as this user may know."""
        return _size_of(self.file) > 0

    def check_is_there(self) -> None:
        """Raise `InputError` if the file is missing or has another size."""
        with ExitStack() as stack:
            self._opened(stack)

    def check(self) -> None:
        """Read and verify all of it; raises `InputError` as `chunks` does."""
        for _ in self.chunks():
            pass

    def _opened(self, stack: ExitStack) -> Callable[[Block], np.ndarray]:
        """Return the reader of blocks; the file is closed with `stack`."""
        try:
            self._check_size()
            if isinstance(self.place, int):
                self._check_length(self.place + self.nbytes)
                file = stack.enter_context(self.file.open("rb"))
                return lambda where: self._numbers(file, where)
            values: Any = stack.enter_context(hdf5_content(self.file))[self.place]
            if (values.shape, values.dtype) != (self.shape, self.dtype):
                raise self._changed(f"{values.dtype} {values.shape}", f"{self.dtype} {self.shape}")
            return values.__getitem__
        except FileNotFoundError:
            raise self._gone(self.file) from None
        except (OSError, KeyError, ValueError, AttributeError, RuntimeError) as reason:
            raise self._unreadable(reason) from None

    def _check_size(self) -> None:
        """Raise `InputError` if the file is missing or has another size than when it was sealed."""
        try:
            if self.file_size and (found := self.file.stat().st_size) != self.file_size:
                raise self._changed(f"{found} bytes", f"{self.file_size} bytes")
        except FileNotFoundError:
            raise self._gone(self.file) from None

    def _check_length(self, needed: int) -> None:
        if (found := self.file.stat().st_size) < needed:
            raise InputError(
                "the file is shorter than its array",
                file=self.file,
                field=self._where,
                found=f"{found} bytes",
                expected=f"{needed} bytes: {' x '.join(map(str, self.shape))} of {self.dtype}",
                hint="save it again from the program that made it, or fetch it again",
            )

    @property
    def _where(self) -> str:
        return f"byte {self.place}" if isinstance(self.place, int) else self.place

    def _numbers(self, file: Any, where: Block) -> np.ndarray:
        shape = tuple(along.stop - along.start for along in where)
        # A block is whole along its last axes, so that its numbers follow each other.
        first = np.ravel_multi_index([along.start for along in where], self.shape)
        file.seek(int(self.place) + int(first) * self.dtype.itemsize)
        data = file.read(math.prod(shape) * self.dtype.itemsize)
        return np.frombuffer(data, self.dtype).reshape(shape)

    def _touched(self, first: int, last: int) -> Iterator[tuple[int, Block]]:
        """Yield the blocks with some of these rows, with their numbers."""
        for number, where in enumerate(self.blocks()):
            if where[0].start < last and where[0].stop > first:
                yield number, where

    def _place_of(self, where: Block) -> Path:
        """Return the file that a block lies in."""
        return self.file

    def _gone(self, path: Path) -> InputError:
        expected = "the file that large arrays were left in"
        return InputError("no such file", file=path, expected=expected, hint=_AGAIN)

    def _unreadable(self, reason: Exception, where: str = "the array") -> InputError:
        # Exceptions of libraries may have no text.
        found = f"{where}: {str(reason) or type(reason).__name__}".split("\n")[0]
        return InputError("cannot be read", file=self.file, field=self._where, found=found, hint=_AGAIN)

    def _changed(self, found: str, expected: str = "the numbers that were there before") -> InputError:
        return InputError(
            "the file is not what it was",
            file=self.file,
            field=self._where,
            found=found,
            expected=expected,
            hint=_AGAIN,
        )


@contextmanager
def hdf5_content(path: Path) -> Iterator[Any]:
    """Open an HDF5 file for reading; behind a URL, errors of the store are raised, not those of HDF5."""
    import h5py

    if not is_remote(path):
        with h5py.File(path, "r") as file:
            yield file
        return
    source: Any = path.open("rb")
    try:
        with h5py.File(source, "r") as file:
            yield file
    except Exception:
        if source.refused is not None:
            raise source.refused from None
        raise


def blocks_of(shape: tuple[int, ...], dtype: np.dtype) -> list[Block]:
    """Return the blocks of an array in C order: whole along its last axes, at most `BLOCK_BYTES` each.

    >>> blocks_of((2, 3), np.dtype("f8"))
    [(slice(0, 2, None), slice(0, 3, None))]
    """
    axis, row = 0, math.prod(shape[1:]) * dtype.itemsize
    while row > BLOCK_BYTES and axis + 1 < len(shape):
        axis += 1
        row //= max(1, shape[axis])
    step = max(1, BLOCK_BYTES // max(1, row))
    # Along one axis some, along those before it one at a time.
    steps = [1] * axis + [step] + [max(1, size) for size in shape[axis + 1 :]]
    along = [
        [slice(first, min(first + step, size)) for first in range(0, size, step)]
        for size, step in zip(shape, steps, strict=True)
    ]
    return list(product(*along))


def chunks_of(array: StoredArray | np.ndarray) -> Iterator[tuple[Block, np.ndarray]]:
    """Yield the blocks of an array with their numbers, wherever they are."""
    if isinstance(array, StoredArray):
        yield from array.chunks()
    else:
        for where in blocks_of(array.shape, array.dtype):
            yield where, np.ascontiguousarray(array[where])


def digests_of(array: StoredArray | np.ndarray) -> bytes:
    """`StoredArray.digests` of an array, wherever it is."""
    known = array.digests if isinstance(array, StoredArray) else b""
    return known or b"".join(_digest(block) for _, block in chunks_of(array))


def _size_of(file: Path) -> int:
    try:
        return file.stat().st_size
    except OSError:
        return 0


def raw(block: np.ndarray) -> memoryview:
    """Return the bytes of an array in C order, without a copy."""
    return block.reshape(-1).view(np.uint8).data


def _digest(block: np.ndarray) -> bytes:
    return hashlib.sha256(raw(block)).digest()


def _words(where: Block) -> str:
    """Format a block for messages: `[0:4, 0:256]`."""
    return "[" + ", ".join(f"{along.start}:{along.stop}" for along in where) + "]"
