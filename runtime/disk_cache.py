"""Cache folders of results, which may be deleted at any time."""

from __future__ import annotations

import os
from pathlib import Path

# Files in a folder of small results.
_MOST_KEPT = 200


def cache_folder(name: str) -> Path:
    """Return `metamer/NAME` in the system's cache of the user, or in `XDG_CACHE_HOME`; it need not exist."""
    if moved := os.environ.get("XDG_CACHE_HOME"):
        return Path(moved) / "metamer" / name
    from platformdirs import user_cache_path

    return user_cache_path("metamer", appauthor=False) / name


def keep_newest(folder: Path) -> None:
    """Remove all files of a folder of small results except the 200 newest.

    Raises
    ------
    OSError : another process removed one meanwhile, or it may not be removed.
    """
    for old in sorted(folder.iterdir(), key=lambda file: file.stat().st_mtime)[:-_MOST_KEPT]:
        old.unlink()
