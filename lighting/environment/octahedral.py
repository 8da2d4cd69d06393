"""Octahedral maps of all directions: a square of texels that covers the sphere evenly and needs no trigonometry.

A direction is divided by its L1 norm, which projects it onto an octahedron; the upper half (y >= 0) is the diamond in
the middle of the square [-1, 1]^2, x along columns and z along rows, and the lower half is folded out into the corners
(Praun and Hoppe 2003; Engelhardt and Dachsbacher 2008). Axes are those of the world, so that maps of different places
can be interpolated texel by texel. Texel (row, column) of an n x n map has its centre at (2 (column + 1/2) / n - 1, 2
(row + 1/2) / n - 1).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

# Number that 1 is kept as in 16 bits.
_FULL = 32767.0


def unfolded(u: Float[np.ndarray, "*#n"], v: Float[np.ndarray, "*#n"]) -> Float[np.ndarray, "*n 3"]:
    """Return unit directions of places (u, v) of the square, each from -1 to 1."""
    u, v = np.broadcast_arrays(u, v)
    up = 1.0 - np.abs(u) - np.abs(v)
    outside = np.maximum(-up, 0.0)
    to = np.stack([u - np.copysign(outside, u), up, v - np.copysign(outside, v)], axis=-1)
    return to / np.linalg.norm(to, axis=-1, keepdims=True)


def places(to: Float[np.ndarray, "*n 3"]) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """Return (u, v), each from -1 to 1, of directions of any non-zero length."""
    x, y, z = np.moveaxis(to, -1, 0)
    size, below = np.abs(x) + np.abs(y) + np.abs(z), y < 0.0
    x, z = x / size, z / size
    return (
        np.where(below, np.copysign(1.0 - np.abs(z), x), x),
        np.where(below, np.copysign(1.0 - np.abs(x), z), z),
    )


def texel_directions(side: int) -> Float[np.ndarray, "side side 3"]:
    """Return unit directions of texel centres."""
    middles = (2.0 * np.arange(side) + 1.0) / side - 1.0
    return unfolded(middles[None, :], middles[:, None])


def bordered(texels: Float[np.ndarray, "side side K"]) -> Float[np.ndarray, "padded padded K"]:
    """Pad a map by one texel at each edge: the border repeats the edge's own texels, reversed."""
    side = len(texels)
    padded = np.empty((side + 2, side + 2, texels.shape[2]), dtype=texels.dtype)
    padded[1:-1, 1:-1] = texels
    padded[0, 1:-1], padded[-1, 1:-1] = texels[0, ::-1], texels[-1, ::-1]
    padded[1:-1, 0], padded[1:-1, -1] = texels[::-1, 0], texels[::-1, -1]
    padded[0, 0], padded[0, -1] = texels[-1, -1], texels[-1, 0]
    padded[-1, 0], padded[-1, -1] = texels[0, -1], texels[0, 0]
    return padded


def solid_angles(size: int) -> Float[np.ndarray, " texels"]:
    """Return the solid angles of all texels, sr; their sum is 4 pi.

    A texel's area over the cube of the length of its point on the octahedron |x| + |y| + |z| = 1.
    """
    to = texel_directions(size).reshape(-1, 3)
    density = np.abs(to).sum(axis=1) ** 3
    return density * (4.0 * np.pi / density.sum())


def texel_at(to: Float[np.ndarray, "*n 3"], size: int) -> Int[np.ndarray, "*n"]:
    """Return the index of the texel that contains each direction."""
    x, z = places(to)
    column, row = (np.clip(((each + 1.0) * (0.5 * size)).astype(np.int64), 0, size - 1) for each in (x, z))
    return row * size + column


def around(to: Float[np.ndarray, "*n 3"], size: int) -> tuple[Int[np.ndarray, "*n 4"], Float[np.ndarray, "*n 4"]]:
    """Return the four texels around each direction and their bilinear weights.

    The map wraps at the rim of the square: column c of row -1 is column size - 1 - c of row 0.
    """
    x, z = places(to)
    column, row = ((each + 1.0) * (0.5 * size) - 0.5 for each in (x, z))
    left, top = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
    right_share, bottom_share = column - left, row - top
    texels, weights = [], []
    for down in (0, 1):
        for right in (0, 1):
            texels.append(_folded_texel(top + down, left + right, size))
            weights.append(
                (bottom_share if down else 1.0 - bottom_share) * (right_share if right else 1.0 - right_share)
            )
    return np.stack(texels, axis=-1), np.stack(weights, axis=-1)


def slopes(to: Float[np.ndarray, "*n 3"], size: int) -> Float[np.ndarray, "*n 4 3"]:
    """Differentiate the weights of `around` with respect to a unit direction, 1/rad: tangent vectors, world."""
    on = to / np.abs(to).sum(axis=-1, keepdims=True)
    x, z = places(to)
    right, down = ((each + 1.0) * (0.5 * size) - 0.5 for each in (x, z))
    right, down = right - np.floor(right), down - np.floor(down)
    # Derivatives of on.x and on.z: that of the divisor, the L1 norm, is the signs of all components.
    length = np.abs(to).sum(axis=-1, keepdims=True)
    signs = np.copysign(1.0, to)
    of_x, of_z = ((np.eye(3)[k] - on[..., k : k + 1] * signs) / length for k in (0, 2))
    turned = -(signs[..., :1] * signs[..., 2:])
    below = to[..., 1:2] < 0.0
    across, along = np.where(below, turned * of_z, of_x), np.where(below, turned * of_x, of_z)
    found = []
    for row in (0, 1):
        for column in (0, 1):
            by_column, by_row = (right if column else 1.0 - right), (down if row else 1.0 - down)
            one, other = (1.0 if column else -1.0) * by_row, (1.0 if row else -1.0) * by_column
            found.append(one[..., None] * across + other[..., None] * along)
    return 0.5 * size * np.stack(found, axis=-2)


def _folded_texel(row: Int[np.ndarray, "*n"], column: Int[np.ndarray, "*n"], size: int) -> Int[np.ndarray, "*n"]:
    """Return the index of a texel that may be one beyond the rim."""
    over, beside = (row < 0) | (row >= size), (column < 0) | (column >= size)
    inside_row, inside_column = np.clip(row, 0, size - 1), np.clip(column, 0, size - 1)
    # At a corner both turn, and the texel is the opposite corner's: all four corners are the one lowest direction.
    found_row = np.where(beside, size - 1 - inside_row, inside_row)
    found_column = np.where(over, size - 1 - inside_column, inside_column)
    return found_row * size + found_column


def in_two(to: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "n 2"]:
    """Encode unit directions as places of the square in steps of 1 / 32767, 16 bits each: accurate to 1e-4 rad."""
    return np.rint(np.stack(places(to), axis=1) * _FULL).astype(np.int16)


def out_of_two(kept: Int[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Decode unit directions encoded by `in_two`."""
    return unfolded(*(kept.T / _FULL))
