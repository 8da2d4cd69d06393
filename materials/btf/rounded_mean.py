"""Quantised mean of all texels of a BTF, for each view and light.

First the share of the overall mean colour is rounded, on a scale like lightness; this determines the perceptual metric
(`metric`), in steps of which the residual is rounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from ...spectral.basis import SpectralBasis
from .metric import seen

# Steps of the scale like lightness, and those of the rest, in ΔE94: below what the texels' own rounding leaves.
_LEVELS, _STEP = 255, 0.05
_WIDE = np.iinfo(np.int16)


@dataclass(frozen=True, eq=False)
class RoundedMean:
    """f_r cos(theta_i) of V views under Lt lights, J coefficients in `basis`.

    colour (J,) : the overall mean colour at its brightest, 1/sr, float32. level (V,Lt) : cube roots of shares of it.
    rest (n,V,Lt) : residual along `turn` (J,n), in whole multiples of `step`, ΔE94; turn is in half precision.
    """

    basis: SpectralBasis
    colour: Float[np.ndarray, " J"]
    level: UInt8[np.ndarray, "V Lt"]
    rest: Int[np.ndarray, "n V Lt"]
    turn: Float[np.ndarray, "J n"]
    step: float

    @cached_property
    def values(self) -> Float[np.ndarray, "V Lt J"]:
        """Mean, 1/sr, float32."""
        first = _first(self.level, self.colour)
        rest = np.moveaxis(self.rest, 0, 2).astype(np.float64) @ (self.step * self.turn.astype(np.float64).T)
        # rest = missed @ C.
        back = np.linalg.solve(np.swapaxes(seen(first, self.basis), 2, 3), rest[..., None])[..., 0]
        return (first + back).astype(np.float32)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        return {name: getattr(self, name) for name in ("colour", "level", "rest", "turn", "step")}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> RoundedMean:
        """Return the mean whose `stored()` this is."""
        arrays = {name: np.asarray(kept[name]) for name in ("colour", "level", "rest", "turn")}
        return cls(basis, **arrays, step=float(kept["step"]))


def rounded_mean(mean: Float[np.ndarray, "V Lt J"], basis: SpectralBasis) -> RoundedMean:
    """Quantise a mean, 1/sr."""
    mean = mean.astype(np.float64)
    average = mean.mean(axis=(0, 1))
    square = float(average @ average)
    share = np.maximum(mean @ average / square, 0.0) if square > 0.0 else np.zeros(mean.shape[:2])
    tallest = float(share.max()) or 1.0
    colour = (tallest * average).astype(np.float32)
    level = np.rint(_LEVELS * np.cbrt(share / tallest)).astype(np.uint8)
    first = _first(level, colour)
    missed = np.einsum("vlj,vljk->vlk", mean - first, seen(first, basis))
    flat = missed.reshape(-1, basis.size)
    turn = principal(flat.T @ flat)
    along = flat @ turn.astype(np.float64)
    step = max(_STEP, float(np.abs(along).max(initial=0.0)) / _WIDE.max)
    rest = np.rint(along / step).astype(np.int16)
    some = np.any(rest != 0, axis=0)
    rest = np.ascontiguousarray(rest[:, some].T).reshape(-1, *mean.shape[:2])
    return RoundedMean(basis, colour, level, rest, turn[:, some], step)


def principal(products: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "n n"]:
    """Compute principal components from a Gram matrix, in columns, largest first, in half precision."""
    found = np.linalg.eigh(products)[1][:, ::-1]
    largest = np.abs(found).argmax(axis=0)
    return (found * np.sign(found[largest, np.arange(len(found))])).astype(np.float16)


def _first(level: UInt8[np.ndarray, "V Lt"], colour: Float[np.ndarray, " J"]) -> Float[np.ndarray, "V Lt J"]:
    return (level.astype(np.float64) / _LEVELS)[..., None] ** 3 * colour.astype(np.float64)
