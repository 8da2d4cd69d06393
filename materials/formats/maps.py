"""Loose texture maps: albedo, roughness, metallic, normal, ... in pictures of their own, told apart by their names.

The albedo stands for its set; its siblings in the same folder come with it. Integers are sRGB in an albedo and numbers
elsewhere; floats (OpenEXR, TIFF) are linear; a spectral OpenEXR picture as the albedo is measured reflectances, which
stay as they are. Every texel is rendered, or the mean of all where that is asked for or
maps say more than is drawn; the maps are kept as they came.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...spectral.errors import InputError
from ...spectral.files import existing_file
from ...spectral.formats.answer import NO_ANSWER, Answer
from ...spectral.upsampling import upsampling
from ..records.material import Provenance
from ..source import MaterialSource, Rejected
from ..svbrdf.maps import MappedSurface
from ..svbrdf.texel_map import TexelMap
from ..textures import Texture
from .measured import placed, sha256_of
from .naming import id_word, printable
from .pictures.drawn import MoreMaps, NotDrawn, drawn_maps
from .pictures.map_names import SUFFIXES, map_name, members
from .pictures.map_record import kept_maps
from .pictures.normal_maps import Green, green_of
from .pictures.stand_in import Colour, Number, SurfaceMaps, model_of
from .reading_cost import Cost, cost_of_bytes, cost_of_picture
from .spectral_base import SpectralBase, mean_of, read_spectral_base
from .spectral_channels import is_spectral_base

__all__ = ["ASKS_MORE", "NAME", "SUFFIXES", "companions", "read_sources", "recognises"]

NAME = "texture maps"
#: It asks how maps are drawn.
ASKS_MORE = True
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


def reading_cost(path: Path) -> Cost:
    """Of a spectral albedo, as its header counts its pixels."""
    return cost_of_picture(path) if is_spectral_base(path) else cost_of_bytes(path)


def read_sources(path: Path, uplift: str, answer: Answer = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """The one record, "maps/NAME", of the set that a map belongs to.

    Raises
    ------
    InputError
        No albedo, two maps of one property, maps of different sizes; a picture that cannot be read or is too large;
        colours that no reflectance has; a normal map that does not say which way is up, normals that are none.
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
    (albedo,) = found["albedo"]
    measured = read_spectral_base(albedo) if is_spectral_base(albedo) else None
    textures = {
        role: [_texture(role, file) for file in files]
        for role, files in found.items()
        if role != "albedo" or measured is None
    }
    every = [texture for several in textures.values() for texture in several]
    sizes = [(texture.file, texture.size) for texture in every]
    _check_sizes(path, sizes if measured is None else [(albedo, measured.size), *sizes])
    notes: list[str] = []
    with placed(albedo, "albedo"):
        model, parameters, drawn = _surface(textures, measured, uplift, answer, notes)
    notes += _unrendered(textures, drawn) + [note for texture in every for note in texture.notes]
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


def _surface(
    textures: dict[str, list[Texture]], measured: SpectralBase | None, uplift: str, answer: Answer, notes: list[str]
) -> tuple[str, dict[str, Any], set[str]]:
    """Model, parameters, and the properties that are drawn beside colour, roughness and metal; what was assumed is
    added to `notes`.
    """
    only = {role: several[0] for role, several in textures.items()}
    albedo = only.get("albedo")
    notes += measured.notes if measured is not None else ()
    if albedo is not None and albedo.floating:
        beyond = int(((albedo.values[..., :3] < 0) | (albedo.values[..., :3] > 1)).sum())
        notes += [f"{beyond} values of the albedo are below 0 or above 1, and kept so"] if beyond else []
    if albedo is not None and albedo.values.shape[2] in (2, 4) and np.ptp(albedo.values[..., -1]) > 0:
        notes.append("the alpha of the albedo is kept and not rendered")
    roughness, metallic = _roughness(only, notes), _metallic(only, notes)
    maps = SurfaceMaps(base=Colour(albedo), metallic=metallic or Number(scale=0.0), roughness=roughness or Number())
    facets = roughness or metallic
    if facets:
        notes += ["no roughness map: taken as 1"] if roughness is None else []
    else:
        notes.append("no map of roughness or metal: taken to be perfectly diffuse")
    if answer.maps != "mean":
        try:
            surface, said, drawn = _drawn(textures, maps, measured, facets is None, uplift, answer)
            if surface is not None:
                notes += said
                return "maps", surface.parameters(), drawn
        except NotDrawn as reason:
            notes.append(f"not drawn texel by texel: {reason}")
    if measured is not None:
        notes.append("what is rendered is the mean of the maps")
        return (*mean_of(drawn_maps(maps, _more(measured, facets is None), "")[0], facets is None), set())
    parameters, more_notes = model_of(maps, uplift)
    notes += more_notes
    if facets:
        return "metallic_roughness", dict(parameters), set()
    lambert = {"wavelengths_nm": parameters["wavelengths_nm"], "reflectance": parameters["diffuse"]}
    return "lambert", lambert, set()


def _more(measured: SpectralBase | None, matt: bool, mends: bool = False) -> MoreMaps:
    if measured is None:
        return MoreMaps(matt=matt, mends=mends)
    spectra = (measured.wavelengths_nm, TexelMap(measured.values))
    return MoreMaps(matt=matt, mends=mends, spectra=spectra)


def _drawn(
    textures: dict[str, list[Texture]],
    maps: SurfaceMaps,
    measured: SpectralBase | None,
    matt: bool,
    uplift: str,
    answer: Answer,
) -> tuple[MappedSurface | None, list[str], set[str]]:
    """The surface of all texels, None where they are alike; notes; and which of the other properties it shows."""
    notes: list[str] = []
    drawn: set[str] = set()
    more = _more(measured, matt, answer.maps == "mended")
    role = next((role for role in ("normal_gl", "normal_dx", "normal") if role in textures), "")
    if role:
        if len(textures[role]) > 1:
            raise NotDrawn(f"{len(textures[role])} normal maps, of which one can count")
        drawn.add(role)
        more = replace(more, normal=textures[role][0], green=_green(role, textures, answer, notes))
    if "opacity" in textures:
        opacity = textures["opacity"][0]
        codes = opacity.band(0, slice(0, opacity.size[0]))
        if ((codes == 0.0) | (codes == 1.0)).all():
            drawn.add("opacity")
            maps = replace(maps, coverage=Number(opacity), cutoff=0.5)
        else:
            notes.append("the opacity map is no mask of 0 and 1: it is rendered opaque")
    surface, said = drawn_maps(maps, more, uplift)
    return surface, notes + said, drawn


def _green(role: str, textures: dict[str, list[Texture]], answer: Answer, notes: list[str]) -> Green:
    """Which way green points in a normal map: by its name, by itself, or as it was answered."""
    if role != "normal":
        return "opengl" if role == "normal_gl" else "directx"
    texture = textures[role][0]
    proved = green_of(texture)
    if proved and answer.normal_map in (None, proved):
        up = "up (OpenGL)" if proved == "opengl" else "down (DirectX)"
        notes.append(f"green is {up} in the normal map: so its slopes are those of one height")
        return proved
    if answer.normal_map is None or proved:
        raise InputError(
            "a normal map that does not say which way is up" if proved is None else "not what --normal-map says",
            field=printable(texture.file.name),
            found="slopes that are no height's either way" if proved is None else f"slopes of a height by {proved}",
            expected="a name that ends in nor_gl, nor_dx, NormalGL or NormalDX",
            hint="say it with --normal-map opengl or directx, or do without it with --maps mean",
        )
    notes.append(f"the normal map is taken as that of {answer.normal_map}: so it was answered")
    return answer.normal_map


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


def _unrendered(textures: dict[str, list[Texture]], drawn: set[str]) -> list[str]:
    rough = next((role for role in ("roughness", "packed", "gloss", "metallic_smoothness") if role in textures), "")
    metal = next((role for role in ("metallic", "packed", "metallic_smoothness") if role in textures), "")
    used = {"albedo", rough, metal, *drawn}
    names = [role for role in textures if role not in used]
    notes = [f"kept in the record and not rendered: {', '.join(sorted(names))}"] if names else []
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
