"""Many small systems of normal equations side by side: Cholesky's factors with the systems along the last axis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float


def solved(
    square: Float[np.ndarray, "m m N"],
    right: Float[np.ndarray, "m J N"],
    rounded: Callable[[int, Float[np.ndarray, "J N"]], Float[np.ndarray, "J N"]] | None = None,
) -> Float[np.ndarray, "m J N"]:
    """Unknowns of N positive definite systems; both arguments are overwritten, `right` by what is found.

    rounded : makes of unknown number i what is kept of it. The last unknown is rounded first, and those before it then
        make up for that as well as they can (Babai 1986, nearest plane).
    """
    size = len(square)
    for j in range(size):
        square[j:, j] /= np.sqrt(square[j, j])
        right[j] /= square[j, j]
        square[j + 1 :, j + 1 :] -= square[j + 1 :, j, None] * square[None, j + 1 :, j]
        right[j + 1 :] -= square[j + 1 :, j, None] * right[j]
    for j in reversed(range(size)):
        right[j] -= (square[j + 1 :, j, None] * right[j + 1 :]).sum(axis=0)
        right[j] /= square[j, j]
        if rounded is not None:
            right[j] = rounded(j, right[j])
    return right
