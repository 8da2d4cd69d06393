"""Pictures on a surface: interpolation between texels, filtering over footprints, and wrap modes beyond [0, 1].

(u, v) = (0, 0) is the lower left corner of a picture, so that row 0, which is on top, ends at v = 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ..core.fast import MOST_TEXELS

#: Continuation of a picture beyond [0, 1]: repeated, held at its edge, or mirrored.
Wrap = Literal["repeat", "clamp", "mirror"]
WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
#: Along u and along v.
REPEATED: tuple[Wrap, Wrap] = ("repeat", "repeat")


def between(
    uv: Float[np.ndarray, "N 2"], height: int, width: int, wrap: tuple[Wrap, Wrap] = REPEATED
) -> tuple[Int[np.ndarray, "N 4"], Int[np.ndarray, "N 4"], Float[np.ndarray, "N 4"]]:
    """Return rows, columns and bilinear weights of the four texels around each point."""
    place = np.stack([_inside(uv[:, 0], wrap[0]) * width, (1.0 - _inside(uv[:, 1], wrap[1])) * height], axis=1) - 0.5
    first = np.floor(place).astype(np.int64)
    columns = _texel(first[:, :1] + (0, 1, 0, 1), width, wrap[0])
    rows = _texel(first[:, 1:] + (0, 0, 1, 1), height, wrap[1])
    right, down = np.moveaxis(place - first, -1, 0)
    return (
        rows,
        columns,
        np.stack([(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down], axis=1),
    )


def _inside(along: Float[np.ndarray, " N"], wrap: Wrap) -> Float[np.ndarray, " N"]:
    """Map a coordinate into [0, 1] for the clamp and mirror modes; repetition is left to `_texel`."""
    if wrap == "clamp":
        return np.clip(along, 0.0, 1.0)
    return 1.0 - np.abs(1.0 - np.mod(along, 2.0)) if wrap == "mirror" else along


def _texel(number: Int[np.ndarray, "N 4"], count: int, wrap: Wrap) -> Int[np.ndarray, "N 4"]:
    """Wrap texel indices at an edge: around to the other side, or (in a mirror too) clamped to the edge."""
    return number % count if wrap == "repeat" else np.clip(number, 0, count - 1)


def look_up(
    picture: Float[np.ndarray, "H W C"], uv: Float[np.ndarray, "N 2"], wrap: tuple[Wrap, Wrap] = REPEATED
) -> Float[np.ndarray, "N C"]:
    """Interpolate a picture bilinearly at each point."""
    height, width, _ = picture.shape
    rows, columns, shares = between(uv, height, width, wrap)
    return np.einsum("nk,nkc->nc", shares, picture[rows, columns].astype(np.float64, copy=False))


def levels_of(picture: Float[np.ndarray, "H W C"]) -> list[Float[np.ndarray, "_ _ C"]]:
    """Compute the mip levels of a picture: means over half as many texels each way, down to a single one.

    Means are by area: an odd size is halved to the next smaller number, whose texels are a little more than two wide.
    Float64.
    """
    found = [np.asarray(picture, dtype=np.float64)]
    while max(found[-1].shape[:2]) > 1:
        finer = found[-1]
        found.append(_halved(_halved(finer).swapaxes(0, 1)).swapaxes(0, 1))
    return found


def level_at(footprint: Float[np.ndarray, "N 2 2"], height: int, width: int, last: int) -> Float[np.ndarray, " N"]:
    """Return the fractional level whose texels are as wide as the longer side of the footprint."""
    sides = np.linalg.norm(footprint * (width, height), axis=-1)
    return np.clip(np.log2(np.maximum(sides.max(axis=1), 1.0)), 0.0, float(last))


def at_levels(
    level: Float[np.ndarray, " N"], count: int
) -> Iterator[tuple[int, Int[np.ndarray, " n"], Float[np.ndarray, " n"]]]:
    """Yield each of `count` levels that points are looked up at, with the points and their weights.

    A point is on one level, or between two, whose weights sum to 1.
    """
    for number in range(count):
        share = np.maximum(1.0 - np.abs(level - number), 0.0)
        if len(here := np.flatnonzero(share)):
            yield number, here, share[here]


def filtered(
    levels: Sequence[Float[np.ndarray, "_ _ C"]], uv: Float[np.ndarray, "N 2"], footprint: Float[np.ndarray, "N 2 2"]
) -> Float[np.ndarray, "N C"]:
    """Average a picture over the footprint of each sample, interpolated between two levels."""
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


def packed(
    levels: Sequence[Float[np.ndarray, "_ _ C"]], half: bool = False
) -> tuple[np.ndarray, dict[str, int], list[tuple[float, float, float]] | tuple[float, float, float]]:
    """Pack planes for `texels.glsl`: four to a texel, one four beside the other, levels one below the other.

    Returns the texture, in float16 if `half`; its sizes; and width, height and first row of each level, for a single
    level without a list.

    Raises
    ------
    InputError : a texture larger than every GPU supports.
    """
    width, planes = levels[0].shape[1:]
    quads, heights = max(1, -(-planes // 4)), [len(level) for level in levels]
    if width * quads > MOST_TEXELS or sum(heights) > MOST_TEXELS:
        found, expected = f"{width * quads} x {sum(heights)} texels", f"at most {MOST_TEXELS} each way"
        raise InputError("a texture too large for the GPU", field="planes", found=found, expected=expected)
    texels = np.zeros((sum(heights), quads, width, 4), dtype=np.float16 if half else np.float32)
    places, top = [], 0
    for level in levels:
        height, across, _ = level.shape
        padded = np.zeros((height, across, quads * 4))
        padded[..., :planes] = level
        texels[top : top + height, :, :across] = padded.reshape(height, across, quads, 4).swapaxes(1, 2)
        places.append((float(across), float(height), float(top)))
        top += height
    return (
        texels.reshape(sum(heights), quads * width, 4),
        {"LEVELS": len(levels)},
        places if len(places) > 1 else places[0],
    )


def _halved(rows: Float[np.ndarray, "n k C"]) -> Float[np.ndarray, "m k C"]:
    """Average over half as many rows, by area."""
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
