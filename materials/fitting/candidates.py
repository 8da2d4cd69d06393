"""Settings of a fit, and candidate packs."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.axes import Axis, Frame
from ..factored.pack import FactorPack
from .candidate_scoring import Judgement
from .lobe_table import Method


@dataclass(frozen=True)
class FitSettings:
    """Settings of a fit; see `fit`.

    frames : in which terms may be added.
    """

    budget: float
    seed: int
    ranks: tuple[int, ...]
    method: Method
    smooth: bool
    axes: tuple[Axis, ...] | None
    frames: tuple[Frame, ...]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Packs that may stand for the BRDF, and what is known of them.

    name : where they began: "lobes", or a frame (`Trial.candidate`).
    relative_error : of the table, or of the joint refinement, that they come from.
    stopped : why no more terms were tried; "" while there may be more.
    back_weight : how many times as much errors under light from behind counted when they were last refined.
    within : whether they keep within their bounds, as far as is known.
    """

    name: str
    packs: tuple[FactorPack, ...]
    judgement: Judgement
    relative_error: float
    stopped: str
    back_weight: float = 1.0
    within: bool = False

    @property
    def rank(self) -> int:
        """Terms of all packs."""
        return sum(pack.rank for pack in self.packs)

    @property
    def frames(self) -> str:
        """The packs' frames, for people: "hd + io"."""
        return " + ".join(dict.fromkeys(pack.frame for pack in self.packs))

    def meets(self, budget: float) -> bool:
        """Return whether the packs are within the budget and within their bounds."""
        return self.within and self.judgement.score <= budget

    def better_than(self, other: Candidate, budget: float) -> bool:
        """Fewest terms within the budget; else the smaller distance."""
        if self.within != other.within:
            return self.within
        ours, theirs = self.meets(budget), other.meets(budget)
        if ours and theirs:
            return (self.rank, self.judgement.score) < (other.rank, other.judgement.score)
        return ours or (not theirs and self.judgement.distance < other.judgement.distance)
