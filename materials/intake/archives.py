"""Zip files as folders: safe extraction, into a private folder only.

Nothing of an archive is trusted: names (which may point elsewhere), sizes (a few kilobytes may unpack to terabytes), or
the number of members. Members are refused by name and with a reason; the others are used.
"""

from __future__ import annotations

import stat
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

from ...runtime.errors import InputError
from ..records.source import Rejected

MOST_MEMBERS = 20_000
MOST_BYTES = 8 << 30
#: Unpacked bytes for each packed one; text of spectra reaches 20, deflate at its limit 1000.
MOST_RATIO = 200.0
# Unpacked bytes up to which any ratio is harmless.
_HARMLESS_BYTES = 32 << 20
_CHUNK = 1 << 20
#: Files that operating systems add to folders.
FOREIGN = ("__MACOSX", "Thumbs.db", "desktop.ini")


def is_hidden(parts: tuple[str, ...]) -> bool:
    """Return True if a part of a path begins with a dot, or is a system file's."""
    return any((part.startswith(".") and part not in (".", "..")) or part in FOREIGN for part in parts)


def unpacked(archive: Path, into: Path) -> Iterator[tuple[Path, str] | Rejected]:
    """Unpack the members of `archive` below the empty folder `into`; yield (file, name in the archive), or the refusal.

    Folders are kept, so that files that belong together stay together. Archives inside the archive stay packed.

    Raises
    ------
    InputError
        The archive is damaged, or is more than any set of measurements would be: `MOST_MEMBERS`, `MOST_BYTES`,
        `MOST_RATIO`.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            members = [member for member in opened.infolist() if not member.is_dir()]
            _check_size(members, archive)
            taken: set[str] = set()
            for member in members:
                parts = _parts(member.filename)
                if is_hidden(parts):
                    continue
                try:
                    _check(member, parts, taken)
                    place = into.joinpath(*parts)
                    _unpack(opened, member, place)
                    yield place, member.filename
                except InputError as reason:
                    yield Rejected(f"{archive.name}/{member.filename}", reason)
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError) as reason:
        raise InputError("not a readable zip file", file=archive, found=str(reason), hint="pack it again") from None


def _check_size(members: list[zipfile.ZipInfo], archive: Path) -> None:
    whole = sum(member.file_size for member in members)
    packed = max(1, archive.stat().st_size)
    found, expected = "", ""
    if len(members) > MOST_MEMBERS:
        found, expected = f"{len(members)} files", f"at most {MOST_MEMBERS}"
    elif whole > MOST_BYTES:
        found, expected = f"{whole / 2**30:.1f} GiB when unpacked", f"at most {MOST_BYTES >> 30} GiB"
    elif whole > _HARMLESS_BYTES and whole / packed > MOST_RATIO:
        found, expected = f"{whole / packed:.0f} times as large when unpacked", f"at most {MOST_RATIO:g} times"
    if found:
        hint = "unpack it yourself, where you trust it, and import the folder"
        raise InputError("too much in the zip file", file=archive, found=found, expected=expected, hint=hint)


def _parts(name: str) -> tuple[str, ...]:
    """Return the parts of a member's name; archives from Windows separate them by backslashes, against the rule."""
    return PurePosixPath(name.replace("\\", "/")).parts


def _check(member: zipfile.ZipInfo, parts: tuple[str, ...], taken: set[str]) -> None:
    name = member.filename
    if not parts or ".." in parts or parts[0] == "/" or PureWindowsPath(name).drive or any(":" in p for p in parts):
        _refuse("a path that leaves the archive", member, "a path below the archive's own folder")
    if stat.S_ISLNK(member.external_attr >> 16):
        _refuse("a symbolic link", member, "a plain file")
    if member.flag_bits & 0x1:
        _refuse("encrypted", member, "a file without a password", "unpack it with its password, and import the folder")
    # Two names that differ in case alone are one file on many systems.
    folded = "/".join(parts).casefold()
    if folded in taken:
        _refuse("the name stands twice in the archive", member, "each name once")
    taken.add(folded)


def _unpack(opened: zipfile.ZipFile, member: zipfile.ZipInfo, place: Path) -> None:
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        left = member.file_size
        with opened.open(member) as packed, place.open("xb") as file:
            while chunk := packed.read(_CHUNK):
                left -= len(chunk)
                if left < 0:
                    _refuse("larger than the archive says", member, f"{member.file_size} bytes")
                file.write(chunk)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as reason:
        _refuse(f"cannot be unpacked: {reason}", member, "a file packed by deflate, bzip2 or lzma", "pack it again")
    except OSError as reason:
        _refuse(f"cannot be unpacked: {reason.strerror or reason}", member, "a name that a file may have")


def _refuse(problem: str, member: zipfile.ZipInfo, expected: str, hint: str | None = None) -> None:
    raise InputError(problem, field=member.filename, expected=expected, hint=hint)
