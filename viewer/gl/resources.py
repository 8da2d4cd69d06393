"""GPU resources: triangles and palettes as texels, and ownership of GL objects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.fast import MOST_TEXELS
from ...runtime.errors import InputError
from ..render.geometry import SceneGeometry
from ..render.raster import WindowTriangles

if TYPE_CHECKING:
    import moderngl

# Texels per row of tables without a natural shape.
ROW_LENGTH = 4096
TRIANGLE_TEXELS = 5
TRIANGLES_A_ROW = ROW_LENGTH // TRIANGLE_TEXELS
CORNER_TEXELS = 9
CORNERS_A_ROW = ROW_LENGTH // CORNER_TEXELS
UV_TEXELS = 2
UVS_A_ROW = ROW_LENGTH // UV_TEXELS
OCCLUDERS_A_ROW = ROW_LENGTH // 3
# Triangle indices are passed as float32.
MOST_TRIANGLES = 1 << 24

#: Limit in bytes of a context's pool of free textures, and its largest number: drivers are slow to allocate large ones,
#: and an animation needs some twenty.
MOST_SPARE, MOST_SPARES = 1 << 28, 64

Releasable = TypeVar("Releasable")
# Size, components and type of a texture.
_Kind = tuple[int, int, int, str]


class _Spares:
    """Pool of free textures of a context, by kind; least recently used kinds are evicted first."""

    def __init__(self) -> None:
        self._kept: dict[_Kind, list[moderngl.Texture]] = {}
        self._bytes = self._count = 0

    def take(self, kind: _Kind) -> moderngl.Texture | None:
        """Take a texture of a kind, with undefined content; None if there is none."""
        kept = self._kept.pop(kind, [])
        found = kept.pop() if kept else None
        if kept:
            self._kept[kind] = kept
        if found is not None:
            self._bytes -= _bytes_of(kind)
            self._count -= 1
        return found

    def give(self, texture: moderngl.Texture) -> None:
        """Add a texture, and evict others beyond the limits."""
        kind = (*texture.size, texture.components, texture.dtype)
        self._kept[kind] = [*self._kept.pop(kind, []), texture]
        self._bytes += _bytes_of(kind)
        self._count += 1
        self._shrink(MOST_SPARE, MOST_SPARES)

    def release(self) -> None:
        """Free all."""
        self._shrink(0, 0)

    def _shrink(self, most_bytes: int, most: int) -> None:
        while self._bytes > most_bytes or self._count > most:
            kind, kept = next(iter(self._kept.items()))
            kept.pop().release()
            self._bytes -= _bytes_of(kind)
            self._count -= 1
            if not kept:
                del self._kept[kind]


def _bytes_of(kind: _Kind) -> int:
    width, height, components, dtype = kind
    return width * height * components * int(dtype[-1])


_spares: WeakKeyDictionary[moderngl.Context, _Spares] = WeakKeyDictionary()


def release_spares(context: moderngl.Context) -> None:
    """Free the pool of a context."""
    if context in _spares:
        _spares[context].release()


class Owner:
    """Owner of GL objects with a common lifetime."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._kept: list = []
        self._textures: list[moderngl.Texture] = []
        self._spares = _spares.setdefault(context, _Spares())

    def keep(self, thing: Releasable) -> Releasable:
        """Take ownership of `thing`, which has a `release` method, and return it."""
        self._kept.append(thing)
        return thing

    def release(self) -> None:
        """Release all objects, newest first; textures of `texture` return to the pool."""
        if any(thing is self.context.fbo for thing in self._kept):
            _bind_another(self.context)
        while self._kept:
            self._kept.pop().release()
        while self._textures:
            self._spares.give(self._textures.pop())

    def texture(self, size: tuple[int, int], components: int, data=None, dtype: str = "f4") -> moderngl.Texture:
        """Return a texture for `texelFetch`: no filtering, no mipmaps."""
        nearest = self.context.NEAREST
        made = self._spares.take((*size, components, dtype))
        if made is None:
            made = self.context.texture(size, components, data, dtype=dtype)
        elif data is not None:
            made.write(data)
        made.filter = (nearest, nearest)
        self._textures.append(made)
        return made

    def cleared(self, size: tuple[int, int], components: int) -> moderngl.Texture:
        """Return a texture of zeros."""
        made = self.texture(size, components)
        target = self.context.framebuffer([made])
        target.clear()
        release_target(target)
        return made

    def texels(self, values: Float[np.ndarray, "h w 4"]) -> moderngl.Texture:
        """Upload an array as a texture, in its own precision."""
        dtype = "f2" if values.dtype == np.float16 else "f4"
        return self.texture(values.shape[1::-1], values.shape[2], values.tobytes(), dtype)

    def table(self, values: np.ndarray, items_a_row: int, texels: int = 1) -> moderngl.Texture:
        """Upload items of `texels` texels each, (n, texels, components), in rows of `items_a_row` items."""
        dtype = {"int32": "i4", "float16": "f2"}.get(values.dtype.name, "f4")
        components = values.shape[-1] if values.ndim > 1 else 1
        values = np.ascontiguousarray(values).reshape(-1, texels * components)
        whole, rest = divmod(len(values), items_a_row)
        made = self.texture((items_a_row * texels, max(1, whole + (rest > 0))), components, None, dtype)
        # Texels after the last item are undefined and never read.
        if whole:
            made.write(values[: whole * items_a_row], viewport=(0, 0, items_a_row * texels, whole))
        if rest:
            made.write(values[whole * items_a_row :], viewport=(0, whole, rest * texels, 1))
        return made


def release_target(target: moderngl.Framebuffer) -> None:
    """Free a framebuffer that may be bound: moderngl would bind its name again, a GL error that masks others."""
    if target is target.ctx.fbo:
        _bind_another(target.ctx)
    target.release()


def _bind_another(context: moderngl.Context) -> None:
    """Bind the screen, or without one a framebuffer of one texel with the lifetime of the context."""
    if context.screen is not None:
        context.screen.use()
        return
    if context.extra is None:
        context.extra = context.framebuffer([context.texture((1, 1), 4)])
    context.extra.use()


@dataclass(frozen=True, eq=False)
class TriangleTables:
    """Triangles of a window on the GPU.

    triangles : `triangle_texels`. corners : `SceneGeometry.corner_texels`. pieces : the same for clipped triangles.
    numbers (T,), key_base, key_shift : `parent` and the depth keys of `WindowTriangles`.
    """

    triangles: moderngl.Texture
    corners: moderngl.Texture
    pieces: moderngl.Texture
    numbers: Int[np.ndarray, " T"]
    key_base: int
    key_shift: int

    @property
    def samplers(self) -> dict[str, moderngl.Texture]:
        """Return textures by their names in `surface.glsl`."""
        return {"triangles": self.triangles, "corners": self.corners, "pieces": self.pieces}


def triangle_texels(
    triangles: WindowTriangles, side: Float[np.ndarray, " F"], handedness: Float[np.ndarray, " F"]
) -> Float[np.ndarray, "T 5 4"]:
    """Encode view-dependent data per triangle: corners (x0 y0 x1 y1, x2 y2), index in the scene, and row of its
    attributes (that index, or -1 minus the index of a piece); 1/w of the corners, and handedness, doubled if the back
    is seen; plane of nearness: its slopes, its value and the column and row of the sample where it is attained, its
    lowest and highest value. Float32; corners in 1/256 sample, exact below 2^24.

    side, handedness : of the scene's triangles, see `View`.
    """
    texels = np.empty((len(triangles.parent), TRIANGLE_TEXELS, 4), dtype=np.float32)
    reference, planes = triangles.depth_planes()
    # Column by column, since numpy is slow for short rows.
    for column, one in enumerate(triangles.corners.reshape(-1, 6).T):
        texels[:, column // 4, column % 4] = one
    texels[:, 1, 2] = texels[:, 1, 3] = triangles.parent
    texels[triangles.cut, 1, 3] = -1.0 - np.arange(len(triangles.cut))
    texels[:, 2, 3] = np.where(side < 0.0, 2.0 * handedness, handedness)[triangles.parent]
    for k in range(3):
        texels[:, 2, k], texels[:, 3, k] = triangles.inverse_w[:, k], planes[:, k]
    for k in range(2):
        texels[:, 3 + k, 3], texels[:, 4, k] = reference[:, k], planes[:, 3 + k]
    texels[:, 4, 2] = 0.0
    return texels


def piece_texels(scene: SceneGeometry, triangles: WindowTriangles) -> Float[np.ndarray, "C 9 4"]:
    """Encode positions, normals and tangents at the corners of clipped triangles, as `SceneGeometry.corner_texels`."""
    texels = np.zeros((len(triangles.cut), CORNER_TEXELS, 4), dtype=np.float32)
    parent = triangles.parent[triangles.cut]
    for start, corners in ((0, scene.positions), (3, scene.normals), (6, scene.tangents)):
        texels[:, start : start + 3, :3] = triangles.weights @ corners[parent]
    return texels


def uv_texels(corners: Float[np.ndarray, "T 3 2"]) -> Float[np.ndarray, "T 2 4"]:
    """Encode texture coordinates per triangle: u0 v0 u1 v1, u2 v2 0 0. Float32; all 0 on parts without."""
    texels = np.zeros((len(corners), UV_TEXELS, 4), dtype=np.float32)
    texels.reshape(-1, 8)[:, :6] = corners.reshape(-1, 6)
    return texels


def palette_texels(colours: Float[np.ndarray, "P R M3"]) -> tuple[Float[np.ndarray, "h w 4"], tuple[int, int]]:
    """Lay out a folded palette for `fold.glsl`, four terms per texel, a column for X, Y and Z of each spectrum of each
    entry; return it with the number of entries side by side, and the rows of one.

    Raises
    ------
    InputError : more entries than fit into a texture.
    """
    entries, rank, columns = colours.shape
    rows = -(-rank // 4)
    across = min(entries, max(1, MOST_TEXELS // columns))
    down = -(-entries // across)
    if down * rows > MOST_TEXELS:
        found, most = f"{entries} of {rank} terms", MOST_TEXELS // columns * (MOST_TEXELS // rows)
        raise InputError("a palette of too many entries", field="palette", found=found, expected=f"at most {most}")
    padded = np.zeros((down * across, rows * 4, columns), dtype=np.float32)
    padded[:entries, :rank] = colours
    texels = padded.reshape(down, across, rows, 4, columns).transpose(0, 2, 1, 4, 3)
    return np.ascontiguousarray(texels.reshape(down * rows, across * columns, 4)), (across, rows)
