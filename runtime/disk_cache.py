"""Folders of results that are kept from run to run, and may be deleted at any time."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder(name: str) -> Path:
    """Return `metamer/NAME` in the system's cache of the user, or in `XDG_CACHE_HOME`; it need not exist."""
    if moved := os.environ.get("XDG_CACHE_HOME"):
        return Path(moved) / "metamer" / name
    from platformdirs import user_cache_path

    return user_cache_path("metamer", appauthor=False) / name
