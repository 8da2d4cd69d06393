"""Summand of BTFs: interpolation among four texels, three views and three lights around a point.

Weights of different clusters are not comparable and are never mixed: clusters are evaluated first, and mixed then.
Coarser mip levels have clusters of their own (`mip_levels`); points are interpolated between two levels.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ..core.axes import Frame
from ..core.fast import MOST_TEXELS, Summand
from ..core.points import Points
from ..core.terms import Terms, TermShader
from .clustered_form import ClusteredForm
from .corners import by_cluster, levels_at, listed_levels
from .hemisphere import Hemisphere
from .mip_levels import TexelLevel, with_mean
from .reflectance_field import ReflectanceField

# Points per block: all that a cluster has between three views and three lights is held of each.
_BLOCK = 1 << 11


@dataclass(frozen=True, eq=False)
class TexelSummand(Summand):
    """Look-up of BTF texels: term j is coefficient j of f_r cos(theta_i) at a point.

    palette : one entry of J spectra, 1 each where values are in 1/sr.

    Raises
    ------
    InputError : a palette that does not fit the basis.
    """

    uses_uv: ClassVar[bool] = True

    form: ClusteredForm | ReflectanceField
    palette: Palette
    precision: Literal["single", "half"] = "single"
    frame: Frame = "io"

    def __post_init__(self) -> None:
        expected = (1, self.form.basis.size)
        if (self.palette.entries, self.palette.rank) != expected:
            words = f"one entry of {expected[1]} spectra"
            found = f"{self.palette.entries} of {self.palette.rank}"
            raise InputError("a palette that does not fit", field="palette", found=found, expected=words)

    @property
    @abc.abstractmethod
    def size(self) -> tuple[int, int]:
        """Texels down and across."""

    @property
    def grid(self) -> str:
        """Texels across and down, views and lights."""
        height, width = self.size
        return f"{width} x {height} texels, {len(self.form.views)} views x {len(self.form.lights)} lights"


@dataclass(frozen=True, eq=False)
class BtfTexels(TexelSummand):
    """Look-up of local PCA."""

    form: ClusteredForm

    @cached_property
    def table(self) -> Float[np.ndarray, "k V Lt c1 J"]:
        """Table of the form (`ClusteredForm.table`), with components at weight 1."""
        return self.form.table()

    @property
    def weights(self) -> Float[np.ndarray, "T c1"]:
        """Weights of each texel in row-major order, 1 first; float32."""
        return self.whole.weights

    @cached_property
    def whole(self) -> TexelLevel:
        """Level 0, of the stored texels."""
        return TexelLevel(self.form.number, with_mean(self.form.weights), self.table)

    @property
    def size(self) -> tuple[int, int]:
        """Texels down and across."""
        height, width = self.form.number.shape
        return height, width

    def level(self, number: int) -> TexelLevel:
        """Return the texels of a mip level; coarser ones are computed on first use, once for all bases."""
        return self.whole if number == 0 else self.form.coarser()[number - 1]

    def levels(self, filtered: bool) -> tuple[TexelLevel, ...]:
        """Return all levels, or level 0 alone without filtering."""
        return (self.whole, *(self.form.coarser() if filtered else ()))

    def tallest(self, number: int) -> Float[np.ndarray, "#k c1"]:
        """Return the scale of a level's components on the GPU, multiplied into weights so that half precision suffices.

        For stored texels, whose weights are integers, it is the same for all clusters.
        """
        largest = self.level(number).largest
        return largest if number else largest.max(axis=0, keepdims=True)

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`, averaged over the footprint of points that have one."""
        assert points.uv is not None
        value = np.zeros((len(points), self.palette.rank))
        scale = points.angles(self.frame).scale
        lit = np.flatnonzero(scale > 0.0)
        for start in range(0, len(lit), _BLOCK):
            some = lit[start : start + _BLOCK]
            spanned = None if points.spans is None or points.footprint is None else points.footprint[some]
            for number, here, share in levels_at(spanned, self.size, len(some)):
                at = some[here]
                found = self._at(self.level(number), points.uv[at], points.wi[at], points.wo[at])
                value[at] += found * (share * scale[at])[:, None]
        return Terms(value)

    def _at(
        self,
        level: TexelLevel,
        uv: Float[np.ndarray, "N 2"],
        wi: Float[np.ndarray, "N 3"],
        wo: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N J"]:
        """Evaluate the coefficients at points, on one level."""
        view, of_view = self.form.views.shares(wo)
        light, of_light = self.form.lights.shares(wi, falling=True)
        pair = (view[:, :, None] * len(self.form.lights) + light[:, None, :]).reshape(-1, 9)
        share = (of_view[:, :, None] * of_light[:, None, :]).reshape(-1, 1, 9).astype(np.float32)
        components, size = level.table.shape[3:]
        # All numbers of a cluster, a view and a light in one row.
        rows = level.table.reshape(-1, components * size)
        pairs = len(rows) // len(level.table)
        total = np.zeros((len(uv), size))
        for here, cluster, weights in by_cluster(level, uv):
            nine = rows.take(cluster[:, None] * pairs + pair[here], axis=0)
            found = (share[here] @ nine).reshape(-1, components, size)
            total[here] += (weights[:, None] @ found)[:, 0]
        return total

    def shader(self, filtered: bool = False) -> TermShader:
        """Implement `Summand.shader`; components are in half precision, relative to the largest of each."""
        scaled = [
            in_fours(level.table / self.tallest(number)[:, None, None, :, None])
            for number, level in enumerate(self.levels(filtered))
        ]
        textures = {
            "components": folded(np.concatenate(scaled)),
            "texels": self.packed(filtered),
            "views": directions_listed(self.form.views),
            "lights": directions_listed(self.form.lights),
        }
        sizes = {"COMPONENTS": self.table.shape[3], "FOURS": -(-self.palette.rank // 4)}
        views, lights = self.form.views, self.form.lights
        sizes |= {"CELLS": views.cells.shape[0], "VIEWS": len(views), "LIGHTS": len(lights)}
        sizes |= {"VIEW_CELLS": views.cells.shape[2], "LIGHT_CELLS": lights.cells.shape[2]}
        places, uniforms = listed_levels([level.number.shape for level in self.levels(filtered)])
        steps = steps_of_corners(sizes["COMPONENTS"], 9 * (1 + sizes["COMPONENTS"]), filtered) * sizes["FOURS"]
        return TermShader(Path(__file__).with_suffix(".glsl"), sizes | places, textures, uniforms, steps)

    def packed(self, filtered: bool) -> np.ndarray:
        """Pack each texel's cluster and weights, four numbers per GPU texel side by side; levels one below another."""
        levels = self.levels(filtered)
        quads = -(-(1 + self.table.shape[3]) // 4)
        heights, width = [len(level.number) for level in levels], self.form.number.shape[1]
        if width * quads > MOST_TEXELS or sum(heights) > MOST_TEXELS:
            found, expected = f"{width * quads} x {sum(heights)} texels", f"at most {MOST_TEXELS} each way"
            raise InputError("a BTF too large for the GPU", field="texels", found=found, expected=expected)
        found = np.zeros((sum(heights), width, quads * 4), dtype=np.float32)
        top = clusters = 0
        for number, level in enumerate(levels):
            height, across = level.number.shape
            here = found[top : top + height, :across]
            cluster = level.number.ravel().astype(np.int64)
            tallest = np.broadcast_to(self.tallest(number), level.largest.shape)
            here[..., 0] = (cluster + clusters).reshape(height, across)
            here[..., 1 : 1 + level.weights.shape[1]] = (level.weights * tallest[cluster]).reshape(height, across, -1)
            top, clusters = top + height, clusters + len(level.table)
        return found.reshape(sum(heights), width * quads, 4)

    @property
    def key(self) -> tuple:
        """Identity of the form."""
        return "btf", id(self.form)

    @property
    def nbytes(self) -> int:
        """Bytes of memory used for rendering."""
        return self.table.nbytes + self.form.weights.nbytes + self.form.number.nbytes + self.palette.values.nbytes


def steps_of_corners(components: int, for_each: int, filtered: bool) -> int:
    """Count the loop rounds of `texel.glsl`: those of four corners, and `for_each` cluster's own."""
    weights = 4 * (3 + (components + 4) // 4)
    return (2 if filtered else 1) * 4 * (1 + weights + for_each)


def in_fours(values: Float[np.ndarray, "*n J"], kind: type[np.floating] = np.float16) -> np.ndarray:
    """Pack coefficients four to a texel, padded with zeros; in half precision by default."""
    size = values.shape[-1]
    padded = np.zeros((*values.shape[:-1], -(-size // 4) * 4), dtype=kind)
    padded[..., :size] = values
    return padded.reshape(-1, 4)


def folded(rows: Float[np.ndarray, "n 4"]) -> np.ndarray:
    """Fold a long list of texels row by row into a picture of at most `MOST_TEXELS` each way.

    Raises
    ------
    InputError : the list is longer.
    """
    height = -(-len(rows) // MOST_TEXELS)
    if height > MOST_TEXELS:
        found, expected = f"{len(rows)} numbers", f"at most {MOST_TEXELS**2}"
        raise InputError("a BTF too large for the GPU", field="components", found=found, expected=expected)
    width = min(len(rows), MOST_TEXELS)
    padded = np.zeros((height * width, 4), dtype=rows.dtype)
    padded[: len(rows)] = rows
    return padded.reshape(height, width, 4)


def directions_listed(hemisphere: Hemisphere) -> np.ndarray:
    """Make the texture for `hemisphere.glsl`: the number of triangles, the triangles, then each cell's triangles.

    Each corner of a triangle takes two texels: its row of `Hemisphere.inverse`, and 0; then its measured direction, the
    cosine of that, whether it is a repeated outer corner, and 0.
    """
    corners = hemisphere.triangles
    triangles = np.zeros((len(corners), 3, 2, 4), dtype=np.float32)
    triangles[:, :, 0, :3] = hemisphere.inverse
    measured = hemisphere.measured[corners]
    triangles[:, :, 1, 0] = measured
    triangles[:, :, 1, 1] = hemisphere.directions[measured, 2]
    triangles[:, :, 1, 2] = corners >= len(hemisphere)
    cells = np.zeros((hemisphere.cells.size, 4), dtype=np.float32)
    cells[:, 0] = hemisphere.cells.ravel()
    head = np.zeros((1, 4), dtype=np.float32)
    head[0, 0] = len(corners)
    return folded(np.concatenate([head, triangles.reshape(-1, 4), cells]))
