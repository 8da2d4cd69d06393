"""Latitude-longitude maps of directions: texel positions on the sphere, and interpolation between texels.

The layout is OpenEXR's (ENVMAP_LATLONG), Mitsuba's and Poly Haven's: row 0 is up (+y); the centre of the image is +z,
its left and right edges are -z, and +x is a quarter from the left.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def directions(rows: Float[np.ndarray, "*#n"], columns: Float[np.ndarray, "*#n"]) -> Float[np.ndarray, "*n 3"]:
    """Return unit directions of places in a map: rows from 0 (up) to 1 (down), columns from 0 (left) to 1."""
    polar, round_ = np.pi * np.asarray(rows), 2.0 * np.pi * np.asarray(columns)
    sine = np.sin(polar)
    return np.stack(np.broadcast_arrays(sine * np.sin(round_), np.cos(polar), -sine * np.cos(round_)), axis=-1)


def places(to: Float[np.ndarray, "*n 3"]) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """Return rows and columns, each from 0 to 1, of directions of any length; column 0 at a pole."""
    rows = np.arctan2(np.hypot(to[..., 0], to[..., 2]), to[..., 1]) / np.pi
    return rows, np.arctan2(to[..., 0], -to[..., 2]) / (2.0 * np.pi) % 1.0


def texel_directions(height: int, width: int) -> Float[np.ndarray, "height width 3"]:
    """Return unit directions of texel centres."""
    rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
    return directions(*np.meshgrid(rows, columns, indexing="ij"))


def solid_angles(height: int, width: int) -> Float[np.ndarray, " height"]:
    """Return the solid angle of a texel in each row, sr; exact."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return (edges[:-1] - edges[1:]) * 2.0 * np.pi / width


class TexelWeights:
    """Bilinear weights of texels for directions (n, 3) of any length, in maps of one size; rows are clamped at the
    poles.
    """

    def __init__(self, to: Float[np.ndarray, "n 3"], height: int, width: int) -> None:
        rows, columns = places(to)
        rows = np.clip(rows * height - 0.5, 0.0, height - 1.0)
        columns = columns * width - 0.5
        row, column = np.floor(rows).astype(np.int64), np.floor(columns).astype(np.int64)
        self._down, self._right = rows - row, columns - column
        above, below = row * width, np.minimum(row + 1, height - 1) * width
        column, after = column % width, (column + 1) % width
        self._texels = (above + column, above + after), (below + column, below + after)

    def of(self, fields: Float[np.ndarray, "K H W"]) -> Float[np.ndarray, "n K"]:
        """Interpolate fields in the directions."""
        flat, left, up = fields.reshape(len(fields), -1), 1.0 - self._right, 1.0 - self._down
        above, under = (
            flat.take(near, axis=1) * left + flat.take(far, axis=1) * self._right for near, far in self._texels
        )
        return (above * up + under * self._down).T


def between_texels(fields: Float[np.ndarray, "K H W"], to: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n K"]:
    """Interpolate fields in directions of any length, linear between texel centres; rows are clamped at the poles."""
    return TexelWeights(to, *fields.shape[1:]).of(fields)
