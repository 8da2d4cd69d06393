"""Half-precision storage of factor packs: half the memory, and the colour that it costs, measured.

A factor of each term is divided by its own largest value before it is rounded, so that a highlight of any height fits
into 16 bits; what was divided out goes into the term's spectrum, which stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..factored.pack import FactorPack

#: ΔE94 that half precision may add to the 99th percentile.
ALLOWED = 0.1


@dataclass(frozen=True, eq=False)
class HalfStorage:
    """Packs to store, whether they are in half precision, and why.

    cost : ΔE94 that half precision adds to the 99th percentile; None where that was not measured.
    reason : for people.
    """

    packs: tuple[FactorPack, ...]
    half: bool
    cost: float | None
    reason: str


def rounded_to_half(pack: FactorPack) -> FactorPack:
    """Return the pack with factors that 16 bits hold exactly, each column's largest magnitude 1; the same up to
    rounding.
    """
    spectra = pack.palette.values[0]
    factors = []
    for factor in pack.factors:
        tallest = np.abs(factor).max(axis=0)
        scale = np.where(tallest > 0, tallest, 1.0)
        factors.append((factor / scale).astype(np.float16).astype(np.float64))
        spectra = spectra * tallest[:, None]
    return replace(pack.recoloured(spectra), factors=tuple(factors), precision="half")


def half_storage(
    packs: tuple[FactorPack, ...],
    p99: Callable[[tuple[FactorPack, ...]], float],
    allowed: float = ALLOWED,
) -> HalfStorage:
    """Half precision where it adds at most `allowed` to the 99th percentile of ΔE94, else the packs as they are.

    `p99` measures that of packs against what they stand for.
    """
    small = tuple(rounded_to_half(pack) for pack in packs)
    cost = p99(small) - p99(packs)
    if cost <= allowed:
        return HalfStorage(small, True, cost, f"half precision adds {cost:.3f} to ΔE94 p99")
    return HalfStorage(packs, False, cost, f"kept single: half would add {cost:.3f} to ΔE94 p99, over {allowed:g}")


def single_storage(packs: tuple[FactorPack, ...]) -> HalfStorage:
    """Return the packs as they are, because nothing else was asked for."""
    return HalfStorage(packs, False, None, "kept single: half precision was not tried")
