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
    """At which levels points are looked up; see `svbrdf.texels.at_levels`.

    footprint : None where nothing is filtered: all points are then looked up at level 0. size : height and width of the
    texture. count : of points.
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
    """Group the four texels about points by cluster, each once a point: which points, which cluster, and weights.

    Weights of one cluster's components are summed first, which is the same and costs less: of four texels most share
    theirs.
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
    """Find the four texels in three views about points: the weight of each, the view, its row and column."""
    view, of_view = form.views.shares(wo)
    rows, columns, shares = between(uv, form.height, form.width)
    for texel in range(4):
        for side in range(3):
            yield of_view[:, side] * shares[:, texel], view[:, side], rows[:, texel], columns[:, texel]


def listed_levels(
    sizes: Sequence[tuple[int, ...]], each: Sequence[int] | None = None
) -> tuple[dict[str, int], dict[str, Any]]:
    """List levels for `corners.glsl`, by heights and widths: definitions and uniforms.

    each : how much of what holds them each takes; None: its rows, one level below the other.
    """
    if len(sizes) == 1:
        return {}, {"size": sizes[0][::-1]}
    tops = np.concatenate([[0], np.cumsum([height for height, _ in sizes] if each is None else each)])
    levels = [(float(width), float(height), float(top)) for (height, width), top in zip(sizes, tops, strict=False)]
    return {"LEVELS": len(sizes)}, {"levels": levels}
