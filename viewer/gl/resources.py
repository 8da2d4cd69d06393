"""Resources of the GPU: triangles and palettes as texels, and who gives them back."""

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

# Tables without a shape of their own are laid out in rows of this many texels.
ROW_LENGTH = 4096
TRIANGLE_TEXELS = 5
TRIANGLES_A_ROW = ROW_LENGTH // TRIANGLE_TEXELS
CORNER_TEXELS = 9
CORNERS_A_ROW = ROW_LENGTH // CORNER_TEXELS
UV_TEXELS = 2
UVS_A_ROW = ROW_LENGTH // UV_TEXELS
OCCLUDERS_A_ROW = ROW_LENGTH // 3
# Triangle numbers travel as float32.
MOST_TRIANGLES = 1 << 24

#: Bytes of a context's textures that are kept for the next that ask for such, and how many at most: drivers take long
#: to make large ones, and a moving picture has some twenty.
MOST_SPARE, MOST_SPARES = 1 << 28, 64

Releasable = TypeVar("Releasable")
# Width, height, components and type of a texture.
_Kind = tuple[int, int, int, str]


class _Spares:
    """Textures of a context that nobody uses, by kind; those of kinds that were not asked for lately go first."""

    def __init__(self) -> None:
        self._kept: dict[_Kind, list[moderngl.Texture]] = {}
        self._bytes = self._count = 0

    def take(self, kind: _Kind) -> moderngl.Texture | None:
        """Return one of a kind, with whatever it holds; None where there is none."""
        kept = self._kept.pop(kind, [])
        found = kept.pop() if kept else None
        if kept:
            self._kept[kind] = kept
        if found is not None:
            self._bytes -= _bytes_of(kind)
            self._count -= 1
        return found

    def give(self, texture: moderngl.Texture) -> None:
        """Keep a texture, and free others where there is no room for all."""
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
    """Free a context's textures that nobody uses."""
    if context in _spares:
        _spares[context].release()


class Owner:
    """Keeps GL objects that live and die together."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._kept: list = []
        self._textures: list[moderngl.Texture] = []
        self._spares = _spares.setdefault(context, _Spares())

    def keep(self, thing: Releasable) -> Releasable:
        """Remember `thing`, which has a `release` method; returns it."""
        self._kept.append(thing)
        return thing

    def release(self) -> None:
        """Release everything kept, newest first; textures of `texture` are used again."""
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
        """Make a texture of zeros: a new one holds whatever was in its memory."""
        made = self.texture(size, components)
        target = self.context.framebuffer([made])
        target.clear()
        release_target(target)
        return made

    def texels(self, values: Float[np.ndarray, "h w 4"]) -> moderngl.Texture:
        """Return an array as a texture, in its own precision."""
        dtype = "f2" if values.dtype == np.float16 else "f4"
        return self.texture(values.shape[1::-1], values.shape[2], values.tobytes(), dtype)

    def table(self, values: np.ndarray, items_a_row: int, texels: int = 1) -> moderngl.Texture:
        """Items of `texels` texels each, (n, texels, components), laid out in rows of `items_a_row` items."""
        dtype = {"int32": "i4", "float16": "f2"}.get(values.dtype.name, "f4")
        components = values.shape[-1] if values.ndim > 1 else 1
        values = np.ascontiguousarray(values).reshape(-1, texels * components)
        whole, rest = divmod(len(values), items_a_row)
        made = self.texture((items_a_row * texels, max(1, whole + (rest > 0))), components, None, dtype)
        # Texels after the last item stay as they are: nothing reads them.
        if whole:
            made.write(values[: whole * items_a_row], viewport=(0, 0, items_a_row * texels, whole))
        if rest:
            made.write(values[whole * items_a_row :], viewport=(0, whole, rest * texels, 1))
        return made


def release_target(target: moderngl.Framebuffer) -> None:
    """Free a framebuffer, which may be the one that is drawn to: moderngl would bind its number again, an error of GL's
    that hides others.
    """
    if target is target.ctx.fbo:
        _bind_another(target.ctx)
    target.release()


def _bind_another(context: moderngl.Context) -> None:
    """Draw to the screen, or where there is none to a texel that stays as long as the context."""
    if context.screen is not None:
        context.screen.use()
        return
    if context.extra is None:
        context.extra = context.framebuffer([context.texture((1, 1), 4)])
    context.extra.use()


@dataclass(frozen=True, eq=False)
class TriangleTables:
    """Triangles of a window on the GPU.

    triangles : `triangle_texels`. corners : `SceneGeometry.corner_texels`. pieces : the same of clipped triangles.
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
        """Textures by their names in `surface.glsl`."""
        return {"triangles": self.triangles, "corners": self.corners, "pieces": self.pieces}


def triangle_texels(
    triangles: WindowTriangles, side: Float[np.ndarray, " F"], handedness: Float[np.ndarray, " F"]
) -> Float[np.ndarray, "T 5 4"]:
    """Return what changes with the view, per triangle: corners (x0 y0 x1 y1, x2 y2), number in the scene, and where the
    rest is: that number, or -1 less the number of a piece; 1/w of the corners, and handedness, times 2 where the back
    is seen; plane of nearness: its slopes, its value, and the column and row of the sample where it has it, its lowest
    and highest value. Float32; corners in 1/256 sample, exact below 2^24.

    side, handedness : of the scene's triangles, as of `View`.
    """
    texels = np.empty((len(triangles.parent), TRIANGLE_TEXELS, 4), dtype=np.float32)
    reference, planes = triangles.depth_planes()
    # Column by column: numpy is slow where rows are short.
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
    """Return positions, normals and tangents at the corners of clipped triangles, as `SceneGeometry.corner_texels`."""
    texels = np.zeros((len(triangles.cut), CORNER_TEXELS, 4), dtype=np.float32)
    parent = triangles.parent[triangles.cut]
    for start, corners in ((0, scene.positions), (3, scene.normals), (6, scene.tangents)):
        texels[:, start : start + 3, :3] = triangles.weights @ corners[parent]
    return texels


def uv_texels(corners: Float[np.ndarray, "T 3 2"]) -> Float[np.ndarray, "T 2 4"]:
    """Per triangle the texture coordinates of its corners: u0 v0 u1 v1, u2 v2 0 0. Float32; all 0 on parts without."""
    texels = np.zeros((len(corners), UV_TEXELS, 4), dtype=np.float32)
    texels.reshape(-1, 8)[:, :6] = corners.reshape(-1, 6)
    return texels


def palette_texels(colours: Float[np.ndarray, "P R M3"]) -> tuple[Float[np.ndarray, "h w 4"], tuple[int, int]]:
    """Return a folded palette four terms a texel, as `fold.glsl` reads it: a column for X, Y and Z of each spectrum of
    each entry; and how many entries stand side by side, and the rows of one.

    Raises
    ------
    InputError : more entries than a texture has room for.
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
