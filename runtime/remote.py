"""Read-only folders behind a URL of fsspec (S3, SSH, zip files, HTTP), with files read in ranges.

A `RemotePath` replaces the `Path` of a folder or file. Each answer of the store has a timeout of `ANSWER_S` seconds,
and its length is checked, since libraries may read missing bytes as zeros.
"""

from __future__ import annotations

import fnmatch
import hashlib
import io
import os
import re
import stat
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

from .distribution import install_hint
from .errors import InputError, MetamerError

#: Longest wait for one answer of a store, seconds.
ANSWER_S = 60.0
#: Bytes that are asked for at least, and kept: a small record needs one block. Blocks of a file that are kept.
BLOCK_BYTES, _BLOCKS = 1 << 20, 16
# Beginnings of files that are asked for at once.
_AT_ONCE = 64
# Age of a file whose time tells it from others: some stores count whole seconds, and their clocks may be slow.
_SETTLED_S = 3600.0
_HOST_KEYS = ("~/.ssh/known_hosts", "/etc/ssh/ssh_known_hosts")
# A drive of Windows has one letter.
_URL = re.compile(r"([a-z][a-z0-9+.-]+)(?:://|::)", re.IGNORECASE)
_CREDENTIALS = re.compile(r"://[^/@:]*:[^/@]*@")
# Marks of a file's version, by the names that stores have for them: of its content, or its time.
_BY_CONTENT, _BY_TIME = ("ETag", "etag", "CRC"), ("mtime", "LastModified", "last_modified", "updated", "created")
_COPY = "make or change the catalogue in a folder here, then copy it with the store's own tool, such as rclone"
_ACCESS = "check the address, the network and your access to the store"

Result = TypeVar("Result")
if TYPE_CHECKING:
    _Path = Path
else:
    _Path = type(Path())


@dataclass(frozen=True)
class RemoteFile:
    """Listing entry of a file: its name below the folder, its size, and a version text.

    size, version : None if the store does not report it. settled : True if the version certainly changes with the file:
    it is of the content, or of a time long past.
    """

    name: str
    size: int | None
    version: str | None
    settled: bool = False


def place(path: str | Path) -> Path:
    """Return a path as given; for a URL such as "s3://bucket/paints" a remote one."""
    if isinstance(path, RemotePath):
        return path
    return RemotePath(path) if isinstance(path, str) and _URL.match(path) else Path(path)


def is_remote(path: str | Path) -> bool:
    """Return whether a path, or a text for one, is behind a URL."""
    return isinstance(place(path), RemotePath)


def local_folder(path: str | Path, does: str) -> Path:
    """Return the path of a local folder; raises `InputError` for a URL. does : purpose, as a clause."""
    path = place(path)
    if isinstance(path, RemotePath):
        expected = "a folder of this machine"
        raise InputError(f"{does} needs a folder, not a URL", file=path, expected=expected, hint=_COPY)
    return path


class UnlistedError(InputError):
    """Error of a store that cannot list files; files given by name can be read."""


class RemotePath(_Path):
    """Read-only path of a folder or file behind a URL; writing raises `InputError`.

    url : of the folder that fsspec opens. inside : path below it, with / between names.
    """

    def __new__(cls, url: str, inside: str = "") -> RemotePath:
        """Make a path. A `Path` made from it contains a NUL, which no system accepts as a local path."""
        return super().__new__(cls, f"\0{url}/{inside}")

    def __init__(self, url: str, inside: str = "") -> None:
        if sys.version_info >= (3, 12):
            super().__init__(f"\0{url}/{inside}")
        # "zip::s3://..." is short for "zip://::s3://...".
        scheme, chained, rest = url.partition("::")
        self.url = url if not chained or "://" in scheme else f"{scheme}://::{rest}"
        self.inside = inside.strip("/")
        self._blocks: _Blocks | None = None
        # Found by `is_file`, for `open` right after.
        self._found: dict[str, Any] | None = None
        if _CREDENTIALS.search(url) or "?" in url:
            hint = "give them as the store's own tools take them: environment variables, configuration, SSH keys"
            shown = _CREDENTIALS.sub("://***@", url.partition("?")[0])
            raise InputError("an address with credentials", file=shown, found="a password, or ?...", hint=hint)

    def __reduce__(self) -> Any:
        return RemotePath, (self.url, self.inside)

    def __str__(self) -> str:
        outer, chained, rest = self.url.partition("::")
        if self.inside:
            outer = f"{outer}{'' if outer.endswith('/') else '/'}{self.inside}"
        return outer + chained + rest

    def __repr__(self) -> str:
        return f"RemotePath({str(self)!r})"

    def __fspath__(self) -> str:
        """Raise `InputError`: callers that need a system path would read or write something else."""
        expected = "a folder or file of this machine"
        raise InputError("this cannot be done behind a URL", file=str(self), expected=expected, hint=_COPY)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RemotePath) and (self.url, self.inside) == (other.url, other.inside)

    def __hash__(self) -> int:
        return hash((self.url, self.inside))

    def __truediv__(self, key: Any) -> RemotePath:
        return RemotePath(self.url, f"{self.inside}/{key}")

    @property
    def parent(self) -> RemotePath:
        """Containing folder; of the outermost folder itself."""
        return RemotePath(self.url, self.inside.rpartition("/")[0])

    @property
    def name(self) -> str:
        """Last name of the path."""
        return (self.inside or self.url.rstrip("/:")).rpartition("/")[2]

    def absolute(self) -> RemotePath:
        """Return the path without cached content."""
        return RemotePath(self.url, self.inside)

    def resolve(self, strict: bool = False) -> RemotePath:
        """Return the path itself."""
        return self.absolute()

    def is_file(self, **how: Any) -> bool:
        """Return whether the file exists; raises `InputError` if that is unknown."""
        try:
            self._found = self._information()
        except FileNotFoundError:
            return False
        return self._found["type"] == "file"

    def is_dir(self, **how: Any) -> bool:
        """Return whether the folder exists, in stores that report it; raises `InputError` if that is unknown."""
        return self._answer("whether it is a folder", lambda system, at: bool(system.isdir(at)))

    def exists(self, **how: Any) -> bool:
        """Return whether the file or folder exists."""
        return self.is_file() or self.is_dir()

    def stat(self, **how: Any) -> os.stat_result:
        """Return size and time of the file, with a hash of its version as inode; FileNotFoundError if it is missing."""
        found = self._information()
        version = hashlib.sha256(repr(_version(found)).encode()).digest()
        fields = [stat.S_IFREG, int.from_bytes(version[:7], "big"), 0, 1, 0, 0, self._size_in(found), 0, 0, 0]
        return os.stat_result(fields, {"st_mtime_ns": int((_time(found) or 0.0) * 1e9)})

    def open(self, mode: str = "rb", *unused: Any, **how: Any) -> Any:
        """Open the file for reading in ranges; FileNotFoundError if it is missing."""
        if mode != "rb":
            return os.fspath(self)
        found, self._found = self._found or self._information(), None
        size, version = self._size_in(found), _version(found)
        blocks = self._blocks
        if blocks is None or (blocks.size, blocks.version) != (size, version):
            blocks = self._blocks = _Blocks(self, size, version)
        return _RangeReader(blocks)

    def read_bytes(self) -> bytes:
        """Return all bytes of a small file, below a block, by one request; FileNotFoundError if it is missing."""
        data = self.first_bytes(BLOCK_BYTES)
        if len(data) == BLOCK_BYTES:
            found, expected = f"{BLOCK_BYTES} bytes or more", "a small file"
            raise InputError("too large to be read at once", file=self, found=found, expected=expected)
        return data

    def read_text(self, encoding: str | None = None, errors: str | None = None, newline: str | None = None) -> str:
        """Return the text of a small file, as of `read_bytes`."""
        return self.read_bytes().decode(encoding or "utf-8", errors or "strict")

    def rglob(self, pattern: str, **how: Any) -> Generator[RemotePath, None, None]:
        """Yield files below whose names match a pattern, from a listing."""
        for file in self.files():
            if fnmatch.fnmatchcase(file.name.rpartition("/")[2], pattern):
                yield self / file.name

    def files(self) -> tuple[RemoteFile, ...]:
        """List all files below, sorted by name, in one request or one per thousand.

        Raises
        ------
        InputError : the store cannot list files, or does not answer.
        """

        def listed(system: Any, at: str) -> tuple[str, dict[str, Any]]:
            if {"http", "https"} & set(_protocols(system)):
                raise NotImplementedError("a web server lists no files")
            system.invalidate_cache()
            return at.strip("/"), system.find(at, detail=True)

        top, found = self._answer("a list of its files", listed)
        return tuple(
            RemoteFile(path.strip("/")[len(top) :].strip("/"), entry.get("size"), _version(entry), _is_settled(entry))
            for path, entry in sorted(found.items())
            if entry.get("type") == "file"
        )

    def first_bytes(self, count: int) -> bytes:
        """Return the first `count` bytes of the file, or all of a shorter one, by one request.

        Raises
        ------
        FileNotFoundError : there is no such file. InputError : it cannot be read.
        """
        known = None if self._blocks is None else self._blocks.beginning(count)
        return known if known is not None else self._checked(self._range(0, count), count, None)

    def beginnings(self, files: Sequence[RemoteFile], count: int) -> Iterator[tuple[RemoteFile, bytes | Exception]]:
        """Yield `first_bytes` of files below, many at once: the bytes of each, or its error."""
        for first in range(0, len(files), _AT_ONCE):
            some = files[first : first + _AT_ONCE]
            ends = [count if file.size is None else min(count, file.size) for file in some]

            def asked(system: Any, at: str, some: Sequence[RemoteFile] = some, ends: list[int] = ends) -> list[Any]:
                paths = [_joined(at, file.name) for file in some]
                return system.cat_ranges(paths, [0] * len(paths), ends, on_error="return")

            for file, end, data in zip(some, ends, self._answer(f"{len(some)} heads", asked), strict=True):
                path = self / file.name
                if isinstance(data, FileNotFoundError):
                    yield file, data
                elif isinstance(data, BaseException):
                    yield file, path._refusal(f"{end} bytes from its beginning", data)
                else:
                    try:
                        yield file, path._checked(bytes(data), end, file.size)
                    except InputError as reason:
                        yield file, reason

    def read_range(self, start: int, stop: int) -> bytes:
        """Return the bytes from `start` to `stop`, all of them; raises `InputError` for fewer or more."""
        try:
            return self._checked(self._range(start, stop), stop - start, stop)
        except FileNotFoundError:
            expected = f"bytes {start} to {stop}, as when it was opened"
            raise InputError("the file is gone", file=self, expected=expected, hint=_ACCESS) from None

    def _range(self, start: int, stop: int) -> bytes:
        def asked(system: Any, at: str) -> bytes:
            return bytes(system.cat_file(at, start=start, end=stop))

        return self._answer(f"bytes {start} to {stop}", asked)

    def _checked(self, data: bytes, asked: int, size: int | None) -> bytes:
        """Return an answer of the requested length; a shorter one only if the `size` was unknown."""
        if len(data) > asked:
            hint = "use a server that answers requests of ranges, or read a copy of the catalogue in a folder here"
            found, expected = f"{len(data)} bytes", f"{asked} bytes, the range that was asked for"
            raise InputError("the store gives whole files", file=self, found=found, expected=expected, hint=hint)
        if size is not None and len(data) < asked:
            hint = "try again; if it stays so, copy the file to the store again"
            found, expected = f"{len(data)} bytes", f"{asked} bytes, of the size that the store states"
            raise InputError("the answer is cut short", file=self, found=found, expected=expected, hint=hint)
        return data

    def _size_in(self, found: dict[str, Any]) -> int:
        size = found.get("size")
        if size is None:
            hint = "use a server that states sizes, or read a copy of the catalogue in a folder here"
            raise InputError("the store does not say how large the file is", file=self, hint=hint)
        return int(size)

    def _information(self) -> dict[str, Any]:
        def asked(system: Any, at: str) -> dict[str, Any]:
            # A listing from before may be out of date.
            system.invalidate_cache()
            return system.info(at)

        return self._answer("its size", asked)

    def _place(self) -> tuple[Any, str]:
        """Return the file system and the path in it."""
        system, top = _system(self.url)
        return system, _joined(top, self.inside)

    def _answer(self, expected: str, ask: Callable[[Any, str], Result]) -> Result:
        """Query the store, with a timeout of `ANSWER_S`; FileNotFoundError if there is no such file.

        Raises
        ------
        InputError : no answer, a refusal, or a package is missing.
        """
        answers: SimpleQueue[tuple[bool, Any]] = SimpleQueue()

        def work() -> None:
            try:
                answers.put((True, ask(*self._place())))
            except BaseException as reason:
                answers.put((False, reason))

        # No library has a limit of its own on all that may be slow; whoever does not answer is left behind.
        threading.Thread(target=work, daemon=True, name="store").start()
        try:
            answered, result = answers.get(timeout=ANSWER_S)
        except Empty:
            found = f"nothing in {ANSWER_S:g} s"
            raise InputError("no answer", file=self, found=found, expected=expected, hint=_ACCESS) from None
        if answered:
            return result
        if isinstance(result, FileNotFoundError | MetamerError):
            raise result
        raise self._refusal(expected, result) from None

    def _refusal(self, expected: str, reason: BaseException) -> InputError:
        said = f"{type(reason).__name__}: {reason}".split("\n")[0]
        if isinstance(reason, ImportError):
            expected = "fsspec's package for such addresses"
            hint = f"{install_hint('remote')} has those for S3, SSH and HTTP"
            return InputError("a package is missing", file=self, found=str(reason), expected=expected, hint=hint)
        if isinstance(reason, NotImplementedError):
            hint = "name materials by their ids; or pack the catalogue: zip://::https://HOST/FILE.zip"
            return UnlistedError("cannot be listed", file=self, found=said, expected=expected, hint=hint)
        if isinstance(reason, PermissionError) or getattr(reason, "status", None) in (401, 403):
            hint = "check your credentials and what they allow, as the store's own tools take them"
            return InputError("access is denied", file=self, found=said, expected=expected, hint=hint)
        return InputError("cannot be reached or read", file=self, found=said, expected=expected, hint=_ACCESS)


class _Blocks:
    """Cache of the last blocks of a remote file, shared by its readers."""

    def __init__(self, path: RemotePath, size: int, version: str | None) -> None:
        self.size, self.version = size, version
        self._path, self._lock = path.absolute(), threading.Lock()
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    def beginning(self, count: int) -> bytes | None:
        """Return the first `count` bytes, or all of a shorter file; None if that block is not cached."""
        with self._lock:
            first = self._kept.get(0)
        return None if first is None or len(first) < min(count, self.size) else first[:count]

    def read(self, start: int, stop: int) -> bytes:
        """Return the bytes from `start` to `stop`; missing blocks are requested together."""
        first, last = start // BLOCK_BYTES, (stop - 1) // BLOCK_BYTES
        with self._lock:
            missing = [number for number in range(first, last + 1) if number not in self._kept]
            if missing:
                low, high = missing[0] * BLOCK_BYTES, min((missing[-1] + 1) * BLOCK_BYTES, self.size)
                data = self._path.read_range(low, high)
                for number in range(missing[0], missing[-1] + 1):
                    begin = number * BLOCK_BYTES - low
                    self._kept[number] = data[begin : begin + BLOCK_BYTES]
            for number in range(first, last + 1):
                self._kept.move_to_end(number)
            found = b"".join(self._kept[number] for number in range(first, last + 1))
            while len(self._kept) > _BLOCKS:
                self._kept.popitem(last=False)
        return found[start - first * BLOCK_BYTES : stop - first * BLOCK_BYTES]


class _RangeReader(io.RawIOBase):
    """Reader of a remote file, with a position.

    refused : the first error in reading, which libraries may hide.
    """

    def __init__(self, blocks: _Blocks) -> None:
        self.refused: Exception | None = None
        self._blocks, self._at = blocks, 0

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def tell(self) -> int:
        """Return the position."""
        return self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Set the position."""
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._blocks.size}[whence]
        return self._at

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer, up to the end of the file."""
        view = memoryview(buffer).cast("B")
        stop = min(self._at + len(view), self._blocks.size)
        done = 0
        try:
            while self._at < stop:
                # Blocks that are asked for at once are no more than are kept.
                end = min(stop, (self._at // BLOCK_BYTES + _BLOCKS) * BLOCK_BYTES)
                data = self._blocks.read(self._at, end)
                view[done : done + len(data)] = data
                done, self._at = done + len(data), end
        except Exception as reason:
            self.refused = self.refused or reason
            raise
        return done


_systems: dict[str, tuple[Any, str]] = {}


def open_anew(path: Path) -> None:
    """Drop the cached state of an address, since the list of files of a zip file is read once."""
    if isinstance(path, RemotePath):
        _systems.pop(path.url, None)


def _system(url: str) -> tuple[Any, str]:
    """Return the file system of a URL and the path of its folder."""
    if url not in _systems:
        _systems[url] = file_system(url)
    return _systems[url]


def file_system(url: str) -> tuple[Any, str]:
    """Open the file system of a URL; return it with the path in it; raises the errors of its library."""
    import fsspec

    over_ssh = set(re.findall(r"(?:^|::)(sftp|ssh)://", url))
    return fsspec.core.url_to_fs(url, **{name: {"host_key_policy": _known_hosts()} for name in over_ssh})


@cache
def _known_hosts() -> type:
    """Return the policy that an SSH server must have a known key; fsspec's default accepts any."""
    import paramiko

    class KnownHosts(paramiko.MissingHostKeyPolicy):
        def missing_host_key(self, client: Any, hostname: str, key: Any) -> None:
            known = paramiko.HostKeys()
            for file in _HOST_KEYS:
                with suppress(OSError):
                    known.load(str(Path(file).expanduser()))
            if not known.check(hostname, key):
                raise PermissionError(f"{hostname} has the key {key.fingerprint}, which is not in {_HOST_KEYS[0]}")

    return KnownHosts


def _protocols(system: Any) -> tuple[str, ...]:
    return (system.protocol,) if isinstance(system.protocol, str) else tuple(system.protocol)


def _joined(top: str, inside: str) -> str:
    return f"{top.rstrip('/')}/{inside}" if top and inside else inside or top


def _version(found: dict[str, Any]) -> str | None:
    """Return the text that distinguishes versions of a file; None if the store has none."""
    said = {name: str(found[name]) for name in (*_BY_CONTENT, *_BY_TIME) if found.get(name) is not None}
    return repr(said) if said else None


def _is_settled(found: dict[str, Any]) -> bool:
    """Return whether size and `_version` certainly identify the version of a file."""
    if found.get("size") is None:
        return False
    written = _time(found)
    return any(found.get(name) for name in _BY_CONTENT) or (written is not None and written < time.time() - _SETTLED_S)


def _time(found: dict[str, Any]) -> float | None:
    """Return the time of writing of a file, in seconds."""
    for name in _BY_TIME:
        value = found.get(name)
        if isinstance(value, datetime):
            return value.timestamp()
        if isinstance(value, int | float):
            return float(value)
    return None
