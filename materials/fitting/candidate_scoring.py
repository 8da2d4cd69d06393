"""Scores of candidates: error on the sphere protocol, front and back, in terms of one budget."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ..core.brdf import Brdf, Lobe
from ..core.fit_error import FitError
from ..core.highlight import highlight_protocol
from ..core.protocol import BACK_LIGHT_ANGLES_DEG, LIGHT_ANGLES_DEG, LIGHTS, sphere_protocol
from ..factored.pack import FactoredBrdf, FactorPack

# The mean may be this share of the budget, which is for the 99th percentile.
MEAN_SHARE = 0.3
# Lit from behind, where the protocol does not look, the 99th percentile may be this many times the budget.
BACK_SHARE = 4.0
# The highlight's own pixels are its steepest flanks: their 99th percentile may be this many times the budget.
HIGHLIGHT_SHARE = 4.0
# XYZ (lights, N, 3) of the samples of each view: front, back and, where there is one, the highlight.
ViewsXyz = tuple[Float[np.ndarray, "_ _ 3"], ...]


@dataclass(frozen=True)
class Trial:
    """One attempt of a fit; `kept`: the best of its candidate so far.

    lobe : index of the lobe of its table, with the other lobes exact; 0 for all packs together (`joint`).
    frame : of the lobe, or "io + hd". rank : number of terms. seconds : since the fit began.
    score : compared with the budget: p99, the mean over 0.3, p99 of the highlight's own pixels over 4, or p99 lit from
        behind over 4, whichever is worst under any light of the protocol.
    candidate : "lobes" (the BRDF's own), "io", "hd": everything in one frame; terms added later may be in either.
    joint : True if all packs were refined jointly on visible samples.
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
class Judgement:
    """Measured error of some packs; back: the worst 99th percentile of ΔE94 lit from behind, under any light."""

    error: FitError
    back: float

    @property
    def front(self) -> float:
        """Worst of p99, and of the mean and p99 of the highlight over their shares, under any light."""
        shares = (max(one.p99, one.mean / MEAN_SHARE) for one in self.error.lights)
        return max(*shares, (self.error.highlight or 0.0) / HIGHLIGHT_SHARE)

    @property
    def score(self) -> float:
        """Score that is compared with the budget, in ΔE94."""
        return max(self.front, self.back / BACK_SHARE)

    @property
    def distance(self) -> float:
        """Sum of front and back, which attempts are compared by, so that neither improves at the other's expense."""
        return self.front + self.back / BACK_SHARE

    @property
    def headway(self) -> float:
        """Progress measure of growth: a constant error in the highlight does not hide gains in the picture."""
        return self.front + self.error.p99

    @property
    def back_decides(self) -> bool:
        """True if the score is that of light from behind."""
        return self.back / BACK_SHARE == self.score


@dataclass(eq=False)
class Judge:
    """The original on the protocol under all its lights, as the reference of packs.

    pixels : of the sphere protocol. tried : called with every trial. doing : called with a description of the current
    work.
    begun : start of the fit, seconds. trials : all recorded ones, in order.

    Raises
    ------
    InputError : the BRDF is not finite somewhere on the sphere.
    """

    brdf: Brdf
    lobes: tuple[Lobe, ...]
    pixels: int
    tried: Callable[[Trial], None]
    doing: Callable[[str], None] = lambda phase: None
    begun: float = field(default_factory=time.perf_counter)
    trials: list[Trial] = field(default_factory=list)

    def __post_init__(self) -> None:
        isotropic = all(lobe.brdf.isotropic for lobe in self.lobes)
        self.front, self.back = (
            sphere_protocol(self.pixels, isotropic, angles) for angles in (LIGHT_ANGLES_DEG, BACK_LIGHT_ANGLES_DEG)
        )
        self.highlight = highlight_protocol(self.brdf)
        self.views = tuple(view for view in (self.front, self.back, self.highlight) if view is not None)
        self.references = tuple(view.references(self.brdf, LIGHTS) for view in self.views)
        if not all(np.all(np.isfinite(xyz)) for xyz in self.references):
            raise InputError(
                "the BRDF is not finite", field="brdf", found="NaN or infinity on the sphere", expected="numbers"
            )

    def others(self, lobe: Brdf) -> ViewsXyz:
        """Compute XYZ of the original without this lobe, in each view."""
        return tuple(
            whole - view.references(lobe, LIGHTS) for view, whole in zip(self.views, self.references, strict=True)
        )

    def judge_packs(
        self, packs: tuple[FactorPack, ...], others: ViewsXyz | None = None, relative: float = 0.0
    ) -> Judgement:
        """Measure the error of packs.

        others : XYZ of exact lobes beside the packs. relative : relative error of the packs' table, copied into the
        judgement.
        """
        seen = [view.samples(FactoredBrdf(packs), LIGHTS) for view in self.views]
        if others is not None:
            seen = [xyz + beside for xyz, beside in zip(seen, others, strict=True)]
        return Judgement(replace(self._error(seen), relative_error=relative), self._back(seen[1]))

    def _error(self, seen: list[np.ndarray]) -> FitError:
        """Return the error from the front and in the highlight, under every light."""
        return self.front.compare_lights(self.references[0], seen[0], LIGHTS, self._highlights(seen))

    def _highlights(self, seen: list[np.ndarray]) -> list[float]:
        """Compute p99 of the highlight's own pixels under each light, the original's brightest exposed to white."""
        if self.highlight is None:
            return []
        found = []
        for light, original, ours in zip(LIGHTS, self.references[2], seen[2], strict=True):
            most = max(1.0, float(original[:, 1].max()))
            found.append(np.percentile(self.highlight.under(light).differences(original / most, ours / most), 99))
        return [float(p99) for p99 in found]

    def _back(self, seen: np.ndarray) -> float:
        """Return the worst 99th percentile lit from behind, under any light."""
        found = (
            self.back.under(light).compare(self.references[1][index], seen[index]) for index, light in enumerate(LIGHTS)
        )
        return max(one.p99 for one in found)

    def record(
        self, lobe: int, frame: str, rank: int, judgement: Judgement, kept: bool, candidate: str, *, joint: bool
    ) -> None:
        """Record a trial (see `Trial`) and pass it to `tried`."""
        trial = Trial(lobe, frame, rank, self.seconds, judgement.error, judgement.score, kept, candidate, joint)
        self.trials.append(trial)
        self.tried(trial)

    @property
    def seconds(self) -> float:
        """Time since the fit began."""
        return time.perf_counter() - self.begun
