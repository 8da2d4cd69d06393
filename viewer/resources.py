"""What goes to the GPU: triangles, occluders, factors and weights as texels, and who gives them back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from jaxtyping import Float

from ..materials.factors import FactorPack
from ..spectral.errors import InputError
from .pyramids import MOST_LEVELS, axis_levels, pyramid
from .raster import SUBSTEPS, Window, WindowTriangles
from .view import View

if TYPE_CHECKING:
    import moderngl

# Tables without a shape of their own are laid out in rows of this many texels.
ROW_LENGTH = 4096
TRIANGLE_TEXELS = 11
TRIANGLES_A_ROW = ROW_LENGTH // TRIANGLE_TEXELS
UV_TEXELS = 2
UVS_A_ROW = ROW_LENGTH // UV_TEXELS
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


def triangle_texels(view: View, triangles: WindowTriangles) -> Float[np.ndarray, "T 11 4"]:
    """Per triangle: corners (x0 y0 x1 y1, x2 y2), number in the scene and handedness; three times position and 1/w;
    three normals; three tangents. Float32; corners in 1/256 sample, exact below 2^24.
    """
    texels = np.zeros((len(triangles.parent), TRIANGLE_TEXELS, 4), dtype=np.float32)
    texels[:, 0] = triangles.corners[:, :2].reshape(-1, 4)
    texels[:, 1, :2] = triangles.corners[:, 2]
    texels[:, 1, 2] = triangles.parent
    texels[:, 1, 3] = view.handedness[triangles.parent]
    cut = np.flatnonzero((triangles.weights != np.eye(3)).any(axis=(1, 2)))
    for start, corners in ((2, view.scene.positions), (5, view.normals), (8, view.scene.tangents)):
        texels[:, start : start + 3, :3] = corners[triangles.parent]
        texels[cut, start : start + 3, :3] = np.einsum(
            "tkj,tji->tki", triangles.weights[cut], corners[triangles.parent[cut]]
        )
    texels[:, 2:5, 3] = triangles.inverse_w
    return texels


def uv_texels(view: View, triangles: WindowTriangles) -> Float[np.ndarray, "T 2 4"]:
    """Per triangle the texture coordinates of its corners: u0 v0 u1 v1, u2 v2 0 0. Float32; all 0 on parts without."""
    texels = np.zeros((len(triangles.parent), UV_TEXELS, 4), dtype=np.float32)
    texels.reshape(-1, 8)[:, :6] = view.uv(triangles).reshape(-1, 6)
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


@dataclass(frozen=True, eq=False)
class FactorTexels:
    """The factors of a pack as `factors.glsl` wants them.

    texels (rows, columns, 4) : four terms a texel, axes side by side, and within an axis its levels; float16 where the
    pack is in half precision, which holds its factors exactly, else float32.
    axes : 1 / maximum, size - 1, first column and kind of each.
    levels, last_levels : first column, size - 1 and 1 / spacing of each level of each axis, padded to `MOST_LEVELS`,
    and the number of each axis' last; of mip-mapped factors alone.
    """

    texels: np.ndarray
    axes: list[tuple[float, ...]]
    levels: list[tuple[float, ...]]
    last_levels: list[float]

    @property
    def values(self) -> dict[str, object]:
        """Uniforms beside `axes`."""
        return {"levels": self.levels, "last_level": self.last_levels} if self.levels else {}

    def texture(self, owner: Owner) -> moderngl.Texture:
        """The texels on the GPU, kept by `owner`."""
        dtype = "f2" if self.texels.dtype == np.float16 else "f4"
        return owner.texture((self.texels.shape[1], self.texels.shape[0]), 4, self.texels.tobytes(), dtype)


def factor_texels(pack: FactorPack, mipmapped: bool = False) -> FactorTexels:
    """Lay the factors of a pack out for the GPU, their means over wider and wider samples too if `mipmapped`.

    Raises
    ------
    InputError : a pack that calls itself half precision holds what 16 bits do not.
    """
    rows = -(-pack.rank // 4)
    tables = pyramid(pack) if mipmapped else pack.factors
    columns = sum(len(table) for table in tables)
    texels = np.zeros((rows, columns, 4), dtype=np.float32)
    axes, levels, last_levels, first = [], [], [], 0
    for axis, table in zip(pack.axes, tables, strict=True):
        padded = np.zeros((len(table), rows * 4), dtype=np.float32)
        padded[:, : pack.rank] = table
        texels[:, first : first + len(table)] = padded.reshape(len(table), rows, 4).swapaxes(0, 1)
        kind = 2.0 if axis.periodic else 1.0 if axis.warp == "sqrt" else 0.0
        axes.append((1.0 / axis.maximum, axis.size - 1.0, float(first), kind))
        if mipmapped:
            made = axis_levels(axis)
            each = zip(made.starts, made.sizes, made.spacings, strict=True)
            of_axis = [(float(first + at), size - 1.0, 1.0 / spacing) for at, size, spacing in each]
            levels += of_axis + [of_axis[-1]] * (MOST_LEVELS - len(of_axis))
            last_levels.append(len(of_axis) - 1.0)
        first += len(table)
    if pack.precision == "half":
        texels = _halved(texels)
    return FactorTexels(texels, axes, levels, last_levels)


def texture_bytes(packs: Sequence[FactorPack], mipmapped: bool = False) -> int:
    """Bytes that the factors of packs take on the GPU."""
    return sum(factor_texels(pack, mipmapped).texels.nbytes for pack in packs)


def _halved(texels: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):
        halved = texels.astype(np.float16)
    if not np.array_equal(halved, texels):
        worst = texels.flat[np.argmax(np.abs(texels - np.nan_to_num(halved.astype(np.float32))))]
        raise InputError(
            "factors of a half-precision pack do not fit into 16 bits",
            field="factors",
            found=float(worst),
            expected="numbers that 16 bits hold exactly",
            hint="materials.fitting.half.rounded_to_half makes such a pack",
        )
    return halved


def weight_texels(weights: Float[np.ndarray, "R M3"]) -> Float[np.ndarray, "rows M3 4"]:
    """Folded weights four terms a texel: a column for X, Y and Z of each spectrum."""
    rows = -(-len(weights) // 4)
    padded = np.zeros((rows * 4, weights.shape[1]), dtype=np.float32)
    padded[: len(weights)] = weights
    return np.ascontiguousarray(padded.reshape(rows, 4, -1).swapaxes(1, 2))
