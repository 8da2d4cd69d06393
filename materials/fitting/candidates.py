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

    frames : allowed frames of added terms.
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
    """Packs that may approximate the BRDF, and their state.

    name : how they began: "lobes", or a frame (`Trial.candidate`).
    relative_error : of the table, or of the joint refinement, that they come from.
    stopped : reason why no more terms are tried; "" while there may be more.
    back_weight : factor on errors under light from behind in the last refinement.
    within : True if they are known to keep within their bounds.
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
        """Frames of the packs, in words: "hd + io"."""
        return " + ".join(dict.fromkeys(pack.frame for pack in self.packs))

    def meets(self, budget: float) -> bool:
        """Return whether the packs are within the budget and within their bounds."""
        return self.within and self.judgement.score <= budget

    def better_than(self, other: Candidate, budget: float) -> bool:
        """Compare by bounds, then by the budget, then by terms within it or by distance beyond it."""
        if self.within != other.within:
            return self.within
        ours, theirs = self.meets(budget), other.meets(budget)
        if ours and theirs:
            return (self.rank, self.judgement.score) < (other.rank, other.judgement.score)
        return ours or (not theirs and self.judgement.distance < other.judgement.distance)
