"""Input file that may hold materials, and its first bytes, which identify its format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...runtime.errors import InputError

HEAD = 4096


@dataclass(frozen=True)
class InputFile:
    """An input file.

    path : where it can be read, while `inputs_of` is open.
    name : for users: "archive.zip/member", "memory://folder/file"; for local files, the path.
    named : given explicitly, rather than found in a folder, by a pattern or in an archive: then it must be usable.
    """

    path: Path
    name: str
    named: bool

    def with_given_name(self, text: str) -> str:
        """Replace a path that only this import knows by the name in `text`."""
        if self.name == str(self.path):
            return text
        own, given = list(self.path.parts), self.name.split("/")
        text = text.replace(str(self.path), self.name)
        # Replace its folders, too, without the last ones, which both names share.
        while len(own) > 1 and len(given) > 1 and own[-1] == given[-1]:
            own.pop()
            given.pop()
        return text.replace(str(Path(*own)), "/".join(given)) if len(own) > 2 else text


def head_of(path: Path) -> bytes:
    """Read the first bytes, which identify the format; raises `InputError` if the file cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(HEAD)
    except OSError as reason:
        raise InputError("cannot be read", file=path, found=reason.strerror or str(reason)) from None


def is_zip(head: bytes) -> bool:
    """True for the first bytes of a zip file, an empty or a split one too."""
    return head[:4] in (b"PK\x03\x04", b"PK\x05\x06", b"PK\x07\x08")
