"""Watching of files for changed content.

Files are polled, which works for a few files on any system and network folder. A file has changed once its time or size
and then its content differ, and it has stopped changing, since editors write in several steps.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...materials.catalogue.catalogue import Catalogue
from ...materials.records.record import SUFFIX
from ...runtime.errors import InputError
from ...runtime.files import read_text
from ..gl.shaders import shader_folder


@dataclass(frozen=True)
class _State:
    """State of a file: its stamp, and a hash of its content; both None for a missing file."""

    stamp: tuple[int, int, int] | None
    digest: bytes | None


class Watch:
    """Set of watched files, polled for changes."""

    def __init__(self, files: Iterable[str | Path] = ()) -> None:
        self._known: dict[Path, _State] = {}
        # Stamps that differed at the last poll, of files that may still be being written.
        self._moving: dict[Path, tuple[int, int, int] | None] = {}
        self.put(files)

    @property
    def files(self) -> tuple[Path, ...]:
        """Watched files."""
        return tuple(self._known)

    def put(self, files: Iterable[str | Path]) -> None:
        """Replace the watched files; states of files already watched are kept."""
        wanted = dict.fromkeys(Path(one) for one in files)
        self._known = {one: self._known.get(one) or _state(one) for one in wanted}
        self._moving = {one: stamp for one, stamp in self._moving.items() if one in self._known}

    def changed(self) -> tuple[Path, ...]:
        """Return files whose content has changed since last reported, including removed and added ones.

        Each change is reported once, when two successive calls find the same state. Of unchanged files only time and
        size are read.
        """
        told = []
        for file, before in self._known.items():
            stamp = _stamp(file)
            if stamp == before.stamp:
                self._moving.pop(file, None)
                continue
            if file not in self._moving or self._moving[file] != stamp:
                self._moving[file] = stamp
                continue
            del self._moving[file]
            now = _state(file)
            self._known[file] = now
            if now.digest != before.digest:
                told.append(file)
        return tuple(told)


def files_of_scene(path: str | Path) -> tuple[Path, ...]:
    """Return a scene's file and the files named in it: meshes, maps, spectra, a display's configuration.

    Any text that is the name of an existing file counts. A file that is not TOML names none.
    """
    path = Path(path)
    found = [path]
    with suppress(InputError, tomllib.TOMLDecodeError):
        texts = _texts(tomllib.loads(read_text(path, "a TOML file")))
        found += [path.parent / text for text in texts if _names_a_file(path.parent, text)]
    return tuple(dict.fromkeys(found))


def files_of_materials(catalogue: Catalogue, ids: Iterable[str]) -> tuple[Path, ...]:
    """Return the files of a catalogue's materials, present or not, since a removed one may come back."""
    return tuple(catalogue.folder / f"{one}{SUFFIX}" for one in ids)


def files_of_shaders() -> tuple[Path, ...]:
    """Return the renderer's shaders; those of surfaces are next to their classes and are read with the program."""
    return tuple(sorted(shader_folder().iterdir()))


def _names_a_file(folder: Path, text: str) -> bool:
    # Some texts are invalid file names: too long, or with a NUL.
    with suppress(OSError, ValueError):
        return bool(text.strip()) and (folder / text).is_file()
    return False


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for one in value.values():
            yield from _texts(one)
    elif isinstance(value, list):
        for one in value:
            yield from _texts(one)


def _stamp(file: Path) -> tuple[int, int, int] | None:
    """Return time, size and inode of a file; None if it cannot be read."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def _state(file: Path) -> _State:
    stamp = _stamp(file)
    try:
        with file.open("rb") as opened:
            return _State(stamp, hashlib.file_digest(opened, "sha256").digest())
    except OSError:
        return _State(stamp, None)
