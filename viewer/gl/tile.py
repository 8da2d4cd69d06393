"""Tiles of the GL renderer: textures of visible geometry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from ..render.cache import KeptTerms, Tile
from ..render.layers import SpreadLayer
from ..render.raster import SUBSTEPS, WindowTriangles
from .environment_light import FRAMES
from .resources import Owner

if TYPE_CHECKING:
    import moderngl

# Indices of a part's first and last triangle, and its box of pixels.
Place = tuple[tuple[int, int], tuple[int, int, int, int]]


@dataclass(eq=False)
class GLTile(Tile):
    """Tile on the GPU.

    covered : share of each pixel's samples that see a surface.
    seen : triangle index + 1 at each sample, 0 for none.
    parts : for each part its first and last triangle index + 1 and the pixels that it may touch (x, y, width, height);
    None if it has none.
    uv : texture coordinates and footprints, if requested.
    frames : for area, environment and indirect light, if there is any.
    lights : per light the textures of io angles, hd angles and azimuths, and (mip-mapped) of io spans and hd spans.
    """

    parts: tuple[Place | None, ...]
    samples: int
    covered: moderngl.Texture
    seen: moderngl.Texture
    uv: tuple[moderngl.Texture, ...]
    frames: tuple[moderngl.Texture, ...]
    lights: tuple[tuple[moderngl.Texture, ...], ...]
    owner: Owner

    @cached_property
    def coverage(self) -> Float[np.ndarray, "h w"]:
        """Coverage of its pixels, float32, read back on first use."""
        return read(self.covered)[..., 0]


@dataclass(eq=False)
class GLTerms(KeptTerms):
    """Terms on the GPU: a texture for every four terms, for the pixels of `box` (x, y, width, height)."""

    box: tuple[int, int, int, int]
    quads: tuple[moderngl.Texture, ...]
    owner: Owner


def area_light_textures(tile: GLTile, layer: SpreadLayer) -> dict[str, moderngl.Texture]:
    """Return a tile's textures for area, environment and indirect light."""
    uv = dict(zip(("uv", "footprint"), tile.uv, strict=False)) if layer.form.uses_uv else {}
    return {"seen": tile.seen, **dict(zip(FRAMES, tile.frames, strict=True)), **uv}


def part_places(
    triangles: WindowTriangles, first_face: Int[np.ndarray, "_"], samples: int, size: tuple[int, int]
) -> tuple[Place | None, ...]:
    """Locate each part in a tile of `size` pixels."""
    ends = np.searchsorted(triangles.parent, first_face)
    found: list[Place | None] = []
    for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        if first == last:
            found.append(None)
            continue
        spans = []
        for axis, most in enumerate(size):
            corners = triangles.corners[first:last, :, axis]
            low = int(corners.min()) // (SUBSTEPS * samples)
            spans.append((low, min(int(corners.max()) // (SUBSTEPS * samples) + 1, most) - low))
        (left, width), (top, height) = spans
        box = (left, top, width, height)
        found.append(((first + 1, last), box) if width > 0 and height > 0 else None)
    return tuple(found)


def read(texture: moderngl.Texture) -> np.ndarray:
    """Read back a texture of floats, row by row."""
    width, height = texture.size
    return np.frombuffer(texture.read(), dtype=np.float32).reshape(height, width, texture.components)
