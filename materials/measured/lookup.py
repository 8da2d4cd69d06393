"""Dense tables over three axes: refined by splines, and interpolated between their nodes."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def refined(table: np.ndarray, axis: int, times: int, ends: str) -> np.ndarray:
    """Insert `times` - 1 nodes between each two of an axis, by cubic splines; `ends` as in scipy.

    A spline is linear in its data: one matrix serves every line of the table.
    """
    from scipy.interpolate import CubicSpline

    places = np.arange(table.shape[axis], dtype=float)
    finer = np.linspace(0.0, places[-1], times * (len(places) - 1) + 1)
    nodes = CubicSpline(places, np.eye(len(places)), bc_type=ends)(finer)
    before, after = table.shape[:axis], table.shape[axis + 1 :]
    return (nodes @ table.reshape(*before, len(places), -1)).reshape(*before, len(finer), *after)


def multilinear(table: Float[np.ndarray, "H D P L"], places: tuple[np.ndarray, ...]) -> Float[np.ndarray, "N L"]:
    """Interpolate at fractional places in [0, 1] of each axis."""
    flat = table.reshape(-1, table.shape[-1])
    below, beyond = [], []
    for place, size in zip(places, table.shape[:3], strict=True):
        position = np.clip(place, 0.0, 1.0) * (size - 1)
        index = np.minimum(position.astype(np.intp), size - 2)
        below.append(index)
        beyond.append(position - index)
    strides = (table.shape[1] * table.shape[2], table.shape[2], 1)
    corner = sum(index * stride for index, stride in zip(below, strides, strict=True))
    out = np.zeros((len(places[0]), table.shape[-1]), dtype=table.dtype)
    for offset in np.ndindex(2, 2, 2):
        share = np.ones(len(out))
        for step, fraction in zip(offset, beyond, strict=True):
            share = share * (fraction if step else 1.0 - fraction)
        out += share[:, None].astype(table.dtype) * flat[corner + int(np.dot(offset, strides))]
    return out
