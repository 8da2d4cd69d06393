"""Amplitudes of given lobes: least squares for all coefficients at once, and their rounding.

Residuals are weighted by a power of dL*/dY. Amplitudes are rounded one by one, each compensating for those before.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int8

from ...spectral.basis import SpectralBasis
from ...spectral.difference import lightness_slope
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .quantisation import coded_amplitudes, decoded_amplitudes

# Power of dL*/dY that weighs errors: 1 would be lightness itself; below it, saturated and dark values count for less,
# since their error is in chroma as well.
_POWER = 0.75
# Ridge, relative to the mean of the diagonal: similar lobes would else have large amplitudes of opposite sign.
_HELD = 1e-5


def to_luminance(basis: SpectralBasis) -> Float[np.ndarray, " J"]:
    """Return the weights from coefficients of f_r cos(theta_i) to Y under D65, for the 1931 observer; float32."""
    return np.pi * basis.fold(illuminant("D65"), observer("1931_2"))[1].astype(np.float32)


def weights_of(luminance: Float[np.ndarray, "n Lt"]) -> Float[np.ndarray, "n Lt"]:
    """Compute the weights of residuals from the luminance of values."""
    return lightness_slope(luminance.astype(np.float64)) ** _POWER


def summed(values: Float[np.ndarray, "*n G k"], amplitudes: Float[np.ndarray, "*n k J"]) -> Float[np.ndarray, "*n J"]:
    """Sum lobe values times amplitudes, for each coefficient."""
    return np.einsum("...gk,...kg->...g" if values.shape[-2] > 1 else "...gk,...kj->...j", values, amplitudes)


class Equations:
    """Normal equations of the amplitudes of a view's texels: m functions in each of G sets."""

    def __init__(self, texels: int, functions: int, sets: int, size: int) -> None:
        self.square = np.empty((sets, functions, functions, texels))
        self.right = np.empty((sets, functions, size // sets, texels))

    def add(
        self,
        rows: slice,
        one: int,
        lobes: Float[np.ndarray, "n k Lt"],
        weights: Float[np.ndarray, "n Lt"],
        values: Float[np.ndarray, "n Lt j"],
    ) -> None:
        """Add the equations of some texels."""
        functions = np.concatenate([np.ones((len(lobes), 1, lobes.shape[2]), lobes.dtype), lobes], axis=1)
        # Relative, so that no texel is held back more than another.
        squares = (weights / np.sqrt(np.mean(weights**2, axis=1, keepdims=True))) ** 2
        weighed = functions * squares[:, None].astype(lobes.dtype)
        square = (weighed @ functions.swapaxes(1, 2)).astype(np.float64)
        diagonal = np.einsum("nii->ni", square)
        diagonal += _HELD * diagonal.mean(axis=1, keepdims=True)
        self.square[one, ..., rows] = square.transpose(1, 2, 0)
        self.right[one, ..., rows] = (weighed @ values).transpose(1, 2, 0)

    def rounded(self) -> tuple[Float[np.ndarray, "m J"], Int8[np.ndarray, "T m J"]]:
        """Solve for amplitudes and round them, each compensating for those before; return scales and codes."""
        every = list(zip(self.square, self.right, strict=True))
        exact = [solved(square.copy(), right.copy()) for square, right in every]
        largest = np.concatenate([np.abs(one).max(axis=2) for one in exact], axis=1)
        found = np.empty((self.right.shape[3], *largest.shape), dtype=np.int8)
        size = self.right.shape[2]
        for number, (square, right) in enumerate(every):
            mine = slice(number * size, (number + 1) * size)

            def kept(function: int, amplitudes: np.ndarray, mine: slice = mine) -> np.ndarray:
                limit = largest[function, mine]
                # Corrections for others may exceed the largest by the rounding of those.
                held = np.clip(amplitudes.T, -limit, limit)
                found[:, function, mine] = coded_amplitudes(held, limit)
                return decoded_amplitudes(found[:, function, mine], limit).T

            solved(square, right, kept)
        return largest, found


def solved(
    square: Float[np.ndarray, "m m N"],
    right: Float[np.ndarray, "m J N"],
    rounded: Callable[[int, Float[np.ndarray, "J N"]], Float[np.ndarray, "J N"]] | None = None,
) -> Float[np.ndarray, "m J N"]:
    """Solve N positive definite systems by Cholesky's method; both arguments are overwritten, `right` by the solution.

    rounded : rounds unknown number i. The last unknown is rounded first, and those before it then compensate as well as
    they can (Babai 1986, nearest plane).
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
