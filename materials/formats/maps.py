"""Loose texture maps: albedo, roughness, metallic, normal, ... in pictures of their own, told apart by their names.

The albedo stands for its set; its siblings in the same folder come with it. Integers are sRGB in an albedo and numbers
elsewhere; floats (OpenEXR, TIFF) are linear. What is rendered is the mean of the maps; the maps are kept as they came.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...spectral.errors import InputError
from ...spectral.files import existing_file
from ...spectral.upsampling import upsampling
from ..records.material import Provenance
from ..source import MaterialSource, Rejected
from .measured import placed
from .naming import id_word, printable
from .pictures.map_names import SUFFIXES, map_name, members
from .pictures.map_record import kept_maps
from .pictures.stand_in import Colour, Number, SurfaceMaps, model_of
from .pictures.textures import Texture

__all__ = ["NAME", "SUFFIXES", "companions", "read_sources", "recognises"]

NAME = "texture maps"
MOST_BYTES = 256 << 20
_COLOURED = ("albedo", "emission")
# Of these, two in one set would leave open which one counts.
_RENDERED = ("albedo", "roughness", "gloss", "metallic", "packed", "metallic_smoothness")


def recognises(path: Path, head: bytes) -> bool:
    """True for the albedo of a set, the first where there are several."""
    name = map_name(path)
    return name is not None and name.role == "albedo" and members(path).get("albedo", [path])[0] == path


def companions(path: Path) -> Iterable[Path]:
    """The other maps of a set."""
    return tuple(other for files in members(path).values() for other in files if other != path)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """The one record, "maps/NAME", of the set that a map belongs to.

    Raises
    ------
    InputError
        No albedo, two maps of one property, maps of different sizes; a picture that cannot be read or is too large;
        colours that no reflectance has.
    """
    found = members(existing_file(path))
    if "albedo" not in found:
        raise InputError(
            "no albedo",
            file=path,
            field="name",
            found=", ".join(sorted(found)) or "a name that says no property",
            expected="a picture called NAME_albedo (or _basecolor, _diffuse, _color), its other maps beside it",
            hint="rename the picture, or copy the albedo beside it",
        )
    _check_unambiguous(path, found)
    textures = {role: [_texture(role, file) for file in files] for role, files in found.items()}
    every = [texture for several in textures.values() for texture in several]
    _check_sizes(path, every)
    only = {role: several[0] for role, several in textures.items()}
    notes: list[str] = []
    with placed(path, "albedo"):
        model, parameters = _surface(only, uplift, notes)
    notes += _unrendered(textures) + [note for texture in every for note in texture.notes]
    notes += [f"spectra by {uplift}, of linear sRGB"]
    notes += [f"{printable(texture.file.name)}: SHA-256 {texture.digest}" for texture in every]
    name = map_name(path)
    label = name.stem if name and name.stem else path.resolve().parent.name
    files = ", ".join(printable(texture.file.name) for texture in every)
    provenance = Provenance(
        source=f"{printable(label)}, a set of texture maps: {files}",
        licence="not stated in the files",
        kind=upsampling(uplift).provenance,
        notes=" + ".join(dict.fromkeys(notes)),
    )
    original: dict[str, Any] = {f"maps.{texture.slot}.file": printable(texture.file.name) for texture in every}
    original |= kept_maps(every, uplift)
    yield MaterialSource(f"maps/{id_word(label)}", "maps", model, parameters, provenance, path, original)


def _texture(role: str, file: Path) -> Texture:
    size = existing_file(file).stat().st_size
    hint = "save the map smaller, or compressed"
    if size > MOST_BYTES:
        raise InputError(
            "too large a file",
            file=file,
            field=role,
            found=f"{size} bytes",
            expected=f"at most {MOST_BYTES}",
            hint=hint,
        )
    try:
        data = file.read_bytes()
    except OSError as reason:
        found, hint = reason.strerror or str(reason), "check the permissions of the file"
        raise InputError(
            "cannot be read", file=file, field=role, found=found, expected="a readable picture", hint=hint
        ) from None
    slot = role if map_name(file) is None or role in _RENDERED else f"{role}{_number(role, file)}"
    texture = Texture(slot, data, "sRGB", file, role)
    coloured = role in _COLOURED and not texture.floating
    if role in _COLOURED:
        _check_space(role, file, texture.floating)
    return texture if coloured else Texture(slot, data, "linear", file, role)


def _check_space(role: str, file: Path, floating: bool) -> None:
    """Refuse colours that their name gives another encoding than integers (sRGB) or floats (linear) have here."""
    name = map_name(file)
    space = name.space if name else ""
    fitting = ("raw", "linear", "rec709", "bt709") if floating else ("srgb",)
    if space and space.lower() not in fitting:
        raise InputError(
            "colours in another space",
            file=file,
            field=role,
            found=f"{space}, by its name",
            expected="linear sRGB in floats" if floating else "sRGB in integers",
            hint="export the map as sRGB (PNG) or linear sRGB (OpenEXR), or correct its name",
        )


def _number(role: str, file: Path) -> str:
    at = members(file)[role].index(file)
    return f"-{at + 1}" if at else ""


def _check_unambiguous(path: Path, found: dict[str, list[Path]]) -> None:
    for role in _RENDERED:
        if len(found.get(role, ())) > 1:
            raise InputError(
                "two maps of one property",
                file=path,
                field=role,
                found=", ".join(printable(file.name) for file in found[role]),
                expected="one map a property",
                hint="move the one that does not count to another folder",
            )


def _check_sizes(path: Path, textures: list[Texture]) -> None:
    sizes = {texture.size for texture in textures}
    if len(sizes) > 1:
        shown = (f"{printable(each.file.name)} {each.size[1]} x {each.size[0]}" for each in textures)
        raise InputError(
            "maps of different sizes",
            file=path,
            field="size",
            found=", ".join(shown),
            expected="one size in a set",
            hint="export all maps in one resolution, or move those of another to a folder of their own",
        )


def _surface(only: dict[str, Texture], uplift: str, notes: list[str]) -> tuple[str, dict[str, Any]]:
    """Model and parameters of the mean; what was assumed is added to `notes`."""
    albedo = only["albedo"]
    if albedo.floating:
        beyond = int(((albedo.values[..., :3] < 0) | (albedo.values[..., :3] > 1)).sum())
        notes += [f"{beyond} values of the albedo are below 0 or above 1, and kept so"] if beyond else []
    if albedo.values.shape[2] in (2, 4) and np.ptp(albedo.values[..., -1]) > 0:
        notes.append("the alpha of the albedo is kept and not rendered")
    roughness, metallic = _roughness(only, notes), _metallic(only, notes)
    maps = SurfaceMaps(base=Colour(albedo), metallic=metallic or Number(scale=0.0), roughness=roughness or Number())
    parameters, more_notes = model_of(maps, uplift)
    notes += more_notes
    if roughness or metallic:
        notes += ["no roughness map: taken as 1"] if roughness is None else []
        return "metallic_roughness", dict(parameters)
    notes.append("no map of roughness or metal: taken to be perfectly diffuse")
    return "lambert", {"wavelengths_nm": parameters["wavelengths_nm"], "reflectance": parameters["diffuse"]}


def _roughness(only: dict[str, Texture], notes: list[str]) -> Number | None:
    if "roughness" in only:
        notes += _one_channel(only["roughness"])
        return Number(only["roughness"])
    if "packed" in only:
        return Number(only["packed"], 1)
    if "gloss" in only:
        notes += [*_one_channel(only["gloss"]), "roughness is 1 - gloss"]
        return Number(only["gloss"], inverted=True)
    if "metallic_smoothness" in only:
        if only["metallic_smoothness"].values.shape[2] in (2, 4):
            notes.append("roughness is 1 - smoothness, the alpha of the metallic map")
            return Number(only["metallic_smoothness"], 3, inverted=True)
        notes.append("the map of metal and smoothness has no alpha, where smoothness would be")
    return None


def _metallic(only: dict[str, Texture], notes: list[str]) -> Number | None:
    if "metallic" in only:
        notes += _one_channel(only["metallic"])
        return Number(only["metallic"])
    if "packed" in only:
        notes.append("packed map: green is taken as roughness, blue as metal")
        return Number(only["packed"], 2)
    if "metallic_smoothness" in only:
        return Number(only["metallic_smoothness"])
    return None


def _one_channel(texture: Texture) -> list[str]:
    values = texture.values
    if values.shape[2] < 3 or np.array_equal(values[..., 0], values[..., 1]):
        return []
    return [f"the {texture.slot} map is in colour: its red channel counts"]


def _unrendered(textures: dict[str, list[Texture]]) -> list[str]:
    rough = next((role for role in ("roughness", "packed", "gloss", "metallic_smoothness") if role in textures), "")
    metal = next((role for role in ("metallic", "packed", "metallic_smoothness") if role in textures), "")
    used = {"albedo", rough, metal}
    names = [role for role in textures if role not in used]
    notes = [f"kept in the record and not rendered: {', '.join(sorted(names))}"] if names else []
    if "normal" in textures:
        notes.append("the normal map does not say whether green is up (OpenGL) or down (DirectX)")
    for several in textures.values():
        for texture in several:
            name = map_name(texture.file)
            if name and name.space.lower() not in ("", "raw", "linear") and name.role not in _COLOURED:
                notes.append(f"the {texture.slot} map is named {name.space}: its numbers are taken as they are")
    for role, words in (("normal_gl", "green up (OpenGL)"), ("normal_dx", "green down (DirectX)")):
        notes += [f"the normal map is named as one with {words}"] if role in textures else []
    return notes
