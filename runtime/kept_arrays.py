"""Cache files of arrays: written whole, and used only if their content matches its hash."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from .disk_cache import keep_newest
from .errors import InputError
from .files import made_folder, written_whole
from .fingerprint import fingerprint

#: Exceptions of reading a file that is damaged, or of another kind.
UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile)
_DIGEST = "digest"


def kept(file: Path, make: Callable[[], Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Read arrays from a file, or make them and, if possible, store them there.

    For small results that are a pure function of the file's name: the folder keeps the newest (`keep_newest`).
    """
    with suppress(*UNREADABLE):
        return read_arrays(file)
    found = dict(make())
    with suppress(InputError, OSError):
        made_folder(file.parent)
        write_arrays(file, found)
        keep_newest(file.parent)
    return found


def write_arrays(file: Path, content: Mapping[str, np.ndarray]) -> None:
    """Write arrays and their hash as .npz; equal arrays are equal bytes.

    Raises
    ------
    InputError, NoRoomError : see `written_whole`.
    """
    digest = np.array(fingerprint(content))
    with written_whole(file) as beside, beside.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **content, **{_DIGEST: digest})


def read_arrays(file: Path) -> dict[str, np.ndarray]:
    """Read the arrays of `write_arrays`; raises one of `UNREADABLE` otherwise."""
    # Opened here: numpy leaves a damaged file open.
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as held:
        content = {name: held[name] for name in held.files if name != _DIGEST}
        if str(held[_DIGEST]) != fingerprint(content):
            raise ValueError("not what was written")
    return content
