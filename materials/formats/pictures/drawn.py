"""Maps of a material as a surface rendered texel by texel; or the reason why that is impossible."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from ....spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...svbrdf.map_set import DIELECTRIC_F0, WHOLE, Placement, check_normals
from ...svbrdf.maps import MappedSurface
from ...svbrdf.texel_map import TexelMap
from ...svbrdf.texels import look_up
from ...svbrdf.textures import Texture
from .normal_maps import Green, is_level, mended, normals_of
from .stand_in import Colour, Number, SurfaceMaps

_CUT = "where the mask leaves nothing, what lies behind is seen; it casts no shadows, but of light from all around"
_NO_NORMALS = "mend them and import it again, or take them as level with --maps mended, or do without with --maps mean"


class NotDrawn(Exception):
    """Reason why maps are rendered by their mean and not texel by texel."""


@dataclass(frozen=True)
class MoreMaps:
    """Maps without a mean, beside `SurfaceMaps`.

    normal : the map, which way its green points, and what its x and y are multiplied by; coat_normal : of a clear coat,
        OpenGL's.
    strength, direction, turn : of a stretched highlight (KHR_materials_anisotropy): how much, the direction in red and
        green, and radians beside it.
    placement : of all maps on the mesh. matt : there is only the body. mends : invalid normals become level.
    spectra : wavelengths, nm (L,), and measured reflectances in as many channels, in place of the base colour.
    """

    normal: Texture | None = None
    green: Green = "opengl"
    normal_scale: float = 1.0
    coat_normal: Texture | None = None
    coat_normal_scale: float = 1.0
    strength: Number = field(default_factory=lambda: Number(scale=0.0))
    direction: Texture | None = None
    turn: float = 0.0
    placement: Placement = WHOLE
    matt: bool = False
    mends: bool = False
    spectra: tuple[Float[np.ndarray, " L"], TexelMap] | None = None


def drawn_maps(maps: SurfaceMaps, more: MoreMaps, uplift: str) -> tuple[MappedSurface | None, list[str]]:
    """Return the surface, and its assumptions in words; None if all texels are equal, so that their mean is exact.

    Raises
    ------
    NotDrawn : there are properties that are not rendered texel by texel.
    InputError : an invalid normal, by its row and column; a texture that cannot be decoded.
    """
    notes: list[str] = []
    found = {"base": _colour(maps.base), "roughness": _number(maps.roughness), "weight": _number(maps.weight)}
    found |= {"metallic": _number(maps.metallic), "reflected": _colour(maps.reflected)}
    grid = WORKING_WAVELENGTHS_NM
    if more.spectra is not None:
        (grid, found["base"]), uplift = more.spectra, ""
        if maps.reflected == SurfaceMaps().reflected:
            # One number, and no colour that would have to be made up.
            found["reflected"] = TexelMap.constant(DIELECTRIC_F0)
    if more.matt:
        found |= {"weight": TexelMap.constant(0.0), "roughness": TexelMap.constant(1.0)}
    cutoff = 0.0
    if maps.cutoff is not None:
        found["coverage"], cutoff = _number(maps.coverage), maps.cutoff
        notes.append(_CUT)
    elif maps.coverage.texture is not None or maps.coverage.scale < 1.0:
        opacity = _number(maps.coverage)
        codes = opacity.decoded(opacity.values)
        if ((codes == 0.0) | (codes == 1.0)).all():
            found["coverage"], cutoff = opacity, 0.5
            notes.append(f"what is blended is all there or not at all, so that it is a mask: {_CUT}")
        else:
            notes.append("what is blended is rendered opaque")
    if maps.coat.scale > 0.0 and not more.matt:
        found |= {"coat": _number(maps.coat), "coat_roughness": _number(maps.coat_roughness)}
        found |= _bumps("coat_normal", more.coat_normal, "opengl", more.coat_normal_scale, more.mends, notes)
    found |= _bumps("normal", more.normal, more.green, more.normal_scale, more.mends, notes)
    found = {name: one if name == "base" and more.spectra else _alike(one) for name, one in found.items()}
    _check_colours(found, more.spectra is not None)
    sizes = list(dict.fromkeys(one.size for one in found.values() if one.size != (1, 1)))
    size = max(sizes, key=lambda size: size[0] * size[1], default=(1, 1))
    if len(sizes) > 1:
        shown = ", ".join(f"{width} x {height}" for height, width in sizes)
        notes.append(f"maps of different sizes ({shown}) were brought to {size[1]} x {size[0]}, linear between texels")
    found = {name: _brought_to(size, one, more.placement) for name, one in found.items()}
    if more.strength.scale > 0.0:
        found |= _stretched(found["roughness"], more, size)
    if (
        more.spectra is None
        and not {"normal", "coat_normal", "turn"} & set(found)
        and all(one.size == (1, 1) for one in found.values())
    ):
        return None, []
    surface = MappedSurface(grid, uplift=uplift, glossy=maps.glossy, cutoff=cutoff, placement=more.placement, **found)
    height, width = surface.size
    return surface, [f"{width} x {height} texels, each of which is rendered", *notes]


def _bumps(
    name: str, texture: Texture | None, green: Green, scale: float, mends: bool, notes: list[str]
) -> dict[str, TexelMap]:
    """Return the normal map of that name, if it is not level; adds remarks to `notes`."""
    if texture is None:
        return {}
    normal, said = normals_of(texture, green, scale)
    normal, mending = mended(normal) if mends else (normal, [])
    notes += said + mending
    try:
        check_normals(normal, name)
    except InputError as reason:
        raise reason.at(hint=_NO_NORMALS) from None
    return {} if is_level(normal) else {name: normal}


def _colour(part: Colour) -> TexelMap:
    if part.texture is None:
        return TexelMap.constant(*part.scale)
    values = part.texture.values
    values = values[..., :3] if values.shape[2] >= 3 else np.repeat(values[..., :1], 3, axis=2)
    srgb = part.texture.encoding == "sRGB" and values.dtype.kind == "u"
    return TexelMap(np.ascontiguousarray(values), srgb, tuple(part.scale))


def _number(part: Number) -> TexelMap:
    texture, scale = part.texture, part.scale
    if texture is None or (part.channel == 3 and texture.values.shape[2] not in (2, 4)):
        return TexelMap.constant(1.0 - scale if part.inverted else scale)
    channels = texture.values.shape[2]
    at = -1 if part.channel == 3 else part.channel if channels >= 3 else 0
    values = np.ascontiguousarray(texture.values[..., at][..., None])
    return TexelMap(values, False, (-scale,), (1.0,)) if part.inverted else TexelMap(values, False, (scale,))


def _alike(one: TexelMap) -> TexelMap:
    """Reduce a map to one texel if all are equal."""
    alike = not (one.values != one.values[:1, :1]).any()
    return replace(one, values=one.values[:1, :1]) if alike else one


def _check_colours(found: dict[str, TexelMap], measured: bool) -> None:
    """Refuse numbers beyond 0 and 1, possible in floats: their mean may be valid, a single texel is not.

    Noise of measurements is accepted.
    """
    for name in ("base", "reflected", "roughness", "metallic", "weight", "coat", "coat_roughness"):
        one = found.get(name, TexelMap.constant(0.0))
        if name == "base" and measured:
            continue
        if one.values.dtype.kind == "f" and one.size != (1, 1):
            values = one.decoded(one.values)
            beyond = int(((values < 0.0) | (values > 1.0)).sum())
            if beyond:
                raise NotDrawn(f"{beyond} values of the {name} map are below 0 or above 1")


def _brought_to(size: tuple[int, int], one: TexelMap, placement: Placement) -> TexelMap:
    """Resample a map to another size, linear between its texels."""
    if one.size in ((1, 1), size):
        return one
    height, width = size
    across, down = np.meshgrid((np.arange(width) + 0.5) / width, 1.0 - (np.arange(height) + 0.5) / height)
    uv = np.stack([across.ravel(), down.ravel()], axis=1)
    values = look_up(one.decoded(one.values), uv, placement.wrap).reshape(height, width, -1)
    return TexelMap(values.astype(np.float32))


def _stretched(roughness: TexelMap, more: MoreMaps, size: tuple[int, int]) -> dict[str, TexelMap]:
    """Compute roughness along and across the direction of KHR_materials_anisotropy, and its rotation from u."""
    strength = _brought_to(size, _alike(_number(more.strength)), more.placement)
    alpha = roughness.decoded(roughness.values) ** 2
    share = strength.decoded(strength.values) ** 2
    along = alpha + (1.0 - alpha) * share
    both = np.concatenate(np.broadcast_arrays(np.sqrt(along), np.sqrt(alpha)), axis=-1)
    turn = TexelMap.constant(more.turn)
    if more.direction is not None:
        values = _fitting(more.direction)
        angle = np.arctan2(values[..., 1:2], values[..., :1]) + more.turn
        if angle.shape[:2] != size:
            raise NotDrawn("directions of stretched highlights in a map of another size")
        turn = TexelMap(angle.astype(np.float32))
    return {"roughness": TexelMap(both.astype(np.float32)), "turn": turn}


def _fitting(direction: Texture) -> np.ndarray:
    """Decode x and y of the directions in red and green."""
    values = direction.values
    if values.shape[2] < 3:
        raise InputError(
            "a map of directions without colours",
            file=direction.file,
            field=direction.field,
            found="grey",
            expected="x and y in red and green",
        )
    whole = TexelMap(np.ascontiguousarray(values[..., :2]), False, (2.0,), (-1.0,))
    return whole.decoded(whole.values)
