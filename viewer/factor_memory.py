"""What fitting takes: seconds, and bytes without those of evaluating the BRDF, which judging it needs as well."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ..materials.brdf import Brdf, Lobe
from ..materials.factors import FactorPack
from ..materials.protocol import sphere_protocol

T = TypeVar("T")

# Energy of the spectra that coefficients may leave out, as in a fit.
_LOST = 1e-8
_PILOT = 1500


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
        return self.brdf.wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
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
        """The lobes of the BRDF within, watched."""
        return tuple(replace(lobe, brdf=WatchedBrdf(lobe.brdf, self.scales)) for lobe in self.brdf.lobes())


def timed_and_weighed(brdf: Brdf, work: Callable[[Brdf], T]) -> tuple[T, float, int]:
    """What `work` makes of the BRDF, its seconds, and the most bytes that it held at one time, evaluations apart.

    Two runs, since counting bytes takes time; what the first one cached is not counted again.
    """
    start = time.perf_counter()
    found = work(brdf)
    seconds = time.perf_counter() - start
    scales = Scales()
    tracemalloc.start()
    try:
        work(WatchedBrdf(brdf, scales))
        scales.read()
    finally:
        tracemalloc.stop()
    return found, seconds, scales.most


def table_bytes(brdf: Brdf, packs: tuple[FactorPack, ...]) -> int:
    """float64 bytes of the tables that the packs stand for: their nodes, times the coefficients that spectra need."""
    lobes = {lobe.frame: lobe.brdf for lobe in brdf.lobes()}
    return sum(
        8 * int(np.prod([axis.size for axis in pack.axes])) * spectral_size(lobes.get(pack.frame, brdf))
        for pack in packs
    )


def spectral_size(brdf: Brdf) -> int:
    """How many coefficients hold the spectra of a BRDF: all but 1e-8 of their energy, at least 1."""
    protocol = sphere_protocol(64, brdf.isotropic)
    rows = slice(None, None, max(1, len(protocol.wi) // _PILOT))
    spectra = brdf.eval(protocol.wi[rows], protocol.wo[rows]) * protocol.wi[rows, 2:]
    energy = np.cumsum(np.linalg.svd(spectra, compute_uv=False)[::-1] ** 2)[::-1]
    return max(1, int(np.sum(energy > _LOST * energy[0])))
