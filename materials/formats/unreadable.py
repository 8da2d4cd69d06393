"""Known but unsupported formats of materials and colours (`unread.toml`), each with an alternative to export.

The last of the readers: it never receives files that another one recognises.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NoReturn

from ...runtime.errors import InputError
from ...spectral.formats.unread_sheets import members, unread_sheet
from ..records.source import MaterialSource, Rejected
from .input_file import is_zip
from .pictures.map_names import map_name, pictures_in

NAME = "formats that are not read"
SUFFIXES = ()
_READ = "CxF3, CGATS, CSV, MERL, RGL, spectral OpenEXR, glTF or texture maps"


@dataclass(frozen=True)
class Unread:
    """Unsupported format; `unread.toml` documents the fields."""

    name: str
    why: str
    hint: str
    suffixes: tuple[str, ...] = ()
    mark: str | None = None
    needs: str | None = None
    member: str | None = None
    beside_maps: bool = False

    def fits(self, path: Path, head: bytes, members: tuple[str, ...]) -> bool:
        """Return whether a file is of this kind, by its first bytes, its members or its name."""
        marked = self.mark is not None and _holds(head, self.mark)
        marked = marked or (self.member is not None and any(re.match(self.member, name) for name in members))
        named = path.suffix.lower() in self.suffixes and (self.needs is None or _holds(head, self.needs))
        if not marked and not named:
            return False
        return not (self.beside_maps and _lies_beside_maps(path))


def _holds(head: bytes, pattern: str) -> bool:
    return re.search(pattern.encode(), head) is not None


@cache
def formats() -> tuple[Unread, ...]:
    """Return every format of `unread.toml`, in its order."""
    told = tomllib.loads(Path(__file__).with_name("unread.toml").read_text(encoding="utf-8"))
    return tuple(
        Unread(
            **{**each, "hint": each["hint"].format(**told["sentences"]), "suffixes": tuple(each.get("suffixes", ()))}
        )
        for each in told["format"]
    )


def recognises(path: Path, head: bytes) -> bool:
    """Return True for a file of one of these formats."""
    return unread(path, head) is not None


def label(path: Path) -> str:
    """Return the name of the file's format."""
    found = unread(path, _head(path))
    return found.name if found else NAME


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Raise the `InputError` that names the format, and the alternative to export."""
    yield refuse(path, _head(path))


def unread(path: Path, head: bytes) -> Unread | None:
    """Find the unsupported format of a file, by its name and its first bytes; None if it is of none."""
    if (sheet := unread_sheet(path, head)) is not None:
        return Unread(sheet.name, "it is no workbook of today (.xlsx)", sheet.hint)
    packed = members(path) if is_zip(head) else ()
    return next((known for known in formats() if known.fits(path, head, packed)), None)


def refuse(path: Path, head: bytes) -> NoReturn:
    """Raise the error for an unsupported file."""
    known = unread(path, head)
    raise InputError(
        f"not read: {known.why}" if known else "not a format of materials or spectra",
        file=path,
        field="format",
        found=known.name if known else f"first bytes {head[:12]!r}",
        expected=_READ,
        hint=known.hint if known else f"export it as {_READ}",
    )


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4096)
    except OSError as reason:
        raise InputError(
            "cannot be read",
            file=path,
            field="file",
            found=reason.strerror or str(reason),
            expected="a readable file",
            hint="check its name and its permissions",
        ) from None


def _lies_beside_maps(path: Path) -> bool:
    return any((name := map_name(other)) is not None and name.role == "albedo" for other in pictures_in(path.parent))
