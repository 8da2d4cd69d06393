"""Channels of OpenEXR that hold one wavelength each (Fichet, Pacanowski and Wilkie, JCGT 10(3), 2021)."""

from __future__ import annotations

import re
from pathlib import Path

from ...spectral.formats.exr import MAGIC, channel_names
from ...spectral.formats.spectral_exr import LENGTH
from .pictures.map_names import map_name, members

#: T.550,0nm: reflectance; S0.550,0nm: emission, S1 to S3 its polarisation; a layer's name may stand before.
PLAIN = re.compile(rf"^(?:(?P<layer>.*)\.)?(?P<kind>S[0-3]|T)\.{LENGTH}$")


def is_spectral(channel: str) -> bool:
    """Return whether a channel of that name holds one wavelength.

    >>> is_spectral("T.550,0nm"), is_spectral("R")
    (True, False)
    """
    return PLAIN.match(channel) is not None


def is_spectral_base(path: Path, head: bytes | None = None) -> bool:
    """Return whether a file is the albedo of a set of maps, has spectral channels, and other maps lie beside it."""
    name = map_name(path)
    if name is None or name.role != "albedo" or path.suffix.lower() != ".exr":
        return False
    if sum(len(files) for files in members(path).values()) < 2:
        return False
    if head is None:
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
    return any(map(is_spectral, channel_names(path, head)))
