"""Pictures on a surface: between texels, over what a sample spans, and repeated beyond [0, 1].

(u, v) = (0, 0) is the lower left corner of a picture, so that row 0, which is on top, ends at v = 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int


def between(
    uv: Float[np.ndarray, "N 2"], height: int, width: int
) -> tuple[Int[np.ndarray, "N 4"], Int[np.ndarray, "N 4"], Float[np.ndarray, "N 4"]]:
    """Rows, columns and shares of the four texels about each point; shares are linear between the texels' middles."""
    place = np.stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height], axis=1) - 0.5
    first = np.floor(place).astype(np.int64)
    columns = (first[:, :1] + (0, 1, 0, 1)) % width
    rows = (first[:, 1:] + (0, 0, 1, 1)) % height
    right, down = np.moveaxis(place - first, -1, 0)
    return (
        rows,
        columns,
        np.stack([(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down], axis=1),
    )


def look_up(picture: Float[np.ndarray, "H W C"], uv: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N C"]:
    """A picture between its texels, at each point."""
    height, width, _ = picture.shape
    rows, columns, shares = between(uv, height, width)
    return np.einsum("nk,nkc->nc", shares, picture[rows, columns].astype(np.float64, copy=False))


def levels_of(picture: Float[np.ndarray, "H W C"]) -> list[Float[np.ndarray, "_ _ C"]]:
    """The picture, and means of it over half as many texels each way, down to a single one.

    Means are by area: a size that is odd is halved to the next smaller number, whose texels are a little more than two
    wide. Float64.
    """
    found = [np.asarray(picture, dtype=np.float64)]
    while max(found[-1].shape[:2]) > 1:
        finer = found[-1]
        found.append(_halved(_halved(finer).swapaxes(0, 1)).swapaxes(0, 1))
    return found


def level_at(footprint: Float[np.ndarray, "N 2 2"], height: int, width: int, last: int) -> Float[np.ndarray, " N"]:
    """The level, with its fraction, whose texels are as wide as the longer side of what a sample spans."""
    sides = np.linalg.norm(footprint * (width, height), axis=-1)
    return np.clip(np.log2(np.maximum(sides.max(axis=1), 1.0)), 0.0, float(last))


def filtered(
    levels: Sequence[Float[np.ndarray, "_ _ C"]], uv: Float[np.ndarray, "N 2"], footprint: Float[np.ndarray, "N 2 2"]
) -> Float[np.ndarray, "N C"]:
    """The mean of a picture over what each sample spans, between two levels."""
    height, width, planes = levels[0].shape
    level = level_at(footprint, height, width, len(levels) - 1)
    fine = level.astype(np.int64)
    out = np.empty((len(uv), planes))
    for number in np.unique(fine):
        here = np.flatnonzero(fine == number)
        out[here] = look_up(levels[number], uv[here])
        part = (level[here] - number)[:, None]
        if number + 1 < len(levels) and part.any():
            out[here] += part * (look_up(levels[number + 1], uv[here]) - out[here])
    return out


def _halved(rows: Float[np.ndarray, "n k C"]) -> Float[np.ndarray, "m k C"]:
    """Means by area over half as many rows."""
    from scipy import sparse

    size = len(rows)
    count = max(1, size // 2)
    # No more than four texels reach into one of the new ones, which are less than three wide.
    new = np.repeat(np.arange(count), 4)
    texel = np.floor(new * (size / count)).astype(np.int64) + np.tile(np.arange(4), count)
    covered = np.minimum((new + 1) * (size / count), texel + 1.0) - np.maximum(new * (size / count), texel)
    some = (covered > 0.0) & (texel < size)
    means = sparse.csr_array((covered[some] * (count / size), (new[some], texel[some])), shape=(count, size))
    return (means @ rows.reshape(size, -1)).reshape(count, *rows.shape[1:])
