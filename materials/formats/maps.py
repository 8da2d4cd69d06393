"""Loose texture maps: albedo, roughness, metallic, normal, ... in pictures of their own, told apart by their names.

The albedo represents its set; its siblings in the same folder are read with it. Integers are sRGB in an albedo and
linear elsewhere; floats (OpenEXR, TIFF) are linear; a spectral OpenEXR picture as the albedo holds measured
reflectances, which are not changed. Every texel is rendered, or the mean of all if that is requested or maps have
properties that are not rendered; the maps are stored as imported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.upsampling import upsampling
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from ..svbrdf.textures import Texture
from .map_surface import surface_of
from .measured_source import placed, sha256_of
from .naming import id_word, printable
from .pictures.map_names import SUFFIXES, map_name, members
from .pictures.map_record import kept_maps
from .reading_cost import ReadingCost, cost_of_bytes, cost_of_picture
from .spectral_base import read_spectral_base
from .spectral_channels import is_spectral_base

__all__ = ["ASKS_MORE", "NAME", "SUFFIXES", "companions", "read_sources", "recognises"]

NAME = "texture maps"
#: It asks how maps are drawn.
ASKS_MORE = True
MOST_BYTES = 256 << 20
_COLOURED = ("albedo", "emission")
# Roles that are ambiguous if a set has two maps of one.
_RENDERED = ("albedo", "roughness", "gloss", "metallic", "packed", "metallic_smoothness")


def recognises(path: Path, head: bytes) -> bool:
    """Return True for the albedo of a set, the first of several."""
    name = map_name(path)
    return name is not None and name.role == "albedo" and members(path).get("albedo", [path])[0] == path


def companions(path: Path) -> Iterable[Path]:
    """Return the other maps of a set."""
    return tuple(other for files in members(path).values() for other in files if other != path)


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of a spectral albedo, as its header counts its pixels."""
    return cost_of_picture(path) if is_spectral_base(path) else cost_of_bytes(path)


def read_sources(path: Path, uplift: str, answer: ImportOptions = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """Yield the one record, "maps/NAME", of the set that a map belongs to.

    Raises
    ------
    InputError
        No albedo, two maps of one property, maps of different sizes; a picture that cannot be read or is too large;
        colours outside any reflectance; a normal map of unknown orientation, invalid normals.
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
    _check_unambiguous(path, found, answer)
    (albedo,) = found["albedo"]
    measured = read_spectral_base(albedo, answer) if is_spectral_base(albedo) else None
    textures = {
        role: [_texture(role, file, answer) for file in files]
        for role, files in found.items()
        if role != "albedo" or measured is None
    }
    every = [texture for several in textures.values() for texture in several]
    sizes = [(texture.file, texture.size) for texture in every]
    _check_sizes(path, sizes if measured is None else [(albedo, measured.size), *sizes])
    notes: list[str] = []
    with placed(albedo, "albedo"):
        model, parameters, drawn = surface_of(textures, measured, uplift, answer, notes)
    notes += _unrendered(textures, drawn, answer) + [note for texture in every for note in texture.notes]
    notes += [f"spectra by {uplift}, of linear sRGB"] if measured is None else []
    digests = {texture.file: texture.digest for texture in every}
    if measured is not None:
        digests = {albedo: sha256_of(albedo), **digests}
    notes += [f"{printable(file.name)}: SHA-256 {digest}" for file, digest in digests.items()]
    name = map_name(path)
    label = name.stem if name and name.stem else path.resolve().parent.name
    files = ", ".join(printable(file.name) for file in digests)
    # Facets are a model's, whatever is known of the body.
    of_measured = "measured" if model in ("lambert", "spectral_texture") else "analytic"
    provenance = Provenance(
        source=f"{printable(label)}, a set of texture maps: {files}",
        licence="not stated in the files",
        kind=upsampling(uplift).provenance if measured is None else of_measured,
        notes=" + ".join(dict.fromkeys(notes)),
    )
    original: dict[str, Any] = {f"maps.{texture.slot}.file": printable(texture.file.name) for texture in every}
    kept = kept_maps(every, uplift)
    if measured is not None:
        original |= {"maps.albedo.file": printable(albedo.name), **measured.original}
        kept = {name: value for name, value in kept.items() if not name.startswith("uplift.")}
    original |= kept
    yield MaterialSource(f"maps/{id_word(label)}", "maps", model, parameters, provenance, path, original)


def _texture(role: str, file: Path, answer: ImportOptions) -> Texture:
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
    if role == "specular" and answer.specular_map:
        _check_specular(texture, answer.specular_map == "f0-srgb")
        return texture if answer.specular_map == "f0-srgb" else Texture(slot, data, "linear", file, role)
    coloured = role in _COLOURED and not texture.floating
    if role in _COLOURED:
        _check_space(role, file, texture.floating)
    return texture if coloured else Texture(slot, data, "linear", file, role)


def _check_space(role: str, file: Path, floating: bool) -> None:
    """Refuse colours whose name states another encoding than integers (sRGB) or floats (linear) have here."""
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


def _check_specular(texture: Texture, srgb: bool) -> None:
    """Refuse the map of `--specular-map` if the map itself states another encoding."""
    name = map_name(texture.file)
    space = (name.space if name else "").lower()
    contrary = texture.floating if srgb else space == "srgb"
    if contrary or (srgb and space not in ("", "srgb")):
        raise InputError(
            "not what --specular-map says",
            file=texture.file,
            field="specular",
            found="floats, which are linear" if texture.floating and srgb else f"{space}, by its name",
            expected="integers encoded as sRGB" if srgb else "linear numbers",
            hint=f"say --specular-map {'f0-linear' if srgb else 'f0-srgb'}, or correct its name",
        )


def _number(role: str, file: Path) -> str:
    at = members(file)[role].index(file)
    return f"-{at + 1}" if at else ""


def _check_unambiguous(path: Path, found: dict[str, list[Path]], answer: ImportOptions) -> None:
    for role in (*_RENDERED, *(("specular",) if answer.specular_map else ())):
        if len(found.get(role, ())) > 1:
            raise InputError(
                "two maps of one property",
                file=path,
                field=role,
                found=", ".join(printable(file.name) for file in found[role]),
                expected="one map a property",
                hint="move the one that does not count to another folder",
            )


def _check_sizes(path: Path, files: list[tuple[Path, tuple[int, int]]]) -> None:
    if len({size for _, size in files}) > 1:
        shown = (f"{printable(file.name)} {width} x {height}" for file, (height, width) in files)
        raise InputError(
            "maps of different sizes",
            file=path,
            field="size",
            found=", ".join(shown),
            expected="one size in a set",
            hint="export all maps in one resolution, or move those of another to a folder of their own",
        )


def _unrendered(textures: dict[str, list[Texture]], drawn: set[str], answer: ImportOptions) -> list[str]:
    rough = next((role for role in ("roughness", "packed", "gloss", "metallic_smoothness") if role in textures), "")
    metal = next((role for role in ("metallic", "packed", "metallic_smoothness") if role in textures), "")
    used = {"albedo", rough, metal, *drawn, "specular" if answer.specular_map else ""}
    names = [role for role in textures if role not in used]
    notes = [f"kept in the record and not rendered: {', '.join(sorted(names))}"] if names else []
    if "specular" in names:
        notes.append("the specular map does not say what it holds: say it with --specular-map f0-srgb or f0-linear")
    if "normal" in textures and "normal" not in drawn:
        notes.append("the normal map does not say whether green is up (OpenGL) or down (DirectX)")
    for several in textures.values():
        for texture in several:
            name = map_name(texture.file)
            if name and name.space.lower() not in ("", "raw", "linear") and name.role not in _COLOURED:
                notes.append(f"the {texture.slot} map is named {name.space}: its numbers are taken as they are")
    for role, words in (("normal_gl", "green up (OpenGL)"), ("normal_dx", "green down (DirectX)")):
        notes += [f"the normal map is named as one with {words}"] if role in textures else []
    return notes
