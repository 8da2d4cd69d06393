"""Pictures without a window: the GL renderer, and the choice between it and its numpy twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from ..materials.factors import FactorPack
from ..spectral.errors import InputError
from .context import NoGL, create_context, describe
from .geometry import SceneGeometry
from .passes import MOST_SPECTRA, Passes
from .raster import SUBSTEPS, Window, WindowTriangles
from .renderer import Filtering, Layer, Renderer, Tile
from .resources import (
    MOST_TRIANGLES,
    TRIANGLE_TEXELS,
    TRIANGLES_A_ROW,
    FactorTexels,
    Owner,
    factor_texels,
    triangle_texels,
    weight_texels,
)
from .software import SoftwareRenderer

if TYPE_CHECKING:
    import moderngl

# The numbers of a part's first and last triangle, and its box of pixels.
Place = tuple[tuple[int, int], tuple[int, int, int, int]]

__all__ = ["GLRenderer", "Renderer", "SoftwareRenderer", "create_renderer"]


def create_renderer(filtering: Filtering = "linear") -> tuple[Renderer, NoGL | None]:
    """The GL renderer, or the numpy one and the reason why there is no GL here."""
    try:
        return GLRenderer(filtering=filtering), None
    except NoGL as reason:
        return SoftwareRenderer(filtering), reason


@dataclass(eq=False)
class GLTile(Tile):
    """A tile on the GPU.

    seen : triangle number + 1 at each sample, 0 where there is none.
    parts : of each part the first and last of those numbers + 1 and the pixels that it can touch (x, y, width, height);
    None where there are none.
    lights : per light the textures of io angles, hd angles and azimuths, and (mip-mapped) of io spans and hd spans.
    """

    parts: tuple[Place | None, ...]
    samples: int
    seen: moderngl.Texture
    lights: tuple[tuple[moderngl.Texture, ...], ...]
    owner: Owner


class GLRenderer(Renderer):
    """Renders with OpenGL 4.10 core, headless.

    Parameters
    ----------
    context : a context to share; without it one is made, and released with the renderer.
    filtering : see `Renderer`.

    Raises
    ------
    NoGL : no context can be made.
    """

    def __init__(self, context: moderngl.Context | None = None, filtering: Filtering = "linear") -> None:
        super().__init__(filtering)
        self._owns_context = context is None
        self.context = create_context() if context is None else context
        self.name = describe(self.context)
        self._passes = Passes(self.context)

    def close(self) -> None:
        """Release everything, programs and (if it made it) the context included."""
        self.release()
        self._passes.release()
        if self._owns_context:
            self.context.release()

    def _tile(self, geometry: SceneGeometry, window: Window, triangles: WindowTriangles) -> GLTile:
        if max(len(triangles.parent), len(geometry.lit)) >= MOST_TRIANGLES:
            raise InputError("too many triangles", found=len(geometry.lit), expected=f"below {MOST_TRIANGLES}")
        side = geometry.camera.samples
        owner, scratch = Owner(self.context), Owner(self.context)
        try:
            seen = self._passes.visibility(owner, window, triangles)
            table = scratch.table(triangle_texels(geometry, triangles), TRIANGLES_A_ROW, TRIANGLE_TEXELS)
            numbers = range(len(geometry.lights))
            mipmapped = self.filtering == "mipmapped"
            lights = tuple(self._passes.light(owner, geometry, number, seen, table, mipmapped) for number in numbers)
            coverage = _coverage(seen, side)
        except BaseException:
            owner.release()
            raise
        finally:
            scratch.release()
        place = window.left // side, window.top // side
        parts = _places(triangles, geometry.first_face, side, coverage.shape[::-1])
        return GLTile(*place, coverage, parts, side, seen, lights, owner)

    def _discard(self, tile: GLTile) -> None:
        tile.owner.release()

    def _shade(self, tile: GLTile, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M h w 3"]:
        out = np.zeros((count, *tile.coverage.shape, 3), dtype=np.float32)
        scratch = Owner(self.context)
        try:
            tables = {id(layer.pack): self._factors(scratch, layer.pack) for layer in layers}
            for start in range(0, count, MOST_SPECTRA):
                stop = min(start + MOST_SPECTRA, count)
                out[start:stop] = self._shade_some(tile, layers, tables, start, stop)
        finally:
            scratch.release()
        return out

    def _factors(self, owner: Owner, pack: FactorPack) -> tuple[FactorTexels, moderngl.Texture]:
        made = factor_texels(pack, self.filtering == "mipmapped")
        return made, made.texture(owner)

    def _shade_some(self, tile: GLTile, layers: Sequence[Layer], tables: dict, start: int, stop: int) -> np.ndarray:
        """Pictures of the spectra `start` to `stop`, which share the look-ups."""
        height, width = tile.coverage.shape
        owner = Owner(self.context)
        try:
            pictures = [owner.texture((width, height), 4) for _ in range(start, stop)]
            target = owner.keep(self.context.framebuffer(pictures))
            target.clear()
            for layer in layers:
                place = tile.parts[layer.part]
                if place is None:
                    continue
                numbers, box = place
                weights = weight_texels(layer.weights[:, 3 * start : 3 * stop])
                made, table = tables[id(layer.pack)]
                io, hd, azimuth, *spans = tile.lights[layer.light]
                in_io = layer.pack.frame == "io"
                samplers = {
                    "seen": tile.seen,
                    "angles": io if in_io else hd,
                    "azimuth": azimuth,
                    "factors": table,
                    "weights": owner.texture(weights.shape[1::-1], 4, weights.tobytes()),
                }
                if spans:
                    samplers["spans"] = spans[0 if in_io else 1]
                values = {
                    "part": numbers,
                    "samples": tile.samples,
                    "rows": len(weights),
                    "azimuth_channel": 0 if in_io else 1,
                    **made.values,
                }
                self._passes.shade(target, box, stop - start, made.axes, samplers, values, bool(spans))
            return np.stack([_read(picture)[..., :3] for picture in pictures])
        finally:
            owner.release()


def _places(
    triangles: WindowTriangles, first_face: Int[np.ndarray, "_"], samples: int, size: tuple[int, int]
) -> tuple[Place | None, ...]:
    """Where each part is found in a tile of `size` pixels."""
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


def _coverage(seen: moderngl.Texture, samples: int) -> Float[np.ndarray, "h w"]:
    hit = _read(seen)[..., 0] > 0
    height, width = hit.shape
    hits = hit.reshape(height // samples, samples, width // samples, samples).sum(axis=(1, 3))
    return (hits / samples**2).astype(np.float32)


def _read(texture: moderngl.Texture) -> np.ndarray:
    width, height = texture.size
    return np.frombuffer(texture.read(), dtype=np.float32).reshape(height, width, texture.components)
