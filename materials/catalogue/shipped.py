"""Folder of the materials that come with Metamer; light to import, since commands say so before they load the rest."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def shipped_sources() -> Path:
    """Return the folder of the materials that come with metamer."""
    return Path(str(files("metamer.catalogs"))) / "shipped"
