"""Surface of a set of texture maps: its properties from the pictures that hold them, by texel or on average.

Ambiguities of a map are asked for (`ImportOptions`), not guessed: the direction of green in a normal map, and the
meaning of a specular map. The latter may be F at the normal, in red, green and blue: then

    f_r = (1 - largest of F) albedo / pi + F D G / (4 cos cos)      as for glTF's dielectrics, of any reflectance
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from ...spectral.formats.import_options import ImportOptions
from ..svbrdf.maps import MappedSurface
from ..svbrdf.texel_map import TexelMap
from ..svbrdf.textures import Texture
from .naming import printable
from .pictures.drawn import MoreMaps, NotDrawn, drawn_maps
from .pictures.normal_maps import Green, green_of
from .pictures.stand_in import Colour, Number, SurfaceMaps, model_of
from .spectral_base import SpectralBase, mean_of


def surface_of(
    textures: dict[str, list[Texture]],
    measured: SpectralBase | None,
    uplift: str,
    answer: ImportOptions,
    notes: list[str],
) -> tuple[str, dict[str, Any], set[str]]:
    """Return model, parameters, and the further properties that are rendered; adds assumptions to `notes`."""
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
    facets = bool(roughness or metallic)
    if answer.specular_map and "specular" in only:
        encoding = only["specular"].encoding
        notes.append(f"the specular map is F at the normal, the colour of facets, {encoding}: as you said")
        notes += [] if measured is None else ["its spectra are by mallett-yuksel, of linear sRGB"]
        maps, facets = replace(maps, reflected=Colour(only["specular"])), True
    if facets:
        notes += ["no roughness map: taken as 1"] if roughness is None else []
    else:
        notes.append("no map of roughness or metal: taken to be perfectly diffuse")
    if answer.maps != "mean":
        try:
            surface, said, drawn = _drawn(textures, maps, measured, not facets, uplift, answer)
            if surface is not None:
                notes += said
                return "maps", surface.parameters(), drawn
        except NotDrawn as reason:
            notes.append(f"not drawn texel by texel: {reason}")
    if measured is not None:
        notes.append("what is rendered is the mean of the maps")
        return (*mean_of(drawn_maps(maps, _more(measured, not facets), "")[0], not facets), set())
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
    answer: ImportOptions,
) -> tuple[MappedSurface | None, list[str], set[str]]:
    """Return the surface of all texels, None if they are equal; notes; and the other properties that it renders."""
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


def _green(role: str, textures: dict[str, list[Texture]], answer: ImportOptions, notes: list[str]) -> Green:
    """Determine the direction of green in a normal map: by its name, by its content, or by the answer."""
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
    notes.append(f"the normal map is taken as that of {answer.normal_map}: as you said")
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
