"""Texels around points at one level or two, with their weights; twin of corners.glsl and texel.glsl."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..svbrdf.texels import at_levels, between, level_at
from .mip_levels import TexelLevel
from .reflectance_field import ReflectanceField


def levels_at(
    footprint: Float[np.ndarray, "N 2 2"] | None, size: tuple[int, int], count: int
) -> Iterator[tuple[int, Int[np.ndarray, " n"], Float[np.ndarray, " n"]]]:
    """Yield the mip levels of points, with the points and their weights; see `svbrdf.texels.at_levels`.

    footprint : None without filtering: all points are looked up at level 0. size : height and width of the texture.
    count : number of points.
    """
    if footprint is None:
        yield 0, np.arange(count), np.ones(count)
        return
    last = level_count(*size) - 1
    yield from at_levels(level_at(footprint, *size, last), last + 1)


def level_count(height: int, width: int) -> int:
    """Count the levels of `levels_of`."""
    return max(height, width).bit_length()


def by_cluster(
    level: TexelLevel, uv: Float[np.ndarray, "N 2"]
) -> Iterator[tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, "n c1"]]]:
    """Group the four texels around each point by cluster; yield the points, their cluster, and the summed weights.

    Weights within a cluster are summed before the look-up, which is equivalent and cheaper: most of the four texels
    share a cluster.
    """
    height, width = level.number.shape
    rows, columns, shares = between(uv, height, width)
    place = rows * width + columns
    cluster = level.number.ravel()[place].astype(np.int64)
    first = (cluster[:, :, None] == cluster[:, None, :]).argmax(axis=2)
    shares = shares.astype(np.float32)
    for corner in range(4):
        mine = (first == corner) & (shares > 0.0)
        here = np.flatnonzero(mine[:, 0] | mine[:, 1] | mine[:, 2] | mine[:, 3])
        if not len(here):
            continue
        total = shares[here, corner, None] * level.weights[place[here, corner]]
        for other in range(corner + 1, 4):
            alike = np.flatnonzero(first[here, other] == corner)
            at = here[alike]
            total[alike] += shares[at, other, None] * level.weights[place[at, other]]
        yield here, cluster[here, corner], total


def around(
    form: ReflectanceField, uv: Float[np.ndarray, "N 2"], wo: Float[np.ndarray, "N 3"]
) -> Iterator[
    tuple[
        Float[np.ndarray, " N"],
        Int[np.ndarray, " N"],
        Int[np.ndarray, " N"],
        Int[np.ndarray, " N"],
    ]
]:
    """Yield the four texels in three views around each point: weight, view, row and column."""
    view, of_view = form.views.shares(wo)
    rows, columns, shares = between(uv, form.height, form.width)
    for texel in range(4):
        for side in range(3):
            yield of_view[:, side] * shares[:, texel], view[:, side], rows[:, texel], columns[:, texel]


def listed_levels(
    sizes: Sequence[tuple[int, ...]], each: Sequence[int] | None = None
) -> tuple[dict[str, int], dict[str, Any]]:
    """Make the definitions and uniforms that describe mip levels of the given heights and widths to `corners.glsl`.

    each : length of each level in a list of texels; None if levels are stacked by rows.
    """
    if len(sizes) == 1:
        return {}, {"size": sizes[0][::-1]}
    tops = np.concatenate([[0], np.cumsum([height for height, _ in sizes] if each is None else each)])
    levels = [(float(width), float(height), float(top)) for (height, width), top in zip(sizes, tops, strict=False)]
    return {"LEVELS": len(sizes)}, {"levels": levels}
