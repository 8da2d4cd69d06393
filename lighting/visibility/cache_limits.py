"""Folders that visibility, and rays between parts, are kept in from run to run: where they are, how large each may
grow, and what goes first.

A file's time is that of its last use, since systems do not keep times of reading. What was not used for longest is
removed first; the file that was just used stays, however large it is. Two processes may do so at once: a file that is
gone was removed by the other, and one that somebody reads stays readable to them.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from ...runtime.disk_cache import cache_folder
from ...runtime.errors import InputError
from ...runtime.files import half_written
from ...runtime.locks import remove_abandoned
from ...runtime.memory import gigabytes

#: Environment variable of each folder's limit, in gigabytes (1e9 bytes); 0 keeps nothing.
LIMIT_VARIABLE = "METAMER_CACHE_GB"
#: Limit without it: some 250 scenes of 50,000 vertices, or 13 of a million (77 bytes a vertex; at most a hundred).
DEFAULT_GB = 1.0
_SUFFIX = ".npz"


def visibility_folder() -> Path:
    """`metamer/visibility` in the user's cache, which `XDG_CACHE_HOME` moves."""
    return cache_folder("visibility")


def transfer_folder() -> Path:
    """`metamer/transfer` beside it: rays of `lighting.transfer`."""
    return cache_folder("transfer")


def most_bytes() -> int:
    """Return the limit of each folder, bytes.

    Raises
    ------
    InputError : `METAMER_CACHE_GB` is no number, or no size.
    """
    stated = os.environ.get(LIMIT_VARIABLE, "").strip()
    try:
        found = float(stated) if stated else DEFAULT_GB
    except ValueError:
        found = np.nan
    if not 0.0 <= found < np.inf:
        raise InputError(
            "not a size of the cache",
            field=LIMIT_VARIABLE,
            found=stated,
            expected="gigabytes, 0 or more; 0 keeps nothing",
        )
    return int(found * 1e9)


def used(file: Path) -> None:
    """Say that a file is of use now."""
    # A folder that may only be read is of use all the same.
    with suppress(OSError):
        os.utime(file)


def pruned(folder: Path, most: int, keep: Collection[Path] = ()) -> tuple[int, int]:
    """Remove what was not used for longest until at most `most` bytes are left; those of `keep` stay.

    What killed processes have left half-written goes too. Returns how many files are left, and their bytes.
    """
    for stray in half_written(folder, (_SUFFIX,)):
        remove_abandoned(stray)
    files = sorted(_files(folder))
    total, left = sum(size for _, size, _ in files), len(files)
    for _, size, file in files:
        if total <= most:
            break
        if file not in keep and _removed(file):
            total, left = total - size, left - 1
    return left, total


def cache_words(folder: Path) -> str:
    """Describe the content of the folder."""
    sizes = [size for _, size, _ in _files(folder)]
    files = "1 file" if len(sizes) == 1 else f"{len(sizes)} files"
    held = gigabytes(sum(sizes)) if sizes else "0 GB"
    return f"{folder}, {files}, {held} of at most {most_bytes() / 1e9:g} GB (${LIMIT_VARIABLE})"


def _files(folder: Path) -> Iterator[tuple[int, int, Path]]:
    """Yield when each file was used last (ns), its size and its name."""
    for file in folder.glob(f"*{_SUFFIX}"):
        with suppress(FileNotFoundError):
            found = file.stat()
            yield found.st_mtime_ns, found.st_size, file


def _removed(file: Path) -> bool:
    """Return whether a file is gone; one that may not be removed stays, and counts."""
    try:
        file.unlink(missing_ok=True)
    except OSError:
        return False
    return True
