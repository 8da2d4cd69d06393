"""Half-precision storage of factor packs: half the memory, and its measured cost in colour.

Each column of a factor is divided by its largest magnitude before it is rounded, so that a highlight of any height fits
into 16 bits; the divisor goes into the term's spectrum, which is not rounded.
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
    """Packs to store, their precision, and the reason for it.

    cost : ΔE94 that half precision adds to the 99th percentile; None if it was not measured.
    reason : for messages.
    """

    packs: tuple[FactorPack, ...]
    half: bool
    cost: float | None
    reason: str


def rounded_to_half(pack: FactorPack) -> FactorPack:
    """Round factors to 16 bits, each column's largest magnitude scaled to 1; the pack is the same up to rounding."""
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
    """Choose half precision if it adds at most `allowed` to the 99th percentile of ΔE94, else the packs as they are.

    p99 : measures it for packs against their reference.
    """
    small = tuple(rounded_to_half(pack) for pack in packs)
    cost = p99(small) - p99(packs)
    if cost <= allowed:
        return HalfStorage(small, True, cost, f"half precision adds {cost:.3f} to ΔE94 p99")
    return HalfStorage(packs, False, cost, f"kept single: half would add {cost:.3f} to ΔE94 p99, over {allowed:g}")


def single_storage(packs: tuple[FactorPack, ...]) -> HalfStorage:
    """Return the packs as they are, since single precision was requested."""
    return HalfStorage(packs, False, None, "kept single: half precision was not tried")
