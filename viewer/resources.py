"""What goes to the GPU: triangles, occluders, factors and weights as float32 texels, and who gives them back."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np
from jaxtyping import Float

from ..materials.factors import FactorPack
from .geometry import SceneGeometry
from .raster import SUBSTEPS, Window, WindowTriangles

if TYPE_CHECKING:
    import moderngl

# Tables without a shape of their own are laid out in rows of this many texels.
ROW_LENGTH = 4096
TRIANGLE_TEXELS = 11
TRIANGLES_A_ROW = ROW_LENGTH // TRIANGLE_TEXELS
OCCLUDERS_A_ROW = ROW_LENGTH // 3
# Triangle numbers travel as float32.
MOST_TRIANGLES = 1 << 24

Releasable = TypeVar("Releasable")


class Owner:
    """Keeps GL objects that live and die together."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._kept: list = []

    def keep(self, thing: Releasable) -> Releasable:
        """Remember `thing`, which has a `release` method; returns it."""
        self._kept.append(thing)
        return thing

    def release(self) -> None:
        """Release everything kept, newest first."""
        while self._kept:
            self._kept.pop().release()

    def texture(self, size: tuple[int, int], components: int, data=None, dtype: str = "f4") -> moderngl.Texture:
        """A texture for `texelFetch`: no filtering, no mipmaps."""
        nearest = self.context.NEAREST
        made = self.context.texture(size, components, data, dtype=dtype)
        made.filter = (nearest, nearest)
        return self.keep(made)

    def table(self, values: np.ndarray, items_a_row: int, texels: int = 1) -> moderngl.Texture:
        """Items of `texels` texels each, (n, texels, components), laid out in rows of `items_a_row` items."""
        dtype = "i4" if values.dtype == np.int32 else "f4"
        components = values.shape[-1] if values.ndim > 1 else 1
        values = values.reshape(-1, texels, components)
        rows = max(1, -(-len(values) // items_a_row))
        padded = np.zeros((rows * items_a_row, *values.shape[1:]), dtype=values.dtype)
        padded[: len(values)] = values
        return self.texture((items_a_row * texels, rows), components, padded.tobytes(), dtype)


def triangle_texels(geometry: SceneGeometry, triangles: WindowTriangles) -> Float[np.ndarray, "T 11 4"]:
    """Per triangle: corners (x0 y0 x1 y1, x2 y2), number in the scene, bits of lights; three times position and 1/w;
    three normals; three tangents. Float32; corners in 1/256 sample, exact below 2^24.
    """
    texels = np.zeros((len(triangles.parent), TRIANGLE_TEXELS, 4), dtype=np.float32)
    texels[:, 0] = triangles.corners[:, :2].reshape(-1, 4)
    texels[:, 1, :2] = triangles.corners[:, 2]
    texels[:, 1, 2] = triangles.parent
    texels[:, 1, 3] = geometry.lit[triangles.parent]
    for start, corners in ((2, geometry.positions), (5, geometry.normals), (8, geometry.tangents)):
        texels[:, start : start + 3, :3] = np.einsum("tkj,tji->tki", triangles.weights, corners[triangles.parent])
    texels[:, 2:5, 3] = triangles.inverse_w
    return texels


_VERTEX = np.dtype([("corner", "f4", 2), ("reference", "i4", 2), ("plane", "f4", 3), ("range", "f4", 2), ("n", "f4")])
VERTEX_FORMAT = "2f4 2i4 3f4 2f4 1f4"
VERTEX_NAMES = ("corner", "reference", "depth_plane", "depth_range", "number")


def triangle_vertices(triangles: WindowTriangles, window: Window) -> np.ndarray:
    """Vertex records for `visibility.vert`, three a triangle."""
    vertices = np.zeros((len(triangles.parent), 3), dtype=_VERTEX)
    reference, planes = triangles.depth_planes()
    # The target's rows are the picture's rows: row 0 on top, so y runs down in clip space too.
    vertices["corner"] = 2.0 * triangles.corners / (SUBSTEPS * np.array([window.width, window.height])) - 1.0
    vertices["reference"] = reference[:, None]
    vertices["plane"], vertices["range"] = planes[:, None, :3], planes[:, None, 3:]
    vertices["n"] = np.arange(1, len(vertices) + 1)[:, None]
    return vertices


def factor_texels(pack: FactorPack) -> tuple[Float[np.ndarray, "rows columns 4"], list[tuple[float, ...]]]:
    """The factors of a pack four terms a texel, axes side by side, and `axes` as `factors.glsl` wants them."""
    rows = -(-pack.rank // 4)
    columns = sum(axis.size for axis in pack.axes)
    texels = np.zeros((rows, columns, 4), dtype=np.float32)
    descriptions, first = [], 0
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        padded = np.zeros((axis.size, rows * 4), dtype=np.float32)
        padded[:, : pack.rank] = factor
        texels[:, first : first + axis.size] = padded.reshape(axis.size, rows, 4).swapaxes(0, 1)
        kind = 2.0 if axis.periodic else 1.0 if axis.warp == "sqrt" else 0.0
        descriptions.append((1.0 / axis.maximum, axis.size - 1.0, float(first), kind))
        first += axis.size
    return texels, descriptions


def weight_texels(weights: Float[np.ndarray, "R M3"]) -> Float[np.ndarray, "rows M3 4"]:
    """Folded weights four terms a texel: a column for X, Y and Z of each spectrum."""
    rows = -(-len(weights) // 4)
    padded = np.zeros((rows * 4, weights.shape[1]), dtype=np.float32)
    padded[: len(weights)] = weights
    return np.ascontiguousarray(padded.reshape(rows, 4, -1).swapaxes(1, 2))
