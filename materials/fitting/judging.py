"""How candidates are judged: on the sphere protocol, front and back, against one budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from ...spectral.errors import InputError
from ..brdf import Brdf, Lobe
from ..factors import FactorPack, FitError
from ..protocol import BACK_LIGHT_ANGLES_DEG, LIGHT_ANGLES_DEG, lowest_shading, sphere_protocol
from .seen import anywhere_pairs

# The mean may be this share of the budget, which is for the 99th percentile.
MEAN_SHARE = 0.3
# Lit from behind, where the protocol does not look, the 99th percentile may be this many times the budget.
BACK_SHARE = 4.0
# Pairs off the protocol that are searched for negative light.
_ELSEWHERE = 20_000


@dataclass(frozen=True)
class Trial:
    """One thing that a fit tried; `kept`: the best so far of its candidate.

    lobe : which one its table is of, with the other lobes exact; all packs together where `joint`.
    frame : of the lobe, or "io + hd". rank : terms tried in it. seconds : since the fit began.
    score : what is held against the budget: p99, the mean over 0.3, or p99 lit from behind over 4, whichever is worst.
    candidate : "lobes" (the BRDF's own), "io", "hd": everything in one frame; terms added later may be in either.
    joint : whether all packs were refined together on what is seen.
    """

    lobe: int
    frame: str
    rank: int
    seconds: float
    error: FitError
    score: float
    kept: bool
    candidate: str = "lobes"
    joint: bool = False


@dataclass(frozen=True)
class Judged:
    """The measured error of some packs, p99 lit from behind, and what is held against the budget: the worst share."""

    error: FitError
    back: float

    @property
    def score(self) -> float:
        return max(self.error.p99, self.error.mean / MEAN_SHARE, self.back / BACK_SHARE)

    @property
    def distance(self) -> float:
        """What attempts are compared by: front and back together, so that neither is bought with much of the other."""
        return max(self.error.p99, self.error.mean / MEAN_SHARE) + self.back / BACK_SHARE

    @property
    def behind(self) -> bool:
        """Whether light from behind decides."""
        return self.back / BACK_SHARE == self.score


@dataclass(eq=False)
class Judge:
    """The original, seen on the protocol; packs are compared with it, and every comparison is told."""

    brdf: Brdf
    lobes: tuple[Lobe, ...]
    pixels: int
    tried: Callable[[Trial], None]
    begun: float = field(default_factory=time.perf_counter)
    trials: list[Trial] = field(default_factory=list)

    def __post_init__(self) -> None:
        isotropic = all(lobe.brdf.isotropic for lobe in self.lobes)
        self.front, self.back = (
            sphere_protocol(self.pixels, isotropic, angles) for angles in (LIGHT_ANGLES_DEG, BACK_LIGHT_ANGLES_DEG)
        )
        self.reference, self.behind = self.front.reference(self.brdf), self.back.reference(self.brdf)
        if not np.all(np.isfinite(self.reference)):
            raise InputError(
                "the BRDF is not finite", field="brdf", found="NaN or infinity on the sphere", expected="numbers"
            )

    def others(self, lobe: Brdf) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "M 3"]]:
        """XYZ of all but this lobe, front and back."""
        return self.reference - self.front.reference(lobe), self.behind - self.back.reference(lobe)

    def judged(
        self, packs: tuple[FactorPack, ...], others: tuple[np.ndarray, np.ndarray] | None = None, relative: float = 0.0
    ) -> Judged:
        """`others`: what shades beside the packs, exactly known."""
        seen, behind = self.front.sample(packs), self.back.sample(packs)
        if others is not None:
            seen, behind = seen + others[0], behind + others[1]
        error = self.front.compare(self.reference, seen, relative)
        back = self.back.compare(self.behind, behind)
        return Judged(error, back.p99)

    def final(self, packs: tuple[FactorPack, ...], relative: float) -> FitError:
        """The declared error: front, with the lowest shading there and all over the hemispheres."""
        wi, wo = anywhere_pairs(_ELSEWHERE, 1, self.brdf.isotropic)
        lowest = min(self.front.most_negative(packs), lowest_shading(packs, wi, wo))
        return self.front.compare(self.reference, self.front.sample(packs), relative, lowest)

    def tell(self, trial: Trial) -> None:
        """Keep the trial and pass it on."""
        self.trials.append(trial)
        self.tried(trial)

    @property
    def seconds(self) -> float:
        """Since the fit began."""
        return time.perf_counter() - self.begun
