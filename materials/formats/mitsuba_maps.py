"""Writer of surfaces of maps as a Mitsuba 3 scene, the maps beside it as OpenEXR pictures.

A matt surface becomes Mitsuba's `diffuse`, any other its `principled`, whose facets are the same GGX, but whose body is
Disney's and whose Fresnel term is that of glass: similar, not equal. Bumps become `normalmap`, holes `mask`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...spectral.formats.exr import write_exr
from ..svbrdf.map_set import DIELECTRIC_F0, ROUNDING, MapSet
from ..svbrdf.texel_map import TexelMap
from .mitsuba_writer import element, write_scene
from .shown_colours import shown_base

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def write_mitsuba_maps(folder: Path, surface: MapSet, comment: str = "") -> tuple[str, ...]:
    """Write `scene.xml` and a picture a map into a folder; notes on how it was done.

    Raises
    ------
    InputError : a folder that cannot be written to.
    """
    notes = ["the maps are OpenEXR pictures beside the scene; Mitsuba makes spectra of their colours itself"]
    base = _texture(folder, "base_color", shown_base(surface), surface)
    matt = _is(surface.weight, 0.0) and _is(surface.metallic, 0.0)
    if matt:
        base.set("name", "reflectance")
        bsdf = element("bsdf", base, type="diffuse")
    else:
        rough = surface.roughness.decoded(surface.roughness.values)
        if rough.shape[2] == 2:
            notes.append("highlights are not stretched: the geometric mean of both roughnesses is written")
            rough = np.sqrt(rough.prod(axis=2, keepdims=True))
        if not (_is(surface.weight, 1.0) and _is(surface.reflected, DIELECTRIC_F0)):
            notes.append("what dielectric facets reflect is taken as 4 %, and not what the maps say")
        metal = surface.metallic.decoded(surface.metallic.values)
        numbers = [
            _texture(folder, name, values, surface, True)
            for name, values in (("roughness", rough), ("metallic", metal))
        ]
        bsdf = element("bsdf", base, *numbers, element("float", name="specular", value="0.5"), type="principled")
        notes.append("Mitsuba's principled is near the material, and not the same: another body, another Fresnel term")
    if surface.normal is not None:
        vectors = surface.normal.decoded(surface.normal.values)
        vectors = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        bumps = _texture(folder, "normalmap", 0.5 + 0.5 * vectors, surface, True)
        bsdf = element("bsdf", bumps, bsdf, type="normalmap")
    if not _is(surface.coverage, 1.0):
        there = (surface.coverage.decoded(surface.coverage.values) >= surface.cutoff - ROUNDING).astype(np.float64)
        bsdf = element("bsdf", _texture(folder, "opacity", there, surface, True), bsdf, type="mask")
        notes.append("what is cut out lets light through there, and is black here")
    if surface.coated:
        notes.append("the clear coat is left out: that of Mitsuba's principled is another")
    if len(set(surface.placement.wrap)) > 1:
        notes.append(f"beyond its edges the picture goes on as along u ({surface.placement.wrap[0]}), also along v")
    write_scene(folder, bsdf, comment, tuple(notes))
    return tuple(notes)


def _is(one: TexelMap, number: float) -> bool:
    return bool((one.decoded(one.values) == number).all())


def _texture(folder: Path, name: str, values: np.ndarray, surface: MapSet, raw: bool = False) -> Element:
    """Return a constant number, or a picture with its placement on the mesh."""
    if values.shape[:2] == (1, 1) and values.shape[2] == 1:
        return element("float", name=name, value=f"{values.item():.9g}")
    channels = "RGB" if values.shape[2] == 3 else "Y"
    planes = {channel: values[..., at].astype(np.float32) for at, channel in enumerate(channels)}
    write_exr(folder / f"{name}.exr", {}, planes)
    place = surface.placement
    # Mitsuba's v grows downwards, from row 0 of the picture and from the north of its sphere.
    left, top = place.offset[0], 1.0 - place.scale[1] - place.offset[1]
    moved = element(
        "transform",
        element("scale", x=f"{place.scale[0]:.9g}", y=f"{place.scale[1]:.9g}"),
        element("translate", x=f"{left:.9g}", y=f"{top:.9g}"),
        name="to_uv",
    )
    return element(
        "texture",
        element("string", name="filename", value=f"{name}.exr"),
        element("boolean", name="raw", value="true" if raw else "false"),
        element("string", name="wrap_mode", value=place.wrap[0]),
        moved,
        type="bitmap",
        name=name,
    )
