"""A folder of this process alone among the temporary ones: gone at the end, and after a kill with the next one made."""

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
    """An empty folder that is removed with all that is in it, whichever way the block ends."""
    clear_abandoned()
    path = temporary_folder() / f"metamer-{uuid.uuid4().hex}"
    with clearing(lambda: shutil.rmtree(path, ignore_errors=True)), made_and_held(path, lambda: path.mkdir(mode=0o700)):
        yield path


@contextmanager
def file_of(data: bytes, name: str) -> Iterator[Path]:
    """The path of a file of these bytes while the block lasts, for libraries that read files alone.

    name : where the system keeps no files in memory, that of a file in a private folder.
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

    Python tries it with a file of its own when it is first asked for, which a signal must not leave there.
    """
    with undisturbed():
        return Path(tempfile.gettempdir())


def clear_abandoned() -> None:
    """Remove private folders whose process was killed."""
    with suppress(OSError), os.scandir(temporary_folder()) as entries:
        for entry in entries:
            if _NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                remove_abandoned(Path(entry.path))
