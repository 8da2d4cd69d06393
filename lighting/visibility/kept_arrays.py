"""A file of arrays that is kept to be read again: written whole, and believed only where it holds what was written."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...runtime.files import written_whole
from ...runtime.fingerprint import fingerprint

#: What reading a file that is damaged raises, and one that is none.
UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile)
_DIGEST = "digest"


def write_arrays(file: Path, content: Mapping[str, np.ndarray]) -> None:
    """Arrays and a hash of them, as .npz: equal arrays are equal bytes.

    Raises
    ------
    InputError, NoRoomError : see `written_whole`.
    """
    digest = np.array(fingerprint(content))
    with written_whole(file) as beside, beside.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **content, **{_DIGEST: digest})


def read_arrays(file: Path) -> dict[str, np.ndarray]:
    """Read the arrays that were written; otherwise one of `UNREADABLE` is raised."""
    # Opened here: numpy leaves a damaged file open.
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as held:
        content = {name: held[name] for name in held.files if name != _DIGEST}
        if str(held[_DIGEST]) != fingerprint(content):
            raise ValueError("not what was written")
    return content
