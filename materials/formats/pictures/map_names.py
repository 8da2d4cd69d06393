"""Property of a material that a picture holds, by its name: "rock_wall_nor_gl_2k.png" is a normal map of rock_wall_2k.

Names end in the property, in any case, with the resolution and the kind of file before or after it: as Poly Haven,
ambientCG, Quixel, Unity and Substance write them, the last with a colour space behind. Unreal has single capitals,
which count only in a name that begins with T_, as its textures do.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".tga", ".bmp", ".webp", ".exr")
_ROLES = {
    "albedo": "albedo alb basecolor basecolour basegray basegrey diffuse diff dif color colour col albedotransparency",
    "roughness": "roughness rough rgh",
    "gloss": "gloss glossiness glossy smoothness",
    "metallic": "metallic metalness metal",
    "normal": "normal normals nrm nor norm nom nmap",
    "normal_gl": "norgl normalgl nrmgl normalopengl noropengl normalogl",
    "normal_dx": "nordx normaldx nrmdx normaldirectx nordirectx",
    "occlusion": "ao occlusion ambientocclusion occ ambient",
    "height": "height displacement disp bump",
    "packed": "arm orm metallicroughness occlusionroughnessmetallic",
    "metallic_smoothness": "metallicsmoothness metalsmoothness",
    "specular": "specular spec spe reflection",
    "opacity": "opacity alpha transparency",
    "emission": "emission emissive emit",
    "cavity": "cavity curvature",
    "translucency": "translucency subsurface sss transmission",
    "sheen": "sheen fuzz",
}
_ROLE_OF = {word: role for role, words in _ROLES.items() for word in words.split()}
# T_Stone_BC.png; M is left out, a mask as often as a metal.
_UNREAL = {
    "BC": "albedo",
    "B": "albedo",
    "D": "albedo",
    "N": "normal",
    "R": "roughness",
    "H": "height",
    "E": "emission",
}
_SPACE_NAMES = (
    "srgb raw linear acescg acescct acescc aces2065 ap0 ap1 adobergb displayp3 p3 rec709 rec2020 bt709 bt2020 prophoto"
)
_SPACES = frozenset(_SPACE_NAMES.split())
_BESIDES = re.compile(
    rf"\d{{1,2}}k|\d{{3,5}}(x\d{{3,5}})?|png|jpe?g|tiff?|exr|(8|16|32)bit|{_SPACE_NAMES.replace(' ', '|')}"
)


@dataclass(frozen=True)
class MapName:
    """role : one of the properties above. stem : the rest of the name, which all maps of a set share.

    space : the colour space at the end of the name, as written; "" if there is none.
    """

    role: str
    stem: str
    space: str = ""


def map_name(path: Path) -> MapName | None:
    """Parse the property in the name of a file; None if it is not a picture, or has no property at its end."""
    if path.suffix.lower() not in SUFFIXES:
        return None
    words = [word for word in re.split(r"[_\-\s.]+", path.stem) if word]
    at = max((i for i, word in enumerate(words) if not _BESIDES.fullmatch(word.lower())), default=-1)
    for count in (3, 2, 1):
        joined = "".join(words[max(at - count + 1, 0) : at + 1])
        role = _ROLE_OF.get(joined.lower()) or (
            _UNREAL.get(joined) if count == 1 and at > 1 and words[0] == "T" else None
        )
        if at - count + 1 >= 0 and role:
            behind = [word for word in words[at + 1 :] if word.lower() not in _SPACES]
            space = next((word for word in words[at + 1 :] if word.lower() in _SPACES), "")
            rest = [word for word in words[: at - count + 1] + behind if _tells_sets_apart(word)]
            return MapName(role, "_".join(rest), space)
    return None


def members(path: Path) -> dict[str, list[Path]]:
    """Return the files of the set that `path` is of, by role, itself among them; in the order of their names."""
    name = map_name(path)
    if name is None:
        return {}
    found: dict[str, list[Path]] = {}
    for other, its in _named(path.parent, _changed(path.parent)):
        if its.stem.lower() == name.stem.lower():
            found.setdefault(its.role, []).append(other)
    return found


def pictures_in(folder: Path) -> tuple[Path, ...]:
    """Return all maps in a folder, of any set."""
    return tuple(path for path, _ in _named(folder, _changed(folder)))


def _tells_sets_apart(word: str) -> bool:
    """Return whether a word distinguishes sets; kinds of file do not, since a set may mix JPEG and PNG."""
    return not re.fullmatch(r"png|jpe?g|tiff?|exr|(8|16|32)bit", word.lower())


def _changed(folder: Path) -> int:
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=16)
def _named(folder: Path, changed: int) -> tuple[tuple[Path, MapName], ...]:
    """Return every map in a folder; cached until the folder changes."""
    try:
        paths = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError:
        return ()
    named = ((path, map_name(path)) for path in paths)
    return tuple((path, name) for path, name in named if name is not None and path.is_file())
