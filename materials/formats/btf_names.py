"""Names of a BTF's images: directions of light and view in degrees, and which files are one set.

UBO2003 writes `00001 tl000 pl000 tv000 pv000.jpg`, UTIA `tl000_pl000_tv000_pv000.png`, each view in a folder of its
own, `tv000_pv000`: tl and pl are theta and phi of the light, tv and pv those of the view. Angles missing in the name of
a file are taken from the names of its folders. Running numbers are ignored. A set may have a file for each wavelength,
stated in its name or its folder's (`550nm`, `w550`, `lambda=550`); a number alone does not count.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

SUFFIXES = (".jpg", ".jpeg", ".png", ".exr", ".tif", ".tiff", ".bmp", ".webp")
_ANGLE = re.compile(r"(?<![a-z])(tl|pl|tv|pv)[ _=]?(-?\d+(?:\.\d+)?)(?![a-z])", re.IGNORECASE)
# 550nm, 550.5 nm, 550_nm; or what laboratories put before the number: w550, wl_550, lambda=550.
_LENGTH = re.compile(
    r"(?<![\d.,a-z])(\d{3,4}(?:[.,]\d+)?)[ _]?nm(?![a-z])"
    r"|(?<![a-z])(?:wl?|wave|wavelength|lambda|\u03bb)[ _=-]?((?:[2-9]\d\d|1\d{3})(?:[.,]\d+)?)(?![a-z\d])",
    re.IGNORECASE,
)
# A number that stands alone.
_NUMBER = re.compile(r"(?<![A-Za-z0-9])\d+(?![A-Za-z0-9])")
# Most levels of nested folders, of views and of wavelengths.
_LEVELS = 3


@dataclass(frozen=True)
class ImageName:
    """Content of a file name: theta and phi, degrees, of light and view; the wavelength, nm, if stated.

    rest : what is left of the file's name without angles, wavelength and numbers that stand alone: the same in a set.
    """

    light: tuple[float, float]
    view: tuple[float, float]
    wavelength_nm: float | None
    rest: str


def image_name(path: Path) -> ImageName | None:
    """Parse the angles in the name of a file and of its folders; None unless all four are present."""
    if path.suffix.lower() not in SUFFIXES:
        return None
    return _image_name(path.stem, tuple(parent.name for parent in list(path.parents)[:_LEVELS]))


@lru_cache(maxsize=1 << 16)
def _image_name(stem: str, folders: tuple[str, ...]) -> ImageName | None:
    found: dict[str, float] = {}
    length = None
    for number, text in enumerate((stem, *folders)):
        here: dict[str, float] = {}
        for name, value in _ANGLE.findall(text):
            here.setdefault(name.lower(), float(value))
        found = here | found
        if number == 0 and not here:
            return None
        if length is None and (said := _LENGTH.search(text)):
            length = float((said[1] or said[2]).replace(",", "."))
    if len(found) < 4:
        return None
    rest = re.sub(r"[\W_]+", " ", _NUMBER.sub(" ", _LENGTH.sub(" ", _ANGLE.sub(" ", stem).replace("_", " "))))
    return ImageName((found["tl"], found["pl"]), (found["tv"], found["pv"]), length, rest.strip().lower())


def set_folder(path: Path) -> Path:
    """Return the folder of the whole set that an image belongs to.

    It is above folders named by an angle or a wavelength, and above those that differ by a number and hold one view, or
    light, each.
    """
    folder = path.parent
    for _ in range(_LEVELS):
        if not (_ANGLE.search(folder.name) or _LENGTH.search(folder.name) or _is_numbered_part(folder)):
            break
        folder = folder.parent
    return folder


def members(path: Path) -> list[Path]:
    """Return all images of the set that `path` belongs to, sorted by their names."""
    name = image_name(path)
    if name is None:
        return [path]
    folder = set_folder(path)
    return list(_members(folder, name.rest, tuple(_changed_below(folder))))


def _changed_below(folder: Path, level: int = 0) -> Iterator[int]:
    """Yield modification times of the names in a folder, and in those below it."""
    yield _changed_ns(folder)
    if level < _LEVELS:
        try:
            with os.scandir(folder) as entries:
                below = sorted(entry.path for entry in entries if entry.is_dir(follow_symlinks=False))
        except OSError:
            # A folder without permission to read counts as without images.
            return
        for one in below:
            yield from _changed_below(Path(one), level + 1)


@lru_cache(maxsize=8)
def _members(folder: Path, rest: str, changed_ns: tuple[int, ...]) -> tuple[Path, ...]:
    found = []
    for here, folders, names in os.walk(folder):
        depth = len(Path(here).parts) - len(folder.parts)
        folders[:] = sorted(name for name in folders if not name.startswith(".") and depth < _LEVELS)
        for name in names:
            file = Path(here) / name
            said = None if name.startswith(".") else image_name(file)
            # A broken link counts as missing.
            if said is not None and said.rest == rest and file.is_file() and set_folder(file) == folder:
                found.append(file)
    return tuple(sorted(found))


def is_first(path: Path) -> bool:
    """Return whether an image is the representative of its set."""
    name = image_name(path)
    if name is None or any(image is not None and image.rest == name.rest for image in _before(path)):
        return False
    found = members(path)
    return bool(found) and found[0] == path


def set_name(path: Path) -> str:
    """Name a set after its folder; several sets in one folder also by their distinguishing parts."""
    folder, name = set_folder(path), image_name(path)
    others = {
        one.rest
        for beside in _images_in(path.parent, _changed_ns(path.parent))
        if (one := image_name(path.parent / beside))
    }
    return f"{folder.name} {name.rest}".strip() if name and len(others) > 1 else folder.name


def bare_numbers(folder: Path) -> list[str]:
    """Return the names of a set's folder and its siblings, if all are numbers that could be wavelengths in nm."""
    if not _could_be_nm(folder.name):
        return []
    try:
        beside = sorted(one.name for one in folder.parent.iterdir() if one.is_dir() and not one.name.startswith("."))
    except OSError:
        return []
    return beside if len(beside) > 2 and all(map(_could_be_nm, beside)) else []


def _could_be_nm(name: str) -> bool:
    return re.fullmatch(r"\d{3,4}", name) is not None and 300 <= int(name) <= 1100


def directions_of(degrees: Iterable[Any]) -> Float[np.ndarray, "D 3"]:
    """Convert pairs (theta, phi) in degrees to unit vectors: phi from x, along u, to y, along v."""
    theta, phi = np.radians(np.array(list(degrees), dtype=np.float64).reshape(-1, 2)).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def _before(path: Path) -> Iterable[ImageName | None]:
    """Yield the names of the images in the same folder before one, up to the first of its set."""
    for name in _images_in(path.parent, _changed_ns(path.parent)):
        if name >= path.name:
            return
        yield image_name(path.parent / name)


@lru_cache(maxsize=1024)
def _images_in(folder: Path, changed_ns: int) -> tuple[str, ...]:
    """List the names of a folder's images."""
    try:
        with os.scandir(folder) as entries:
            names = sorted(entry.name for entry in entries if entry.is_file())
    except OSError:
        return ()
    return tuple(name for name in names if not name.startswith(".") and image_name(folder / name) is not None)


@lru_cache(maxsize=1024)
def _directions_in(folder: Path, changed_ns: int) -> tuple[frozenset, frozenset]:
    """Return the views and the lights that a folder's images have."""
    found = [image_name(folder / name) for name in _images_in(folder, changed_ns)]
    return frozenset(one.view for one in found if one), frozenset(one.light for one in found if one)


def _is_numbered_part(folder: Path) -> bool:
    """Return whether a folder of one view, or light, has siblings with others whose names differ in digits only."""
    pattern = re.sub(r"\d+", "0", folder.name)
    return any(sign.isdigit() for sign in folder.name) and folder in _numbered_parts(
        folder.parent, pattern, _changed_ns(folder.parent)
    )


@lru_cache(maxsize=1024)
def _numbered_parts(parent: Path, pattern: str, changed_ns: int) -> frozenset[Path]:
    try:
        beside = [one for one in parent.iterdir() if re.sub(r"\d+", "0", one.name) == pattern and one.is_dir()]
    except OSError:
        return frozenset()
    held = [_directions_in(one, _changed_ns(one)) for one in beside]
    for kind in (0, 1):
        single = [each[kind] for each in held if each[kind]]
        if len(single) > 1 and all(len(one) == 1 for one in single) and len(set(single)) == len(single):
            return frozenset(beside)
    return frozenset()


def _changed_ns(folder: Path) -> int:
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0
