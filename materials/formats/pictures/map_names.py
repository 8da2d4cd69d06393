"""Which property of a material a picture holds, by its name: "rock_wall_nor_gl_2k.png" is a normal map of rock_wall_2k.

Names end in the property, in any case, with the resolution and the kind of file before or after it: as Poly Haven,
ambientCG, Quixel and Substance write them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".tga", ".bmp", ".webp", ".exr")
_ROLES = {
    "albedo": "albedo alb basecolor basecolour diffuse diff color colour col",
    "roughness": "roughness rough rgh",
    "gloss": "gloss glossiness glossy smoothness",
    "metallic": "metallic metalness metal",
    "normal": "normal normals nrm nor norm nmap",
    "normal_gl": "norgl normalgl nrmgl normalopengl noropengl normalogl",
    "normal_dx": "nordx normaldx nrmdx normaldirectx nordirectx",
    "occlusion": "ao occlusion ambientocclusion occ ambient",
    "height": "height displacement disp bump",
    "packed": "arm orm metallicroughness occlusionroughnessmetallic",
    "specular": "specular spec reflection",
    "opacity": "opacity alpha transparency",
    "emission": "emission emissive emit",
    "cavity": "cavity curvature",
    "translucency": "translucency subsurface sss transmission",
    "sheen": "sheen fuzz",
}
_ROLE_OF = {word: role for role, words in _ROLES.items() for word in words.split()}
_BESIDES = re.compile(r"\d{1,2}k|\d{3,5}(x\d{3,5})?|png|jpe?g|tiff?|exr|(8|16|32)bit")


@dataclass(frozen=True)
class MapName:
    """role : one of the properties above. stem : the rest of the name, which all maps of a set share."""

    role: str
    stem: str


def map_name(path: Path) -> MapName | None:
    """What the name of a file says; None where it is no picture, or ends in no property."""
    if path.suffix.lower() not in SUFFIXES:
        return None
    words = [word for word in re.split(r"[_\-\s.]+", path.stem) if word]
    at = max((i for i, word in enumerate(words) if not _BESIDES.fullmatch(word.lower())), default=-1)
    for count in (3, 2, 1):
        joined = "".join(words[max(at - count + 1, 0) : at + 1]).lower()
        if at - count + 1 >= 0 and joined in _ROLE_OF:
            rest = words[: at - count + 1] + [word for word in words[at + 1 :] if _tells_sets_apart(word)]
            rest = [word for word in rest if _tells_sets_apart(word)]
            return MapName(_ROLE_OF[joined], "_".join(rest))
    return None


def members(path: Path) -> dict[str, list[Path]]:
    """The files of the set that `path` is of, by role, itself among them; in the order of their names."""
    name = map_name(path)
    if name is None:
        return {}
    found: dict[str, list[Path]] = {}
    for other, its in _named(path.parent, _changed(path.parent)):
        if its.stem.lower() == name.stem.lower():
            found.setdefault(its.role, []).append(other)
    return found


def pictures_in(folder: Path) -> tuple[Path, ...]:
    """The maps that lie in a folder, whatever their sets."""
    return tuple(path for path, _ in _named(folder, _changed(folder)))


def _tells_sets_apart(word: str) -> bool:
    """Not the kind of file: an albedo may be JPEG and its normals PNG. A resolution does."""
    return not re.fullmatch(r"png|jpe?g|tiff?|exr|(8|16|32)bit", word.lower())


def _changed(folder: Path) -> int:
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=16)
def _named(folder: Path, changed: int) -> tuple[tuple[Path, MapName], ...]:
    """Every map in a folder; asked again when the folder has changed."""
    try:
        paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError:
        return ()
    named = ((path, map_name(path)) for path in paths)
    return tuple((path, name) for path, name in named if name is not None and path.is_file())
