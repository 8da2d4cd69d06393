"""Smoothed factors: fewer ripples where a lobe is given too few terms, for a little less sharpness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..factored.pack import FactorPack


def smoothed_pack(pack: FactorPack) -> FactorPack:
    """Return the pack with every factor over an angle smoothed; spectra stay; its error is unknown."""
    factors = [smoothed(factor, axis.periodic) for factor, axis in zip(pack.factors, pack.axes, strict=True)]
    return replace(pack, factors=tuple(factors))


def smoothed(factor: Float[np.ndarray, "n R"], periodic: bool = False) -> Float[np.ndarray, "n R"]:
    """Moving average four nodes wide, which trades a little sharpness for fewer ripples (Schwenk 2010, figure 4).

    Centred on the node: four whole steps, so that the outermost two of five samples count half. Held at the ends, or
    wrapped where the last node is the first again.

    >>> smoothed(np.array([[0.0], [0.0], [0.0], [8.0], [0.0], [0.0], [0.0]]))[:, 0].tolist()
    [0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0]
    """
    held = np.pad(factor[:-1], ((2, 3), (0, 0)), mode="wrap") if periodic else np.pad(factor, ((2, 2), (0, 0)), "edge")
    count = len(factor)
    taps = (0.125, 0.25, 0.25, 0.25, 0.125)
    return sum((tap * held[k : k + count] for k, tap in enumerate(taps)), np.zeros_like(factor))
