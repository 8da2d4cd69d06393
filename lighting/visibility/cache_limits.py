"""Cache folders for visibility and for rays between parts: location, size limit, and eviction of least recently used
files.

A file's modification time is set at each use, since access times are unreliable. The least recently used file is
removed first; the one just used stays, whatever its size. Processes may prune concurrently: a missing file was removed
by another, and an open file stays readable.
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

#: Environment variable with the limit of each folder, in gigabytes (1e9 bytes); 0 disables caching.
LIMIT_VARIABLE = "METAMER_CACHE_GB"
#: Default limit: some 250 scenes of 50,000 vertices, or 13 of a million (77 bytes a vertex; at most a hundred).
DEFAULT_GB = 1.0
_SUFFIX = ".npz"


def visibility_folder() -> Path:
    """Return `metamer/visibility` in the user's cache folder (`XDG_CACHE_HOME`)."""
    return cache_folder("visibility")


def transfer_folder() -> Path:
    """Return `metamer/transfer` beside it, for rays of `lighting.transfer`."""
    return cache_folder("transfer")


def most_bytes() -> int:
    """Return the limit of each folder, bytes.

    Raises
    ------
    InputError : `METAMER_CACHE_GB` is not a number, or not a size.
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
    """Mark a file as just used."""
    # A read-only cache is still usable.
    with suppress(OSError):
        os.utime(file)


def pruned(folder: Path, most: int, keep: Collection[Path] = ()) -> tuple[int, int]:
    """Remove least recently used files until at most `most` bytes are left; those of `keep` stay.

    Partial files of killed processes are removed too. Return the number of files left, and their bytes.
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
    """Describe the number and size of the files in a folder."""
    sizes = [size for _, size, _ in _files(folder)]
    files = "1 file" if len(sizes) == 1 else f"{len(sizes)} files"
    held = gigabytes(sum(sizes)) if sizes else "0 GB"
    return f"{folder}, {files}, {held} of at most {most_bytes() / 1e9:g} GB (${LIMIT_VARIABLE})"


def _files(folder: Path) -> Iterator[tuple[int, int, Path]]:
    """Yield time of last use (ns), size and path of each file."""
    for file in folder.glob(f"*{_SUFFIX}"):
        with suppress(FileNotFoundError):
            found = file.stat()
            yield found.st_mtime_ns, found.st_size, file


def _removed(file: Path) -> bool:
    """Remove a file and return whether it is gone; one that cannot be removed stays, and counts."""
    try:
        file.unlink(missing_ok=True)
    except OSError:
        return False
    return True
