"""Cost of fits: seconds, and bytes without those of evaluating the BRDF, which judging it needs as well."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ...materials.core.brdf import Brdf, Lobe
from ...materials.core.protocol import sphere_protocol
from ...materials.fitting.fit import Fit
from ...materials.fitting.lobe_table import LobeTable
from ..timing import timed

T = TypeVar("T")

_PIXELS = 128


class Scales:
    """The most bytes held at one time, evaluations apart."""

    def __init__(self) -> None:
        self.most = 0

    def read(self) -> None:
        """Count what was held at most since the last `reset`."""
        self.most = max(self.most, tracemalloc.get_traced_memory()[1])

    def reset(self) -> None:
        """Forget what is over."""
        tracemalloc.reset_peak()


@dataclass(frozen=True, eq=False)
class WatchedBrdf(Brdf):
    """A BRDF, or a lobe of one, whose own evaluations do not count on the scales."""

    brdf: Brdf
    scales: Scales

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Wavelengths of what is watched."""
        return self.brdf.wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Isotropy of what is watched."""
        return self.brdf.isotropic

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """f_r of the BRDF within."""
        self.scales.read()
        found = self.brdf.eval(wi, wo)
        self.scales.reset()
        return found

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the lobes of the BRDF within, watched."""
        return tuple(replace(lobe, brdf=WatchedBrdf(lobe.brdf, self.scales)) for lobe in self.brdf.lobes())


def timed_and_weighed(brdf: Brdf, work: Callable[[Brdf], T]) -> tuple[T, float, T, int]:
    """Return what `work` makes of the BRDF, its seconds, what it makes of it while its bytes are counted, and the most
    held at one time, evaluations apart.

    Two runs, since counting bytes takes time; what the first one cached is not counted again.
    """
    found, seconds = timed(lambda: work(brdf))
    scales = Scales()
    tracemalloc.start()
    try:
        again = work(WatchedBrdf(brdf, scales))
        scales.read()
    finally:
        tracemalloc.stop()
    return found, seconds, again, scales.most


def table_bytes(brdf: Brdf, found: Fit) -> int:
    """float64 bytes of the tables that the packs were found from: made again, as the fit makes them, and measured."""
    own = {lobe.frame: lobe for lobe in brdf.lobes()} if found.candidate == "lobes" else {}
    observed = sphere_protocol(_PIXELS, brdf.isotropic).weights(brdf.wavelengths_nm)
    total = 0
    for pack in found.fast.packs:
        table = LobeTable.of(own.get(pack.frame, Lobe(pack.frame, brdf)), observed, pack.axes)
        total += table.values.nbytes
    return total
