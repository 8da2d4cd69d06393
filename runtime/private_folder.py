"""Temporary folder of this process alone, removed at its end or, after a kill, when the next one is made."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .locks import made_and_held, remove_abandoned
from .shutdown import clearing, undisturbed

_NAME = re.compile(r"metamer-[0-9a-f]{32}")
# Folder of the open files of this process on Linux, by number; files in memory are among them.
_OPEN_FILES = Path("/proc/self/fd")


@contextmanager
def private_folder() -> Iterator[Path]:
    """Yield an empty folder that is removed with its contents, however the block ends."""
    clear_abandoned()
    path = temporary_folder() / f"metamer-{uuid.uuid4().hex}"
    with clearing(lambda: shutil.rmtree(path, ignore_errors=True)), made_and_held(path, lambda: path.mkdir(mode=0o700)):
        yield path


@contextmanager
def file_of(data: bytes, name: str) -> Iterator[Path]:
    """Yield the path of a file of these bytes during the block, for libraries that read only files.

    name : of the file in a private folder, if the system has no files in memory.
    """
    if _OPEN_FILES.is_dir() and hasattr(os, "memfd_create"):
        with os.fdopen(os.memfd_create(name), "wb") as file:
            file.write(data)
            file.flush()
            yield _OPEN_FILES / str(file.fileno())
        return
    with private_folder() as folder:
        path = folder / name
        path.write_bytes(data)
        yield path


def temporary_folder() -> Path:
    """Return the system's folder of temporary files.

    Python tests it with a file of its own on first use, which a signal must not leave behind.
    """
    with undisturbed():
        return Path(tempfile.gettempdir())


def clear_abandoned() -> None:
    """Remove private folders whose process was killed."""
    with suppress(OSError), os.scandir(temporary_folder()) as entries:
        for entry in entries:
            if _NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                remove_abandoned(Path(entry.path))
