"""Requests in headers of a BTF's images that are not followed: to be turned, or shown by other colours than sRGB."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from ...runtime.errors import InputError
from ...spectral.formats.exr import check_size
from ...spectral.formats.picture_header import exr_colours, other_than_srgb

# Of EXIF: how a picture is to be turned; 1 is not at all.
_ORIENTATION, _UPRIGHT = 0x0112, 1


def header_notes(files: Sequence[Path], folder: Path) -> list[str]:
    """Return a note for each thing asked for, with the number of images and the name of the first.

    A file that cannot be opened is passed over: who reads it says what is wrong with it.
    """
    from PIL import Image

    turned: list[tuple[Path, int]] = []
    profiled: list[Path] = []
    coloured: dict[str, list[Path]] = {}
    for file in files:
        try:
            with Image.open(file) as picture:
                orientation, profile = picture.getexif().get(_ORIENTATION, _UPRIGHT), picture.info.get("icc_profile")
                # Of other formats Pillow has read the header.
                data = file.read_bytes() if picture.format in ("PNG", "AVIF", "BMP") else b""
                stated = ", ".join(other_than_srgb(picture, data))
        except Exception:  # OpenEXR, or damaged
            continue
        if orientation != _UPRIGHT:
            turned.append((file, orientation))
        if profile:
            profiled.append(file)
        if stated:
            coloured.setdefault(stated, []).append(file)
    notes = []
    if turned:
        name, asked = turned[0][0].relative_to(folder), turned[0][1]
        notes.append(f"images to be turned by EXIF: {len(turned)} ({name}: {asked}), read as they are stored")
    if profiled:
        name = profiled[0].relative_to(folder)
        notes.append(f"images with an ICC profile: {len(profiled)} ({name}), not applied")
    for stated, named in coloured.items():
        notes.append(f"images that say {stated}: {len(named)} ({named[0].relative_to(folder)}), not applied")
    first = next((file for file in files if file.suffix.lower() == ".exr"), None)
    stated = "" if first is None else ", ".join(_of_exr(first))
    if first is not None and stated:
        notes.append(f"images that say {stated}: OpenEXR, by the first ({first.relative_to(folder)}), not applied")
    return notes


def _of_exr(file: Path) -> tuple[str, ...]:
    """Read what an OpenEXR image of red, green and blue states; those of a set are written alike."""
    try:
        header = check_size(file, sys.maxsize)[0]
    except InputError:
        return ()
    return exr_colours(header.attributes) if {"R", "G", "B"} <= set(header.names) else ()
