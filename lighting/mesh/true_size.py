"""Textures at true size: lengths of u and v on a mesh, and their uniformity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError

#: Share of a surface excluded at either end of the range of a texture's size.
_ENDS = 0.05
#: Ratio of sizes above which a texture is reported as uneven.
UNEVEN = 1.1


class UvLengths(NamedTuple):
    """Lengths of u and v on a surface, weighted by area, in its own units: means, and 5th and 95th percentiles."""

    mean: Float[np.ndarray, "2"]
    low: Float[np.ndarray, "2"]
    high: Float[np.ndarray, "2"]

    @property
    def words(self) -> str | None:
        """Describe the unevenness of a texture; None if it is even."""
        if (self.high <= UNEVEN * self.low).all():
            return None
        spans = (
            f"{100.0 * low / mean:.0f} to {100.0 * high / mean:.0f} % along {axis}"
            for axis, low, mean, high in zip("uv", self.low, self.mean, self.high, strict=True)
        )
        return f"its texture has the size that was asked for on average: {' and '.join(spans)} of it"


def uv_lengths(corners: Float[np.ndarray, "F 3 3"], uv: Float[np.ndarray, "F 3 2"], name: str) -> UvLengths:
    """Compute |dP/du| and |dP/dv| of triangles, weighted by area; triangles without area, or extent in uv, are ignored.

    Raises
    ------
    InputError : no triangle with both.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    (du, dv), (eu, ev) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    area, extent = np.linalg.norm(np.cross(first, second), axis=1), du * ev - eu * dv
    some = np.flatnonzero((area > 0.0) & (extent != 0.0))
    if not len(some):
        expected = "triangles that have an extent in u and v"
        raise InputError("texture coordinates without extent", field="uv_size_mm", found=name, expected=expected)
    first, second, area, extent = first[some], second[some], area[some], extent[some, None]
    along_u = (first * ev[some, None] - second * dv[some, None]) / extent
    along_v = (second * du[some, None] - first * eu[some, None]) / extent
    found = []
    for along in (along_u, along_v):
        length = np.linalg.norm(along, axis=1)
        order = np.argsort(length)
        share = np.cumsum(area[order]) / area.sum()
        low, high = (length[order][min(int(np.searchsorted(share, at)), len(order) - 1)] for at in (_ENDS, 1.0 - _ENDS))
        found.append((float(np.average(length, weights=area)), low, high))
    return UvLengths(*np.array(found).T)
