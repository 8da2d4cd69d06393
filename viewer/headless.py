"""Pictures without a window: the GL renderer, and the choice between it and its numpy twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ..materials.factors import FactorPack
from ..spectral.errors import InputError
from .context import NoGL, create_context, describe
from .geometry import SceneGeometry
from .passes import MOST_SPECTRA, Passes, WindowBuffers
from .raster import SUBSTEPS, Window, WindowTriangles
from .renderer import Layer, Renderer
from .resources import (
    MOST_TRIANGLES,
    TRIANGLE_TEXELS,
    TRIANGLES_A_ROW,
    Owner,
    factor_texels,
    triangle_texels,
    weight_texels,
)
from .software import SoftwareRenderer

if TYPE_CHECKING:
    import moderngl

__all__ = ["GLRenderer", "Renderer", "SoftwareRenderer", "create_renderer"]


def create_renderer() -> tuple[Renderer, NoGL | None]:
    """The GL renderer, or the numpy one and the reason why there is no GL here."""
    try:
        return GLRenderer(), None
    except NoGL as reason:
        return SoftwareRenderer(), reason


@dataclass(frozen=True, eq=False)
class _Prepared:
    size: tuple[int, int]
    samples: int
    coverage: Float[np.ndarray, "H W"]
    first_face: np.ndarray
    windows: tuple[WindowBuffers, ...]
    owner: Owner


class GLRenderer(Renderer):
    """Renders with OpenGL 4.10 core, headless.

    Parameters
    ----------
    context : a context to share; without it one is made, and released with the renderer.

    Raises
    ------
    NoGL : no context can be made.
    """

    def __init__(self, context: moderngl.Context | None = None) -> None:
        super().__init__()
        self._owns_context = context is None
        self.context = create_context() if context is None else context
        self.name = describe(self.context)
        self._passes = Passes(self.context)

    def close(self) -> None:
        """Release everything, programs and (if it made it) the context included: the renderer is used up."""
        self.release()
        self._passes.release()
        if self._owns_context:
            self.context.release()

    def __exit__(self, *_reason: object) -> None:
        self.close()

    def _prepare(self, geometry: SceneGeometry) -> _Prepared:
        camera = geometry.camera
        owner = Owner(self.context)
        blocks = np.zeros((camera.height_px, camera.width), dtype=np.float32)
        windows = []
        try:
            for window, triangles in geometry.windows():
                if len(triangles.parent) >= MOST_TRIANGLES or len(geometry.lit) >= MOST_TRIANGLES:
                    raise InputError("too many triangles", found=len(geometry.lit), expected=f"below {MOST_TRIANGLES}")
                seen = self._passes.visibility(owner, window, triangles)
                tile = Owner(self.context)
                try:
                    table = tile.table(triangle_texels(geometry, triangles), TRIANGLES_A_ROW, TRIANGLE_TEXELS)
                    lights = tuple(
                        self._passes.light(owner, geometry, number, seen, table)
                        for number in range(len(geometry.lights))
                    )
                finally:
                    tile.release()
                windows.append(WindowBuffers(window, triangles, seen, lights))
                left, top, width, height = _pixels(window, camera.samples)
                blocks[top : top + height, left : left + width] = _coverage(seen, camera.samples)
        except BaseException:
            owner.release()
            raise
        size = (camera.height_px, camera.width)
        return _Prepared(size, camera.samples, blocks, geometry.first_face, tuple(windows), owner)

    def _discard(self, prepared: _Prepared) -> None:
        prepared.owner.release()

    def _shade(self, prepared: _Prepared, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M H W 3"]:
        out = np.zeros((count, *prepared.size, 3), dtype=np.float32)
        scratch = Owner(self.context)
        try:
            tables = {id(layer.pack): _factor_table(scratch, layer.pack) for layer in layers}
            for start in range(0, count, MOST_SPECTRA):
                spectra = min(MOST_SPECTRA, count - start)
                for buffers in prepared.windows:
                    left, top, width, height = _pixels(buffers.window, prepared.samples)
                    pictures = self._shade_window(prepared, buffers, layers, tables, start, spectra)
                    out[start : start + spectra, top : top + height, left : left + width] = pictures
        finally:
            scratch.release()
        return out

    def _shade_window(self, prepared, buffers: WindowBuffers, layers, tables, start: int, spectra: int) -> np.ndarray:
        _, _, width, height = _pixels(buffers.window, prepared.samples)
        owner = Owner(self.context)
        try:
            pictures = [owner.texture((width, height), 4) for _ in range(spectra)]
            target = owner.keep(self.context.framebuffer(pictures))
            target.clear()
            for layer in layers:
                ends = prepared.first_face[layer.part : layer.part + 2]
                first, last = (int(end) for end in np.searchsorted(buffers.triangles.parent, ends))
                box = _box(buffers.triangles, first, last, prepared.samples, (width, height))
                if box is None:
                    continue
                weights = weight_texels(layer.weights[:, 3 * start : 3 * (start + spectra)])
                table, axes = tables[id(layer.pack)]
                io, hd, azimuth = buffers.lights[layer.light]
                in_io = layer.pack.frame == "io"
                samplers = {
                    "seen": buffers.seen,
                    "angles": io if in_io else hd,
                    "azimuth": azimuth,
                    "factors": table,
                    "weights": owner.texture(weights.shape[1::-1], 4, weights.tobytes()),
                }
                values = {
                    "part": (first + 1, last),
                    "samples": prepared.samples,
                    "rows": len(weights),
                    "azimuth_channel": 0 if in_io else 1,
                }
                self._passes.shade(target, box, spectra, axes, samplers, values)
            return np.stack([_read(picture)[..., :3] for picture in pictures])
        finally:
            owner.release()


def _factor_table(owner: Owner, pack: FactorPack) -> tuple[moderngl.Texture, list[tuple[float, ...]]]:
    texels, axes = factor_texels(pack)
    return owner.texture(texels.shape[1::-1], 4, texels.tobytes()), axes


def _pixels(window: Window, samples: int) -> tuple[int, int, int, int]:
    """Left, top, width and height of a window in pixels."""
    return window.left // samples, window.top // samples, window.width // samples, window.height // samples


def _box(
    triangles: WindowTriangles, first: int, last: int, samples: int, size: tuple[int, int]
) -> tuple[int, int, int, int] | None:
    """The pixels (x, y, width, height) that triangles first..last can touch, or None."""
    if first >= last:
        return None
    corners = triangles.corners[first:last].reshape(-1, 2)
    low = corners.min(axis=0) // (SUBSTEPS * samples)
    high = np.minimum(corners.max(axis=0) // (SUBSTEPS * samples) + 1, size)
    width, height = high - low
    return (int(low[0]), int(low[1]), int(width), int(height)) if width > 0 and height > 0 else None


def _coverage(seen: moderngl.Texture, samples: int) -> Float[np.ndarray, "h w"]:
    hit = _read(seen)[..., 0] > 0
    height, width = hit.shape
    hits = hit.reshape(height // samples, samples, width // samples, samples).sum(axis=(1, 3))
    return (hits / samples**2).astype(np.float32)


def _read(texture: moderngl.Texture) -> np.ndarray:
    width, height = texture.size
    return np.frombuffer(texture.read(), dtype=np.float32).reshape(height, width, texture.components)
