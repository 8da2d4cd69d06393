"""Splits of a BRDF into packs, and the search for as few terms as the budget allows.

- Lobe by lobe: each of the BRDF's own lobes as a table in its own frame, with the other lobes exact; then all packs
  jointly on visible samples (`refinement`), and more terms while the budget is not met (`term_growth`).
- Everything in one frame from the start, if the BRDF's own lobes needed many terms.

A candidate is dropped as soon as it can no longer win.
"""

from __future__ import annotations

import numpy as np

from ..core.axes import Frame
from ..core.brdf import Brdf, Lobe
from ..factored.pack import FactorPack
from .candidate_scoring import Judge
from .candidates import Candidate, FitSettings
from .lobe_table import LobeTable
from .refinement import Refinement
from .term_growth import Growth

# Terms up to which tables are tried where packs are refined jointly afterwards: two packs of four.
TABLE_TERMS = 8
# Packs of more terms than these were split between the frames long since: another start would not save terms.
RIVALLED = 16
# A table this many times over the budget may be within it once it is refined.
_NEAR_BUDGET = 2.5
# A table more times over the budget than this is far: a few more terms are not enough.
_FAR_FROM_BUDGET = 6.0
# Share of its distance that refinement has to bring the first table below, for others to be refined.
_REFINEMENT_PAYS = 0.98
# Share of the best score that more terms have to come below as an improvement.
_IMPROVED = 0.9
# Ranks without an improvement after which more terms do not help.
_VAIN_RANKS = 3
# Multiple of the budget that the best score has to be below for that: what is left is the grid's error.
_VAIN_NEAR_BUDGET = 3.0


class Search:
    """One fit: its splits of the BRDF, with one refinement and one judge."""

    def __init__(self, brdf: Brdf, judge: Judge, settings: FitSettings) -> None:
        self.judge, self.settings = judge, settings
        self.refinement = Refinement(brdf, judge, settings)
        self.growth = Growth(self.refinement)

    def lobewise(self, lobes: tuple[Lobe, ...]) -> Candidate:
        """Fit each lobe by itself; then, with method "joint", refine all of them together."""
        settings = self.settings
        found = [self._lobe(number, lobe, lobes) for number, lobe in enumerate(lobes)]
        # A lobe without light adds nothing, unless it is all there is.
        packs = tuple(pack for pack, _ in found if np.any(pack.spectra)) or (found[0][0],)
        relative = max(relative for _, relative in found)
        judgement = self.judge.judge_packs(packs, None, relative)
        # Black is within all bounds.
        black = not any(np.any(pack.spectra) for pack in packs)
        candidate = Candidate("lobes", packs, judgement, relative, "", within=black)
        if settings.method != "joint" or not np.any(packs[0].spectra):
            return self.growth.ended(candidate)
        if judgement.score <= settings.budget:
            candidate = self.refinement.bring_within(candidate)
            if candidate.meets(settings.budget):
                return self.growth.ended(candidate)
        if len(lobes) > 1:
            candidate = self.refinement.refine(candidate)
        return self.growth.grow(candidate)

    def whole(self, frame: Frame, rival: Candidate) -> Candidate:
        """Fit everything in one frame from the start, as long as it may be better than `rival`."""
        packs = (self.growth.first_terms(frame, rival),)
        candidate = Candidate(frame, packs, self.judge.judge_packs(packs), 1.0, "")
        return self.growth.grow(self.refinement.refine(candidate), rival)

    def _lobe(self, number: int, lobe: Lobe, lobes: tuple[Lobe, ...]) -> tuple[FactorPack, float]:
        """Return the pack of fewest terms within the lobe's budget, else the best; with its table's residual."""
        settings, judge = self.settings, self.judge
        alone, joint = len(lobes) == 1, settings.method == "joint"
        share = settings.budget / np.sqrt(len(lobes))
        others = None if alone else judge.others(lobe.brdf)
        judge.doing(f"tabulating in {lobe.frame}" if alone else f"tabulating lobe {number + 1} of {len(lobes)}")
        table = LobeTable.shared(lobe, judge.front.weights(lobe.brdf.wavelengths_nm), settings.axes)
        if table.black:
            return table.pack(1, settings.seed, "weighted")
        best, best_score, vain, refinement_pays = None, np.inf, 0, True
        ranks = list(self._table_ranks)
        while ranks:
            rank = ranks.pop(0)
            judge.doing(f"{rank} terms in {lobe.frame}")
            pack, relative = table.pack(rank, settings.seed, settings.method, settings.smooth)
            judgement = judge.judge_packs((pack,), others, relative)
            kept = judgement.score < best_score
            judge.record(number, lobe.frame, rank, judgement, kept, "lobes", joint=False)
            near = (refinement_pays and judgement.score <= _NEAR_BUDGET * share) or not ranks
            if joint and alone and judgement.score > share and near:
                refined = self.refinement.refine(Candidate("lobes", (pack,), judgement, relative, ""))
                # If it gains nothing, as on tables that are fitted well already, it is left for the last rank.
                refinement_pays = refined.judgement.distance < _REFINEMENT_PAYS * judgement.distance
                (pack,), judgement, relative = refined.packs, refined.judgement, refined.relative_error
            vain = 0 if judgement.score < _IMPROVED * best_score else vain + 1
            if best is None or judgement.score < best_score:
                best_score, best = judgement.score, (pack, relative)
            # Near the budget, what is left after some vain attempts is the grid's error, which terms cannot mend.
            if best_score <= share or (vain >= _VAIN_RANKS and best_score < _VAIN_NEAR_BUDGET * share):
                break
            # Far from the budget a few more terms are not enough: whatever joint refinement begins with will do.
            if joint and rank >= 2 and best_score > _FAR_FROM_BUDGET * share:
                ranks = ranks[-1:]
        assert best is not None
        return best

    @property
    def _table_ranks(self) -> tuple[int, ...]:
        """Numbers of terms to try for a lobe's table."""
        if self.settings.method != "joint":
            return self.settings.ranks
        return tuple(rank for rank in self.settings.ranks if rank <= TABLE_TERMS) or self.settings.ranks[:1]
