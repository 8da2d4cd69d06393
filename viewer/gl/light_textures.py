"""Area, environment and indirect light, and their occlusion, as textures and uniforms for `environment.glsl`,
`panel.glsl`, `indirect.glsl` and `hidden.glsl`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...lighting.environment import octahedral, polygon
from ...lighting.environment.bright_light import BrightLight
from ...lighting.environment.panel import GatheredPanel
from ...lighting.environment.prefiltering import GatheredLight
from ...lighting.environment.pyramid import SOFTENING
from ...lighting.transfer.diffuse_albedo import EVEN_Z, EVEN_ZZ
from ...lighting.transfer.indirect import IndirectLight
from ...lighting.transfer.radiance_maps import BLUNT, FIRST, LEVELS
from ...lighting.visibility.compression import SOFT, unpack_codes
from ...lighting.visibility.edge_bisection import Halving
from ...lighting.visibility.hidden_light import HiddenLight
from ...lighting.visibility.visibility import SceneVisibility
from .resources import ROW_LENGTH, Owner

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True, eq=False)
class LightTables:
    """Tables of a light for a shader: `#define`s, uniforms and textures by name, and the textures' owner."""

    sizes: dict[str, int | float]
    uniforms: dict[str, object]
    textures: dict[str, moderngl.Texture]
    owner: Owner


def light_tables(context: moderngl.Context, gathered: GatheredLight, fields: slice) -> LightTables:
    """Upload at most four fields of a prefiltered environment: levels one below the other, each with a border of one
    texel.
    """
    pyramid, owner = gathered.pyramid, Owner(context)
    padded = [_bordered(level[..., fields]) for level in pyramid.levels]
    rows = np.cumsum([0, *(len(level) for level in padded)])
    stacked = np.zeros((rows[-1], max(len(level) for level in padded), 4), dtype=np.float32)
    for level, top in zip(padded, rows.tolist(), strict=False):
        stacked[top : top + len(level), : len(level)] = level
    there = np.zeros((*pyramid.fields.shape[1:], 4), dtype=np.float32)
    there[..., : len(pyramid.fields[fields])] = np.moveaxis(pyramid.fields[fields], 0, -1)
    side = gathered.irradiance.shape[0]
    moments = [_bordered(gathered.irradiance[:, :, k, fields]) for k in range(gathered.irradiance.shape[2])]
    textures = {"pyramid": stacked, "irradiance": np.concatenate(moments, axis=1), "fields": there}
    places = [(float(top), float(len(level) - 2)) for level, top in zip(padded, rows.tolist(), strict=False)]
    return LightTables(
        {"ENVIRONMENT_LEVELS": len(padded), "SOFTENING": SOFTENING, "IRRADIANCE_SIDE": side},
        {"environment_levels": places, "environment_sharpness": pyramid.sharpness.tolist()},
        {name: owner.texels(values) for name, values in textures.items()},
        owner,
    )


def panel_tables(context: moderngl.Context, panel: GatheredPanel) -> LightTables:
    """Return the tables of a softbox: uniforms alone."""
    nodes = [(float(at), float(weight)) for at, weight in zip(polygon.AT, polygon.WEIGHTS, strict=True)]
    return LightTables(
        {"PANEL": 1, "PANEL_CELLS": len(panel.cells), "PANEL_NODES": len(nodes)},
        {
            "panel_corners": [tuple(one) for one in panel.corners.tolist()],
            "panel_cells": [tuple(one) for one in panel.cells.tolist()],
            "panel_facing": tuple(panel.facing.tolist()),
            "panel_luminance": panel.luminance,
            "panel_cell_area": panel.cell_area,
            "panel_nodes": nodes,
        },
        {},
        Owner(context),
    )


def _bordered(level: Float[np.ndarray, "side side K"]) -> Float[np.ndarray, "padded padded 4"]:
    found = octahedral.bordered(level)
    return np.pad(found, ((0, 0), (0, 0), (0, 4 - found.shape[2]))).astype(np.float32)


def bright_tables(context: moderngl.Context, bright: BrightLight, fields: slice) -> LightTables:
    """Upload the bright parts of at most four fields."""
    parts, owner = bright.parts, Owner(context)
    count = len(parts.axis)
    axes, amplitudes = np.zeros((max(count, 1), 4)), np.zeros((max(count, 1), 4))
    axes[:count, :3], axes[:count, 3] = parts.axis, parts.sharpness
    chosen = parts.amplitude[:, fields]
    amplitudes[:count, : chosen.shape[1]] = chosen
    lux = np.zeros((max(count, 1), bright.lux.shape[1], 1), dtype=np.float32)
    lux[:count, :, 0] = bright.lux
    one = len(axes) == 1
    return LightTables(
        {"MOST_BRIGHT": len(axes)},
        {
            "bright": count,
            "narrow": bright.narrow,
            # GL treats an array of length one as a scalar.
            "bright_axes": tuple(axes[0]) if one else [tuple(axis) for axis in axes],
            "bright_amplitudes": tuple(amplitudes[0]) if one else [tuple(each) for each in amplitudes],
        },
        {"bright_lux": owner.texture((lux.shape[1], lux.shape[0]), 1, lux.tobytes())},
        owner,
    )


def visibility_tables(context: moderngl.Context, visibility: SceneVisibility) -> LightTables:
    """Upload the codes of sites and their axes; each row of the table of sites has complete sites."""
    owner, side = Owner(context), round(len(visibility.mean) ** 0.5)
    # GL has no empty arrays; identical sites need no codes.
    quads = max(1, len(visibility.steps) // 4)
    planes = np.zeros((side, side, quads + 1, 4), dtype=np.float32)
    axes = visibility.axes * visibility.steps
    planes.reshape(side, side, -1)[..., : axes.shape[1]] = axes.reshape(side, side, -1)
    planes[..., quads, 0] = visibility.mean.reshape(side, side)
    beside = [octahedral.bordered(planes[:, :, quad]) for quad in range(quads + 1)]
    codes = unpack_codes(visibility.whole, visibility.halves)
    held = np.zeros((len(codes), quads, 4), dtype=np.float32)
    held.reshape(len(held), -1)[:, : codes.shape[1]] = codes
    sites = np.stack([visibility.fronts, visibility.backs], axis=1).astype(np.int32)
    a_row = ROW_LENGTH // quads
    most = float(np.tanh(0.5 * np.pi / SOFT))
    return LightTables(
        {"HIDDEN": 1, "MAP_QUADS": quads, "MAP_SIDE": side, "SITES_A_ROW": a_row, "MAP_SOFT": SOFT, "MOST_BENT": most},
        {"map_quads": quads},
        {
            "map_axes": owner.texels(np.concatenate(beside, axis=1)),
            "sites": owner.table(held, a_row, quads),
            "sites_of": owner.table(sites, ROW_LENGTH),
            "nodes": owner.table(_nodes(visibility.refinement), ROW_LENGTH),
        },
        owner,
    )


def hidden_tables(
    context: moderngl.Context, hidden: HiddenLight, visibility: SceneVisibility, fields: slice
) -> LightTables:
    """Upload the occluded light of sites for at most four fields, and the axes of maps in the directions of bright
    parts.
    """
    owner, quads = Owner(context), max(1, len(visibility.steps) // 4)
    sites, moments, _ = hidden.lost.shape
    held = np.zeros((sites, moments + 1, 4), dtype=np.float32)
    light = np.concatenate([hidden.lost, hidden.whole[:, None]], axis=1)[..., fields]
    held[..., : light.shape[-1]] = light
    maps = np.zeros((max(len(hidden.axes), 1), quads + 1, 4), dtype=np.float32)
    axes = hidden.axes * visibility.steps
    maps.reshape(len(maps), -1)[: len(axes), : axes.shape[1]] = axes
    maps[: len(axes), quads, 0] = hidden.mean
    a_row = ROW_LENGTH // (moments + 1)
    textures = {"site_light": owner.table(held, a_row, moments + 1), "bright_maps": owner.texels(maps)}
    return LightTables({"LIT_A_ROW": a_row}, {}, textures, owner)


def indirect_tables(context: moderngl.Context, light: IndirectLight, fields: slice) -> LightTables:
    """Upload at most four fields of indirect light."""
    owner, (sites, values) = Owner(context), light.at_sites.shape[:2]
    sites_of = np.stack([light.fronts, light.backs], axis=1).astype(np.int32)
    sizes: dict[str, int | float] = {
        "INDIRECT": 1,
        "INDIRECT_A_ROW": ROW_LENGTH // values,
        "EVEN_Z": EVEN_Z,
        "EVEN_ZZ": EVEN_ZZ,
    }
    textures = {
        "indirect": owner.table(_four(light.at_sites[..., fields], np.float32), ROW_LENGTH // values, values),
        "sites_of": owner.table(sites_of, ROW_LENGTH),
        "nodes": owner.table(_nodes(light.refinement), ROW_LENGTH),
    }
    if light.maps is None:
        return LightTables(sizes, {}, textures, owner)
    maps = light.maps
    of_site = np.zeros((sites, 4), dtype=np.float32)
    of_site[:, 3], there = maps.number, maps.number >= 0
    of_site[there, :3] = maps.normals[maps.number[there]]
    a_row = ROW_LENGTH // maps.values.shape[1]
    textures["map_of_site"] = owner.table(of_site, ROW_LENGTH)
    textures["radiance_maps"] = owner.table(_four(maps.values[..., fields], np.float16), a_row, maps.values.shape[1])
    sizes |= {
        "MAP_LEVELS": len(LEVELS),
        "MAP_TEXELS": maps.values.shape[1],
        "MAPS_A_ROW": a_row,
        "BLUNT": BLUNT,
        "SOFTENING": SOFTENING,
    }
    levels = [(sharpness, float(first), float(side)) for (sharpness, side), first in zip(LEVELS, FIRST, strict=True)]
    scale = np.pad(maps.scale[fields], (0, 4 - len(maps.scale[fields])))
    return LightTables(sizes, {"map_levels": levels, "map_scale": tuple(scale)}, textures, owner)


def _four(values: Float[np.ndarray, "n T F"], dtype: type) -> Float[np.ndarray, "n T 4"]:
    """Pad to four fields, the channels of a texel."""
    held = np.zeros((*values.shape[:2], 4), dtype=dtype)
    held[..., : values.shape[2]] = values
    return held


def _nodes(refinement: Halving) -> np.ndarray:
    """Encode a `Halving` with four numbers per triangle, its vertices and the row of its first cut, -1 for none,
    followed by four per cut: its corner, its midpoint and the rows of the next cuts.
    """
    count = len(refinement.corners)
    following = np.where(refinement.next >= 0, count + refinement.next, -1)
    whole = np.column_stack([refinement.corners, following[:count]])
    cuts = np.column_stack([refinement.opposite, refinement.middle, following[count:].reshape(-1, 2)])
    return np.concatenate([whole, cuts]).astype(np.int32)
