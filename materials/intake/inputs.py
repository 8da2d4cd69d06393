"""Inputs of an import: files, folders, patterns, zip files and remote places, as a list of readable files."""

from __future__ import annotations

import glob
import os
import re
import struct
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ...runtime.errors import InputError
from ...runtime.private_folder import private_folder
from ...runtime.remote import file_system
from ..formats.input_file import InputFile, head_of, is_zip
from ..records.record import MARKER
from ..records.source import Rejected
from .archives import FOREIGN, MOST_BYTES, MOST_MEMBERS, is_hidden, unpacked

# Suffix of a name that tells the kind of file; "run 1.2" has none.
_KIND = re.compile(r"\.[a-z]\w*")
_DOCUMENTS = (".xlsx", ".xlsm", ".xlsb", ".ods", ".docx", ".npz", ".usdz", ".kmz", ".jar", ".sbsar", ".procspec")
# Members that programs put into the documents that they pack, and nobody into an archive of measurements.
_PROGRAMS = re.compile(r"\[Content_Types\]\.xml|mimetype|META-INF/MANIFEST\.MF|OOI(?:Signatures\.xml|Version\.txt)")
_CHUNK = 1 << 20


@contextmanager
def inputs_of(words: Iterable[str | Path]) -> Iterator[tuple[InputFile | Rejected, ...]]:
    """Yield every file that `words` denote, in a fixed order, each once.

    A word is a file, a folder (with all below it, hidden files left out), a pattern (`*`, `?`, `[...]`, `**`; quoted
    ones reach here as they are), or an address of fsspec (`s3://...`, `memory://...`, `zip://member::file.zip`): of a
    file, a folder or a pattern. Zip files are opened, unless they are inside another one. Remote and packed files are
    copied to a private folder, which is removed at the end.

    Raises
    ------
    InputError
        A word without any file: no such file, an empty folder, a pattern without matches, an unreachable place.
    """
    with private_folder() as private:
        found: dict[Path, InputFile | Rejected] = {}
        for number, word in enumerate(words):
            for entry in _word(str(word), private / str(number)):
                found.setdefault(entry.path if isinstance(entry, InputFile) else Path(entry.name), entry)
        yield tuple(found.values())


def _word(word: str, private: Path) -> Iterator[InputFile | Rejected]:
    if "://" in word or "::" in word:
        files = _fetched(word, private / "remote")
    elif os.path.lexists(word):
        files = _local(Path(word))
    elif glob.has_magic(word):
        files = _matching(word)
    else:
        hint = "check the path; relative paths start at the current folder"
        raise InputError("no such file or folder", file=word, hint=hint)
    for number, file in enumerate(files):
        yield from _opened(file, private / str(number))


def _local(path: Path, named: bool = True) -> Iterator[InputFile]:
    if path.is_file():
        yield InputFile(path, str(path), named)
        return
    if not path.is_dir():
        found = "a broken link" if path.is_symlink() else "a device"
        hint = "name the file that holds the measurements"
        raise InputError("not a file or folder", file=path, found=found, expected="a file or a folder", hint=hint)
    if (path / MARKER).is_file():
        hint = "name the measurements that it was made from; `metamer catalogue list` shows what is in it"
        raise InputError("a catalogue, which is what an import makes", file=path, hint=hint)
    files = []
    # Links to folders are not followed: they may lead round in circles.
    for here, folders, names in os.walk(path):
        # A catalogue may lie beside what it was made from.
        folders[:] = [name for name in folders if not is_hidden((name,)) and not (Path(here) / name / MARKER).is_file()]
        files += [Path(here) / name for name in names if not is_hidden((name,))]
    # A pipe or a device would wait for ever.
    files = sorted(file for file in files if file.is_file())
    if not files:
        found = "no files but hidden ones" if any(path.iterdir()) else "an empty folder"
        hint = "name the folder or the files of the measurements; metamer catalogue import --help names the formats"
        if any(one.is_symlink() and one.is_dir() for one in path.iterdir()):
            found, hint = "links to folders, which are not followed", "name the folders that they lead to"
        raise InputError("nothing to import", file=path, found=found, expected="files of materials", hint=hint)
    yield from (InputFile(file, str(file), False) for file in files)


def _matching(pattern: str) -> Iterator[InputFile]:
    found = map(Path, sorted(glob.glob(pattern, recursive=True)))  # noqa: PTH207 (the pattern may be absolute)
    found = [path for path in found if not set(path.parts) & set(FOREIGN)]
    if not found:
        raise InputError("no file fits the pattern", file=pattern, hint="check the folder and the pattern")
    for path in found:
        if path.is_file():
            yield InputFile(path, str(path), False)
        elif path.is_dir() and "**" not in pattern:
            yield from _local(path)


def _opened(file: InputFile, private: Path) -> Iterator[InputFile | Rejected]:
    """Yield the file itself, or the contents of a zip file.

    Programs pack their own documents in this way: containers with the name of another format must be named explicitly.
    """
    suffix = file.path.suffix.lower()
    archive = suffix == ".zip" or not _KIND.fullmatch(suffix) or (file.named and suffix not in _DOCUMENTS)
    if not archive or not is_zip(head_of(file.path)[:4]) or _is_document(file.path):
        yield file
        return
    # Files without a name of their own are named after their folder.
    private = private / file.path.stem
    private.mkdir(parents=True)
    try:
        for member in unpacked(file.path, private):
            if isinstance(member, Rejected):
                yield Rejected(member.name, member.reason)
            elif is_zip(head_of(member[0])[:4]) and not _is_document(member[0]):
                hint = "unpack the outer archive, and import the inner ones"
                reason = InputError("an archive inside an archive is not followed", field=member[1], hint=hint)
                yield Rejected(f"{file.name}/{member[1]}", reason)
            else:
                yield InputFile(member[0], f"{file.name}/{member[1]}", False)
    except InputError as reason:
        yield Rejected(file.name, reason)


def _is_document(path: Path) -> bool:
    """Return whether a zip container is a program's document, such as a spreadsheet; False if it is unreadable."""
    if path.suffix.lower() in _DOCUMENTS:
        return True
    try:
        with zipfile.ZipFile(path) as opened:
            return any(_PROGRAMS.fullmatch(name) for name in opened.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError, RuntimeError, struct.error):
        return False


def _fetched(address: str, private: Path) -> Iterator[InputFile]:
    """Copy the files at an address of fsspec below `private`."""
    # Whatever a back end throws, an address that cannot be read is the user's to mend.
    try:
        system, place = file_system(address)
        if glob.has_magic(place):
            found = system.glob(place)
            remote = sorted(path for path in found if system.isfile(path))
            base = place[: min(place.index(sign) for sign in "*?[" if sign in place)].rpartition("/")[0]
        elif system.isfile(place):
            remote, base = [place], place.rpartition("/")[0]
        else:
            remote, base = sorted(system.find(place)), place.rstrip("/")
    except ImportError as reason:
        raise InputError(
            "no access to such places", file=address, found=str(reason), hint="install what it names, and try again"
        ) from None
    except Exception as reason:
        raise _unreachable(address, reason) from None
    if not remote:
        raise InputError("no such file or folder", file=address, hint="check the address")
    if len(remote) > MOST_MEMBERS:
        raise InputError("too many files", file=address, found=len(remote), expected=f"at most {MOST_MEMBERS}")
    named = remote == [place]
    private = private / (base.rpartition("/")[2].replace(":", "") or "remote")
    left = MOST_BYTES
    for path in remote:
        parts = tuple(part for part in path[len(base) :].replace("\\", "/").split("/") if part not in ("", "."))
        if is_hidden(parts) or not parts:
            continue
        if ".." in parts or any(":" in part or "\0" in part for part in parts):
            raise InputError("a name that leaves its folder", file=address, found=path, hint="rename it there")
        copy = private.joinpath(*parts)
        try:
            copy.parent.mkdir(parents=True, exist_ok=True)
            with system.open(path, "rb") as source, copy.open("wb") as file:
                while chunk := source.read(_CHUNK):
                    left -= len(chunk)
                    if left < 0:
                        expected = f"at most {MOST_BYTES >> 30} GiB in one import"
                        raise InputError("too much to copy", file=address, expected=expected)
                    file.write(chunk)
        except InputError:
            raise
        except Exception as reason:
            raise _unreachable(f"{address} ({path})", reason) from None
        yield InputFile(copy, address if named else f"{address.rstrip('/')}: {'/'.join(parts)}", named)


def _unreachable(address: str, reason: Exception) -> InputError:
    found = f"{type(reason).__name__}: {reason}".split("\n")[0]
    return InputError("cannot be reached or read", file=address, found=found, hint="check the address and the access")
