"""Surfaces as glTF 2.0 materials (Khronos 2021, section 3.9), in red, green and blue.

The core has base colour, metal, roughness, bumps and masks; `KHR_materials_specular` the reflectance of dielectric
facets, `KHR_materials_anisotropy` anisotropic highlights, `KHR_materials_clearcoat` a coat. A material of specular and
glossiness becomes one of metal and roughness that reflects the same: no metal, and a body of base (1 - largest of c).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, UInt

from ...runtime.errors import InputError
from ...spectral.srgb import linear_to_srgb
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..analytic.lambert import Lambert
from ..analytic.metallic_roughness import MetallicRoughness
from ..core.surface import Surface
from ..svbrdf.map_set import DIELECTRIC_F0, MapSet
from ..svbrdf.texel_map import TexelMap
from ..svbrdf.texture import SpectralTexture
from .gltf_writer import GltfWriter
from .shown_colours import shown_base, shown_colour

_REDUCED = "spectra are reduced to linear sRGB under D65: under other lights colours differ"
# Difference of numbers that is rounding alone.
_NEAR = 1e-9
# Tolerance of a code of 8 bits, in codes.
_EXACT = 1e-4
# Excess over [0, 1] of rounding, and of Mallett and Yuksel's white.
_ROUNDING = 1e-6


def gltf_material(surface: Surface, name: str, writer: GltfWriter) -> tuple[dict[str, Any], list[str]]:
    """Write a surface as a file's material, its textures added to the file; return it with notes on losses.

    Raises
    ------
    InputError : a surface that is neither of maps, nor a texture, nor Lambert's, nor of metal and roughness; colours
        that glTF cannot represent.
    """
    maps, coat, notes = _maps_of(surface)
    if maps.glossy:
        notes.append("specular and glossiness are written as metal and roughness that reflect the same")
        maps = _without_gloss(maps)
    if not maps.uplift:
        notes.append(_REDUCED)
        base = shown_base(maps)
        outside = int(((base < 0.0) | (base > 1.0 + 1e-6)).any(axis=2).sum())
        if outside:
            notes.append(f"{outside} of {base.shape[0] * base.shape[1]} colours lie outside sRGB and are clipped to it")
        maps = replace(
            maps, base=TexelMap(np.clip(base, 0.0, 1.0)), wavelengths_nm=WORKING_WAVELENGTHS_NM, uplift="mallett-yuksel"
        )
    material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": {}, "extensions": {}}
    _base(material, maps, writer, notes)
    _facets(material, maps, writer, notes)
    _reflected(material, maps, writer, notes)
    if maps.normal is not None:
        material["normalTexture"] = _bumps(maps.normal, maps, writer)
    coat = _coat(maps, writer, notes) if maps.coated else coat
    if coat is not None:
        material["extensions"]["KHR_materials_clearcoat"] = coat
    if not material["extensions"]:
        del material["extensions"]
    return material, notes


def _maps_of(surface: Surface) -> tuple[MapSet, dict[str, float] | None, list[str]]:
    """Return the surface as maps, its clear coat, and notes."""
    one, none = TexelMap.constant(1.0), TexelMap.constant(0.0)
    if isinstance(surface, MapSet):
        return surface, None, []
    if isinstance(surface, SpectralTexture):
        return MapSet(surface.wavelengths_nm, TexelMap(surface.texture), one, "", weight=none), None, []
    if isinstance(surface, Lambert):
        base = TexelMap.constant(*surface.reflectance.samples)
        return MapSet(surface.wavelengths_nm, base, one, "", weight=none), None, []
    if isinstance(surface, MetallicRoughness):
        return _of_metal_and_roughness(surface)
    raise InputError(
        "glTF has no words for this surface",
        found=surface.NAME,
        expected="maps, a texture, a Lambert surface, or metal and roughness",
        hint="export it as a table: --format mitsuba or merl",
    )


def _of_metal_and_roughness(surface: MetallicRoughness) -> tuple[MapSet, dict[str, float] | None, list[str]]:
    grid = surface.wavelengths_nm
    shown = np.array([shown_colour(each.samples, grid) for each in (surface.diffuse, surface.specular)])
    notes = [_REDUCED]
    if ((shown < -_NEAR) | (shown > 1.0 + 1e-6)).any():
        notes.append("a colour lies outside sRGB and is clipped to it")
    body, shine = np.clip(shown, 0.0, 1.0)
    edge, most = surface.edge, float(shine.max())
    metal = not body.any() and edge == 1.0
    if metal:
        base, metallic, weight, reflected = shine, 1.0, 1.0, np.full(3, DIELECTRIC_F0)
    else:
        # F = w (c + (1 - c) fall) is w c at the normal and w at grazing; the body is seen through 1 - the largest of F.
        metallic, weight = 0.0, edge
        reflected = shine / edge if edge > 0.0 else np.full(3, DIELECTRIC_F0)
        base = np.minimum(body * (1.0 - shine) / (1.0 - most), 1.0) if most < 1.0 else 0.0 * body
        if np.ptp(shine) > _NEAR and body.any():
            notes.append("under coloured facets the body is right at the normal, and a little off at grazing")
    alike = TexelMap.constant
    maps = MapSet(
        WORKING_WAVELENGTHS_NM,
        alike(*base),
        alike(float(np.sqrt(surface.alpha))),
        "mallett-yuksel",
        metallic=alike(metallic),
        reflected=alike(*reflected),
        weight=alike(weight),
    )
    coat = None
    if surface.coat > 0.0:
        coat = {"clearcoatFactor": surface.coat, "clearcoatRoughnessFactor": float(np.sqrt(surface.coat_alpha))}
    return maps, coat, notes


def _without_gloss(maps: MapSet) -> MapSet:
    """Convert specular and glossiness to no metal, with the same body, facets and Fresnel term."""
    most = np.minimum(maps.reflected.decoded(maps.reflected.values), 1.0).max(axis=2, keepdims=True)
    base = TexelMap(maps.base.decoded(maps.base.values) * (1.0 - most))
    none, one = TexelMap.constant(0.0), TexelMap.constant(1.0)
    return replace(maps, base=base, metallic=none, weight=one, glossy=False)


def _base(material: dict[str, Any], maps: MapSet, writer: GltfWriter, notes: list[str]) -> None:
    """Write base colour and, as its alpha, the mask."""
    colours, colour = coded(maps.base, True, "base colour", notes)
    factor, mask = list(colour), None
    if maps.coverage.size != (1, 1) and maps.cutoff > 0.0:
        mask, (opacity,) = coded(maps.coverage, False, "opacity", notes)
        factor.append(opacity)
        material |= {"alphaMode": "MASK", "alphaCutoff": maps.cutoff}
    pbr = material["pbrMetallicRoughness"]
    pbr["baseColorFactor"] = factor if len(factor) == 4 else [*factor, 1.0]
    if colours is None and mask is None:
        return
    planes = [filled(colours, 3)] + ([] if mask is None else [mask])
    pbr["baseColorTexture"] = writer.texture(_joined(planes), maps.placement)


def _facets(material: dict[str, Any], maps: MapSet, writer: GltfWriter, notes: list[str]) -> None:
    """Write metal and roughness, blue and green of one picture, and the anisotropy of highlights."""
    rough = maps.roughness
    if rough.values.shape[2] == 2:
        rough = _stretched(material, maps, writer)
    (roughness, (rough_factor,)), (metal, (metal_factor,)) = (
        coded(one, False, name, notes) for one, name in ((rough, "roughness"), (maps.metallic, "metal"))
    )
    pbr = material["pbrMetallicRoughness"]
    pbr |= {"roughnessFactor": rough_factor, "metallicFactor": metal_factor}
    if roughness is not None or metal is not None:
        planes = [filled(None, 1), filled(roughness, 1), filled(metal, 1)]
        pbr["metallicRoughnessTexture"] = writer.texture(_joined(planes), maps.placement)


def _stretched(material: dict[str, Any], maps: MapSet, writer: GltfWriter) -> TexelMap:
    """Write KHR_materials_anisotropy, whose alpha along is alpha + (1 - alpha) strength^2; the roughness across."""
    both = maps.roughness.decoded(maps.roughness.values) ** 2
    turn = 0.0 if maps.turn is None else maps.turn.decoded(maps.turn.values)
    # Along is the wider one: else both change places, and the direction turns by a right angle.
    turn = turn + np.where(both[..., :1] < both[..., 1:], 0.5 * np.pi, 0.0)
    wide, narrow = both.max(axis=2, keepdims=True), both.min(axis=2, keepdims=True)
    rest = 1.0 - narrow
    strength = np.sqrt(np.divide(wide - narrow, rest, out=np.zeros_like(rest), where=rest > 0.0))
    turn, strength = np.broadcast_arrays(turn, strength)
    said: dict[str, Any] = {"anisotropyStrength": 1.0}
    if turn.shape[:2] == (1, 1):
        said = {"anisotropyStrength": float(strength[0, 0, 0]), "anisotropyRotation": float(turn[0, 0, 0])}
    else:
        vectors = np.concatenate([0.5 + 0.5 * np.cos(turn), 0.5 + 0.5 * np.sin(turn), strength], axis=2)
        said["anisotropyTexture"] = writer.texture(unit_codes(vectors), maps.placement)
    material["extensions"]["KHR_materials_anisotropy"] = said
    return TexelMap(np.sqrt(narrow))


def _reflected(material: dict[str, Any], maps: MapSet, writer: GltfWriter, notes: list[str]) -> None:
    """Write KHR_materials_specular, if facets of dielectrics reflect differently from an index of 1.5."""
    colours, colour = coded(maps.reflected, True, "what facets reflect", notes)
    weights, (weight,) = coded(maps.weight, False, "specular", notes)
    said: dict[str, Any] = {"specularFactor": weight} if weight != 1.0 else {}
    if weights is not None:
        planes = [filled(None, 3), weights]
        said["specularTexture"] = writer.texture(_joined(planes), maps.placement)
    tint = [value / DIELECTRIC_F0 for value in (colour if len(colour) == 3 else 3 * colour)]
    if max(abs(value - 1.0) for value in tint) > _NEAR:
        said["specularColorFactor"] = tint
    if colours is not None:
        said["specularColorTexture"] = writer.texture(filled(colours, 3), maps.placement)
    if said:
        material["extensions"]["KHR_materials_specular"] = said


def _coat(maps: MapSet, writer: GltfWriter, notes: list[str]) -> dict[str, Any]:
    """Write KHR_materials_clearcoat: weight in red and roughness in green, of one picture, and its bumps."""
    (weights, (weight,)), (rough, (roughness,)) = (
        coded(one, False, name, notes)
        for one, name in ((maps.coat, "clear coat"), (maps.coat_roughness, "roughness of the clear coat"))
    )
    said: dict[str, Any] = {"clearcoatFactor": weight, "clearcoatRoughnessFactor": roughness}
    if weights is not None or rough is not None:
        picture = writer.texture(_joined([filled(weights, 1), filled(rough, 1), filled(None, 1)]), maps.placement)
        said |= {"clearcoatTexture": picture} if weights is not None else {}
        said |= {"clearcoatRoughnessTexture": picture} if rough is not None else {}
    if maps.coat_normal is not None:
        said["clearcoatNormalTexture"] = _bumps(maps.coat_normal, maps, writer)
    return said


def _bumps(normal: TexelMap, maps: MapSet, writer: GltfWriter) -> dict[str, Any]:
    """Return a normal map, green up: the original codes if it comes from a picture."""
    strength = normal.scale[0] / 2.0
    as_pictures_are = len(normal.scale) == 3 and normal.scale[2] == 2.0 and abs(normal.scale[1]) == normal.scale[0]
    as_pictures_are &= normal.offset == tuple(-0.5 * number for number in normal.scale)
    if normal.values.dtype.kind == "u" and as_pictures_are and strength > 0.0:
        codes = normal.values
        if normal.scale[1] < 0.0:
            codes = codes.copy()
            codes[..., 1] = np.iinfo(codes.dtype).max - codes[..., 1]
    else:
        vectors = normal.decoded(normal.values)
        codes = unit_codes(0.5 + 0.5 * vectors / np.linalg.norm(vectors, axis=2, keepdims=True))
        strength = 1.0
    said = writer.texture(codes, maps.placement)
    return said | ({"scale": strength} if strength != 1.0 else {})


def _joined(planes: list[np.ndarray]) -> np.ndarray:
    """Join planes as channels of one picture; codes of 8 bits are widened if any has 16."""
    if any(plane.dtype == np.uint16 for plane in planes):
        planes = [plane if plane.dtype == np.uint16 else plane.astype(np.uint16) * np.uint16(257) for plane in planes]
    size = max(plane.shape[:2] for plane in planes)
    return np.concatenate([np.broadcast_to(plane, (*size, plane.shape[2])) for plane in planes], axis=2)


def coded(
    one: TexelMap, srgb: bool, what: str, notes: list[str]
) -> tuple[UInt[np.ndarray, "H W C"] | None, tuple[float, ...]]:
    """Encode values: codes, None if all texels are equal, and their factors, C numbers.

    Codes of pictures are kept; other numbers become codes of 8 bits if these are exact, else of 16.

    Raises
    ------
    InputError : numbers below 0 or above 1, which are not clipped.
    """
    channels = one.values.shape[2]
    factor = one.scale * channels if len(one.scale) == 1 else one.scale
    if one.size == (1, 1):
        return None, tuple(_within(one.decoded(one.values), what)[0, 0].tolist())
    as_it_came = one.values.dtype.kind == "u" and one.srgb == srgb and not any(one.offset)
    if as_it_came and min(factor) >= 0.0 and max(factor) <= 1.0:
        return one.values, factor
    codes = unit_codes(_encoded(_within(one.decoded(one.values), what), srgb))
    if codes.dtype == np.uint16:
        notes.append(f"{what} is written with 16 bits a channel")
    return codes, (1.0,) * channels


def unit_codes(fractions: Float[np.ndarray, "H W C"]) -> UInt[np.ndarray, "H W C"]:
    """Encode fractions from 0 to 1 in 8 bits if that is exact, else as the nearest codes of 16."""
    exact = fractions * 255.0
    codes = np.rint(exact)
    if np.abs(exact - codes).max() <= _EXACT:
        return codes.astype(np.uint8)
    return np.rint(fractions * 65535.0).astype(np.uint16)


def filled(codes: UInt[np.ndarray, "H W C"] | None, channels: int) -> UInt[np.ndarray, "H W C"]:
    """Expand codes to `channels` channels, grey repeated; 1 everywhere if there are none."""
    if codes is None:
        return np.full((1, 1, channels), 255, np.uint8)
    return np.repeat(codes, channels, axis=2) if codes.shape[2] == 1 else codes


def _within(values: np.ndarray, what: str) -> np.ndarray:
    beyond = int(((values < -_ROUNDING) | (values > 1.0 + _ROUNDING)).sum())
    if beyond:
        raise InputError(
            "colours that glTF has no numbers for" if values.shape[-1] == 3 else "numbers that glTF does not have",
            field=what,
            found=f"{beyond} of {values.size} from {values.min():.3g} to {values.max():.3g}",
            expected="0 to 1, in linear sRGB",
            hint="export it as --format mitsuba, or a spectral texture as --format exr",
        )
    return np.clip(values, 0.0, 1.0)


def _encoded(linear: np.ndarray, srgb: bool) -> np.ndarray:
    """Encode linear light as sRGB, or return the numbers as they are."""
    return linear_to_srgb(linear) if srgb else linear
