"""Cache of the heads of files behind a URL, in the user's cache directory: unchanged files are not requested again.

    metamer/remote-heads/DIGEST    SHA-256 of the rest, line feed; a line a file: JSON of its name, size and version,
                                   a tab, its head

A head is valid while the store lists the file with the recorded size and version: of the content (an ETag or a
checksum), or a time that was long past then. The cache may be deleted at any time, and a damaged one is rebuilt.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from ...runtime.disk_cache import cache_folder
from ...runtime.errors import InputError
from ...runtime.files import made_folder, written_whole
from ...runtime.remote import RemoteFile, RemotePath
from .record_head import HEAD_BYTES, head_from

_FOLDER = "remote-heads"


def remote_heads(
    folder: RemotePath, files: Sequence[RemoteFile], wanted: Collection[str] | None = None
) -> Iterator[tuple[RemoteFile, bytes | Exception]]:
    """Yield the beginning of each file, with its whole head, or the error in reading it; cached ones first.

    files : all listed ones. wanted : names of those requested; None: all.
    """
    path = cache_folder(_FOLDER) / hashlib.sha256(str(folder).encode()).hexdigest()
    before = _read(path)
    known = {_key(file): before[_key(file)] for file in files if file.settled and _key(file) in before}
    asked = [file for file in files if wanted is None or file.name in wanted]
    unread = [file for file in asked if _key(file) not in known]
    yield from ((file, known[_key(file)]) for file in asked if _key(file) in known)
    for file, begins in folder.beginnings(unread, HEAD_BYTES):
        if file.settled and isinstance(begins, bytes):
            with suppress(InputError):
                head_from(begins, folder / file.name)
                known[_key(file)] = begins.partition(b"\n")[0]
        yield file, begins
    if known.keys() != before.keys():
        # Without a cache, heads are read again.
        with suppress(InputError, OSError):
            _write(path, known)


def _key(file: RemoteFile) -> bytes:
    return json.dumps([file.name, file.size, file.version], separators=(",", ":")).encode()


def _read(path: Path) -> dict[bytes, bytes]:
    try:
        checksum, _, text = path.read_bytes().partition(b"\n")
    except OSError:
        return {}
    if hashlib.sha256(text).hexdigest().encode() != checksum:
        return {}
    return dict(line.split(b"\t", 1) for line in text.split(b"\n")[:-1])


def _write(path: Path, known: dict[bytes, bytes]) -> None:
    text = b"".join(key + b"\t" + head + b"\n" for key, head in known.items())
    made_folder(path.parent)
    with written_whole(path) as beside:
        beside.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text)
