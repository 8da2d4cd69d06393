"""Folders of results that are kept from run to run, and may be deleted at any time."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder(name: str) -> Path:
    """Return `metamer/NAME` in the user's cache, which `XDG_CACHE_HOME` moves; it need not exist."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "metamer" / name
