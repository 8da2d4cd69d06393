"""Files that are either complete or absent."""

from __future__ import annotations

import errno
import glob
import os
import re
import shutil
import stat
import uuid
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from .errors import InputError, NoRoomError, UsageError
from .locks import made_and_held, remove_abandoned
from .private_folder import private_folder
from .remote import local_folder
from .shutdown import clearing

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MAKE_ROOM = "make room, or name a folder on another disk; then give the same command again"
_HINTS = dict.fromkeys(_NO_ROOM, MAKE_ROOM) | {
    errno.EACCES: "look who may read and write the file, and open the folders above it",
    errno.EPERM: "look who may read and write the file, and open the folders above it",
    errno.EROFS: "name a folder on a disk that can be written to",
    errno.ENOENT: "check the path; relative paths start at the current folder",
    errno.ENOTDIR: "check the path: something above the file is no folder",
    errno.EISDIR: "name a file, not a folder",
    errno.ENAMETOOLONG: "give it a shorter name",
    errno.EMFILE: "allow more open files (ulimit -n)",
    errno.EIO: "the disk, or the network that it is on, failed: try again, and look at its health",
}
# Name of the file that `made_folder` tries to write.
_TRIAL = ".writable"
# Names made by `_name_beside`; the trial, which has no suffix, also once it has its name.
_BESIDE = re.compile(r"\.(?P<stem>.+)\.[0-9a-f]{8}(?P<suffix>\.[^.]+)?")


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it is renamed on success, and removed on any failure or signal.

    A link stays a link: its target is written. A device or a pipe receives the whole file on success.

    Raises
    ------
    InputError, NoRoomError
        The folder is missing or unwritable; it has no room for the file.
    """
    path = Path(path)
    if takes_bytes(path):
        with private_folder() as folder:
            whole = folder / path.name
            whole.touch()
            yield whole
            _send(whole, path)
        return
    path = _behind_links(path)
    if not path.parent.is_dir():
        raise InputError("no such folder to write to", file=path.parent, hint="make the folder first, or name another")
    beside = path.with_name(_name_beside(path))
    with clearing(lambda: _remove(beside)), ExitStack() as stack:
        try:
            stack.enter_context(made_and_held(beside, beside.touch))
        except OSError as reason:
            raise InputError(
                "the folder cannot be written to",
                file=path.parent,
                found=reason.strerror,
                hint="name a folder that you may write to",
            ) from None
        try:
            yield beside
            beside.replace(path)
        except OSError as reason:
            if reason.errno not in _NO_ROOM:
                raise
            expected = "room on its disk; what was there before is still there"
            raise NoRoomError(
                "no room for the file", file=path, found=reason.strerror, expected=expected, hint=MAKE_ROOM
            ) from None


def takes_bytes(path: Path) -> bool:
    """Return whether `path` is a device, a pipe or a link to one, which is written to and not replaced."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    # /dev/stdout is a link to whatever that is: another file in its place would not be seen by who reads it.
    passed_on = path.is_symlink() and path.absolute().parts[1:2] in (("dev",), ("proc",))
    return passed_on or not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _behind_links(path: Path) -> Path:
    if not path.is_symlink():
        return path
    found = Path(os.path.realpath(path))
    if found.is_symlink():
        raise InputError("a link that leads to itself", file=path, hint="remove the link, or name another file")
    return found


def _send(whole: Path, path: Path) -> None:
    """Write a file's bytes to a device or a pipe."""
    try:
        with whole.open("rb") as source, path.open("wb") as target:
            shutil.copyfileobj(source, target)
    except BrokenPipeError:
        raise
    except OSError as reason:
        kind = NoRoomError if reason.errno in _NO_ROOM else InputError
        hint = "name a file, or a device or pipe that takes what is written to it"
        raise kind("cannot be written to", file=path, found=reason.strerror, hint=hint) from None


def _remove(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def _name_beside(path: Path) -> str:
    return f".{path.stem}.{uuid.uuid4().hex[:8]}{path.suffix}"


def half_written(folder: Path, suffixes: Collection[str] | None = None) -> tuple[Path, ...]:
    """Find files below `folder` that `written_whole` did not finish; without a writer, a killed process left them.

    suffixes : only of files with such a final suffix, as ".h5", and test files of `made_folder`; default: all.
    """
    found = (path for path in folder.rglob(".*") if _is_half_written(path.name, suffixes) and path.is_file())
    return tuple(sorted(found))


def _is_half_written(name: str, suffixes: Collection[str] | None) -> bool:
    beside = _BESIDE.fullmatch(name)
    if name == _TRIAL or (beside and beside["stem"] == _TRIAL and beside["suffix"] is None):
        return True
    return beside is not None and (suffixes is None or (beside["suffix"] or "") in suffixes)


def check_writable(path: str | Path) -> None:
    """Raise the errors of `written_whole` in advance, before the work; an existing file is not touched.

    Leftovers of a killed process for that file are removed.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError("a folder, where a file is to be written", file=path, hint="name a file")
    if takes_bytes(path):
        if not os.access(path, os.W_OK):
            hint = "name a file, or a device or pipe that takes what is written to it"
            raise InputError("cannot be written to", file=path, found="no permission to write", hint=hint)
        return
    path = _behind_links(path)
    for stray in path.parent.glob(f".{glob.escape(path.stem)}.*{glob.escape(path.suffix)}"):
        found = _BESIDE.fullmatch(stray.name)
        if found and found["stem"] == path.stem and (found["suffix"] or "") == path.suffix:
            remove_abandoned(stray)
    with suppress(_Probed), written_whole(path):
        raise _Probed


def check_outputs(outputs: Iterable[str | Path], read: Iterable[str | Path] = ()) -> None:
    """Raise the errors of `check_writable`, and refuse one file for two outputs, or one that the same command reads.

    read : files, folders of files and other words, such as ids.
    """
    taken: dict[str, str | Path] = {}
    inputs = {os.path.realpath(one) for path in read for one in _files_in(Path(path))}
    for path in outputs:
        check_writable(path)
        if takes_bytes(Path(path)):
            continue
        place = os.path.realpath(path)
        if place in inputs:
            raise UsageError(f"{path}: this command reads the file and would write over it, name another file")
        if place in taken:
            raise UsageError(f"{path}, {taken[place]}: one file for two outputs, name a file for each")
        taken[place] = path


def _files_in(path: Path) -> Iterator[Path]:
    try:
        if path.is_dir():
            yield from (one for one in path.iterdir() if one.is_file())
        elif path.is_file():
            yield path
        elif (named := Path(str(path).rpartition("#")[0])).is_file():
            yield named
    except (OSError, ValueError):
        # Nothing to be read stands there; whoever reads it says so.
        return


class _Probed(Exception):
    """Exception that ends the test write of a file."""


def of_the_system(reason: OSError, place: str | Path | None = None) -> InputError:
    """Describe a failure of the system: its file, or else `place`, the error, and the remedy."""
    file = reason.filename if reason.filename is not None else place
    kind = NoRoomError if reason.errno in _NO_ROOM else InputError
    to = f"; to {reason.filename2}" if reason.filename2 is not None else ""
    return kind(
        "cannot be read or written",
        file=os.fsdecode(file) if isinstance(file, bytes) else file,
        found=f"{reason.strerror or reason}{to}",
        hint=_HINTS.get(reason.errno or 0),
    )


def existing_file(path: str | Path) -> Path:
    """Return the path of an existing file; otherwise raise an `InputError` that names it."""
    path = Path(path)
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError, ValueError):
        pass
    except OSError as reason:
        # A folder above it that may not be looked into, a name that is too long.
        raise of_the_system(reason, path) from None
    if not path.exists():
        raise InputError("no such file", file=path, hint="check the path; relative paths start at the current folder")
    if not path.is_file():
        found, hint = ("a folder", "name a file in it") if path.is_dir() else ("something else", None)
        raise InputError("not a file", file=path, found=found, expected="a file", hint=hint)
    return path


def read_bytes(path: str | Path, expected: str) -> bytes:
    """Return all bytes of a file; `expected` names its kind, for messages.

    Raises
    ------
    InputError
        There is none, or it cannot be read.
    """
    try:
        return Path(path).read_bytes()
    except OSError as reason:
        raise InputError(
            "cannot be read",
            file=path,
            field="file",
            found=reason.strerror or str(reason),
            expected=expected,
            hint=_HINTS.get(reason.errno or 0, "check the name and the permissions of the file"),
        ) from None


def read_text(path: str | Path, expected: str = "text with numbers in columns") -> str:
    """Return a text file's content, UTF-8 with or without a byte-order mark; binary files are refused by name.

    expected : its kind, for messages.
    """
    path = existing_file(path)
    data = read_bytes(path, expected)
    if not data.strip():
        raise InputError(
            "the file is empty",
            file=path,
            found="nothing but white space" if data else "0 bytes",
            expected="text",
            hint="export or copy it again",
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise InputError("not a text file", file=path, found=f"first bytes {data[:8]!r}", expected=expected)
    return text


def made_folder(path: str | Path) -> Path:
    """Return the folder, made if missing; raises an `InputError` if it cannot be made or written to."""
    path = local_folder(path, "what is written")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        raise InputError(
            "the folder cannot be made",
            file=path,
            found=reason.strerror,
            hint="name a folder that you may write to (-o, --catalogue)",
        ) from None
    # Another process may be asking the same of this folder.
    with clearing(lambda: _remove(path / _TRIAL)), written_whole(path / _TRIAL):
        pass
    return path
