"""The ways in which a fit splits a BRDF into packs, and the search for as few terms as the budget allows.

- Lobe by lobe: each of the BRDF's own lobes as a table in its own frame, with the other lobes exact.
- Jointly: all packs at once on what is seen (`joint`), and, while the budget is not met, four more terms at a time in
  the frame in which they leave less of what the others have left, or four in either where the budget is far. That is
  how a BRDF that names no lobes gets split.
- On finer grids, where terms alone do not help: factors of twice as many nodes, which begin as what they were.
- Everything in one frame from the start, where the BRDF's own lobes needed many terms.

A candidate is dropped as soon as it can no longer win.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..axes import Axis, Frame
from ..brdf import Brdf, Lobe
from ..factors import FactorPack
from .bounds import Bounds, Broken
from .decompose import PACK
from .grids import lobe_axes
from .joint import added, axes_in_sight, finer, held, in_sight, merged, refined
from .judging import Judge, Judged, Trial
from .lobe_table import LobeTable, Method
from .seen import SeenSamples, seen_samples
from .within import within_bounds

# Terms up to which tables are tried where packs are refined jointly afterwards: two packs of four.
TABLE_TERMS = 8
# Packs of more terms than these were split between the frames long since: another start would not save terms.
RIVALLED = 16
# A table the first number of times over the budget may be within it once it is refined; beyond the second it is far.
_NEAR, _FAR = 2.5, 6.0
# Pairs drawn for each pixel of the protocol's square, and the fewest; some two thirds are above the horizon. Azimuths
# need more.
_PAIRS_A_PIXEL, _FEWEST_PAIRS, _AZIMUTHS = 3.5, 12_000, 1.7
# New terms begin on every so many samples.
_THINNED = 2
# Rounds of refinement at most; each must gain the second share. Tables are refined again where it paid by the third.
_ROUNDS, _LEAST_GAIN, _WORTH = 2, 0.03, 0.98
# Factors by which light from behind may come to count more, at once and in all.
_MORE, _MOST = 3.0, 9.0
# Nodes that an axis may come to have, and the share of the distance that finer grids must get below.
_MOST_NODES, _PAYS = 192, 0.9
# Rounds and sweeps that bring packs back within their bounds; what leaving them by 0.02 at one guard costs, as a share
# of what all errors do.
_BOUNDING, _BOUNDING_SWEEPS, _GUARD = 9, 3, 1e-3
# Spectra alone are tried where packs are beyond their bounds by less than this many times them, and every so many
# rounds; they may cost this many times what all errors did.
_NEARLY_WITHIN, _TRIED, _DEAR = 1.15, 3, 1.1
# From the second of such rounds on, guards that stand count so many times as much as in the round before.
_FIRMER = 2.0
# Guards that stand all over the hemispheres from the beginning, and the squared ΔE94 a sample that their cost supposes.
_GUARDS, _EXPECTED = 3000, 0.1
# Rounds of refinement once no more terms are added, at most; each must gain the second share.
LAST_ROUNDS, _LAST_GAIN = 4, 0.02
# Sweeps of new terms alone.
_FIRST_SWEEPS = 8
# So many times over the budget, terms are added in both frames at once.
_BOTH = 5.0
# Growth ends where this many steps together gained less than that share for each of their terms.
_STEPS, _TERM_GAIN = 2, 0.01


@dataclass(frozen=True)
class Wanted:
    """What was asked of the fit."""

    budget: float
    seed: int
    ranks: tuple[int, ...]
    method: Method
    smooth: bool
    axes: tuple[Axis, ...] | None
    frames: tuple[Frame, ...]


@dataclass(frozen=True, eq=False)
class Found:
    """A candidate's packs. `stopped`: why no more terms were tried. `times`: what light from behind counts."""

    candidate: str
    packs: tuple[FactorPack, ...]
    judged: Judged
    relative: float
    stopped: str
    times: float = 1.0
    within: bool = False

    @property
    def rank(self) -> int:
        return sum(pack.rank for pack in self.packs)

    def met(self, budget: float) -> bool:
        """Whether the packs are within the budget and within their bounds."""
        return self.within and self.judged.score <= budget

    def better_than(self, other: Found, budget: float) -> bool:
        """Fewest terms within the budget; else the smaller distance."""
        if self.within != other.within:
            return self.within
        ours, theirs = self.met(budget), other.met(budget)
        if ours and theirs:
            return (self.rank, self.judged.score) < (other.rank, other.judged.score)
        return ours or (not theirs and self.judged.distance < other.judged.distance)


class Search:
    """One fit: the judge, what was asked, and samples that are drawn when they are first needed."""

    def __init__(self, brdf: Brdf, judge: Judge, wanted: Wanted) -> None:
        self.brdf, self.judge, self.wanted = brdf, judge, wanted
        self.bounds = Bounds.of(brdf)

    @cached_property
    def samples(self) -> SeenSamples:
        """Drawn when first needed, beside those that keep packs within their bounds."""
        pairs = max(_PAIRS_A_PIXEL * self.judge.pixels**2, _FEWEST_PAIRS) * (1.0 if self.brdf.isotropic else _AZIMUTHS)
        found = seen_samples(self.brdf, int(pairs), self.wanted.seed)
        wi, wo = self.bounds.everywhere(_GUARDS)
        return found.guarded(wi, wo, self.bounds.limits, _GUARD * _EXPECTED * float(np.sum(found.share)))

    def lobewise(self, lobes: tuple[Lobe, ...]) -> Found:
        """Each lobe by itself; then, with method "joint", all of them together."""
        wanted = self.wanted
        found = [self._lobe(number, lobe, lobes) for number, lobe in enumerate(lobes)]
        # A lobe without light adds nothing, unless it is all there is.
        packs = tuple(pack for pack, _ in found if np.any(pack.spectral)) or (found[0][0],)
        relative = max(relative for _, relative in found)
        judged = self.judge.judged(packs, None, relative)
        # Black is within all bounds.
        here = Found("lobes", packs, judged, relative, "", within=not any(np.any(pack.spectral) for pack in packs))
        if wanted.method != "joint" or not np.any(packs[0].spectral):
            return self._ended(here)
        if judged.score <= wanted.budget:
            here = self._bounded(here)
            if here.met(wanted.budget):
                return self._ended(here)
        if len(lobes) > 1:
            here = self._refined(here)
        return self._grown(here)

    def whole(self, frame: Frame, rival: Found) -> Found:
        """Everything in one frame from the start, followed for as long as it may be better than `rival`."""
        pack, _ = added((), self.samples, frame, self._axes(frame, rival.packs), PACK, self.wanted.seed)
        judged = self.judge.judged((pack,))
        here = self._refined(Found(frame, (pack,), judged, 1.0, ""))
        return self._grown(here, rival)

    def _lobe(self, number: int, lobe: Lobe, lobes: tuple[Lobe, ...]) -> tuple[FactorPack, float]:
        """The pack of fewest terms within the lobe's share of the budget, else the best; and its table's residual."""
        wanted, judge = self.wanted, self.judge
        alone = len(lobes) == 1
        share = wanted.budget / np.sqrt(len(lobes))
        others = None if alone else judge.others(lobe.brdf)
        judge.doing(f"tabulating in {lobe.frame}" if alone else f"tabulating lobe {number + 1} of {len(lobes)}")
        table = LobeTable.of(lobe, judge.front.weights(lobe.brdf.wavelengths_nm), wanted.axes)
        best_score, stalled, worth = np.inf, 0, True
        best = table.pack(1, wanted.seed, "weighted") if table.black else None
        if best is not None:
            return best
        ranks = list(self._table_ranks)
        while ranks:
            rank = ranks.pop(0)
            judge.doing(f"{rank} terms in {lobe.frame}")
            pack, relative = table.pack(rank, wanted.seed, wanted.method, wanted.smooth)
            judged = judge.judged((pack,), others, relative)
            kept = judged.score < best_score
            self._tell(number, lobe.frame, rank, judged, kept, "lobes", False)
            near = (worth and judged.score <= _NEAR * share) or not ranks
            if wanted.method == "joint" and alone and judged.score > share and near:
                joint = self._refined(Found("lobes", (pack,), judged, relative, ""))
                # Where it gains nothing, as on tables that are fitted well already, it is left for the last rank.
                worth = joint.judged.distance < _WORTH * judged.distance
                (pack,), judged, relative = joint.packs, joint.judged, joint.relative
            stalled = 0 if judged.score < 0.9 * best_score else stalled + 1
            if best is None or judged.score < best_score:
                best_score, best = judged.score, (pack, relative)
            # Near the budget, what is left after three vain attempts is the grid's error, which terms cannot mend.
            if best_score <= share or (stalled >= 3 and best_score < 3.0 * share):
                break
            # Far from the budget a few more terms are not enough: whatever joint refinement begins with will do.
            if wanted.method == "joint" and rank >= 2 and best_score > _FAR * share:
                ranks = ranks[-1:]
        assert best is not None
        return best

    @property
    def _table_ranks(self) -> tuple[int, ...]:
        if self.wanted.method != "joint":
            return self.wanted.ranks
        return tuple(rank for rank in self.wanted.ranks if rank <= TABLE_TERMS) or self.wanted.ranks[:1]

    def _refined(self, here: Found) -> Found:
        """All packs together, for as long as the measured score improves."""
        best = here
        for _ in range(_ROUNDS):
            before = best.judged.score
            here = self._round(here, here.packs)
            kept = self._told(here, before)
            best = here if kept else best
            gained = here.judged.distance <= (1.0 - _LEAST_GAIN) * before
            if best.judged.score <= self.wanted.budget or not (gained or (here.judged.behind and here.times < _MOST)):
                break
        return best

    def _round(self, here: Found, packs: tuple[FactorPack, ...]) -> Found:
        """Some sweeps over `packs`. While light from behind decides, it counts more and more."""
        self.judge.doing(f"{sum(pack.rank for pack in packs)} terms in {_frames(packs)}")
        times = min(_MORE * here.times, _MOST) if here.judged.behind else max(here.times / _MORE, 1.0)
        samples = self.samples if times == 1.0 else self.samples.stressed(np.where(self.samples.behind, times, 1.0))
        packs, relative = refined(packs, samples)
        return Found(here.candidate, packs, self.judge.judged(packs, None, relative), relative, "", times)

    def _watched(self, here: Found) -> Found:
        """The same packs, with guards from now on wherever they leave their bounds."""
        broken = self.bounds.broken(here.packs)
        if len(broken):
            self._guard(broken, here.packs, 1.0)
        return replace(here, within=not len(broken))

    def _bounded(self, here: Found) -> Found:
        """The same terms with guards wherever they leave the bounds, until they leave them nowhere.

        What is left is mended by spectra alone as soon as that costs little.
        """
        packs, within = here.packs, True
        for number in range(_BOUNDING):
            broken = self.bounds.broken(packs)
            if not len(broken):
                break
            self.judge.doing(f"{here.rank} terms: {len(broken)} places are still out of the bounds of shading")
            if broken.worst <= _NEARLY_WITHIN or number % _TRIED == _TRIED - 1:
                mended, done = within_bounds(packs, self.samples, self.bounds, broken)
                dear = self.samples.cost(mended) > _DEAR * self.samples.cost(packs)
                if done and (not dear or number == _BOUNDING - 1):
                    packs = mended
                    break
            self._guard(broken, packs, _FIRMER if number else 1.0)
            packs = held(packs, self.samples, _BOUNDING_SWEEPS)
        else:
            within = self.bounds.extremes(packs).within
        if packs is here.packs:
            return replace(here, within=within)
        return replace(here, packs=packs, judged=self.judge.judged(packs, None, here.relative), within=within)

    def _guard(self, broken: Broken, packs: tuple[FactorPack, ...], firmer: float) -> None:
        """One guard more wherever packs leave their bounds; all that stand already count so many times as much."""
        stand = replace(self.samples, guards=firmer * self.samples.guards)
        cost = _GUARD * self.samples.cost(packs)
        self.samples = stand.guarded(broken.wi, broken.wo, self.bounds.limits, cost)

    def _told(self, found: Found, before: float) -> bool:
        kept = found.judged.distance < before
        self._tell(0, _frames(found.packs), found.rank, found.judged, kept, found.candidate, True)
        return kept

    def _grown(self, here: Found, rival: Found | None = None) -> Found:
        """More terms, four at a time or, far from the budget, in either frame, all packs refined after each step."""
        wanted = self.wanted
        best = here = self._on_finer_grids(self._in_sight(here))
        left, safe = [(here.rank, here.judged.headway)], None
        while not best.met(wanted.budget) and here.rank + PACK <= wanted.ranks[-1]:
            if rival is not None and not self._may_win(here, rival):
                break
            self.judge.doing(f"{here.rank} terms in {_frames(here.packs)}: looking for more")
            thin = self.samples.thinned(_THINNED)
            tried = [
                added(here.packs, thin, frame, self._axes(frame, here.packs), PACK, wanted.seed, _FIRST_SWEEPS)
                for frame in wanted.frames
            ]
            best_first = [pack for pack, _ in sorted(tried, key=lambda one: one[1])]
            far = here.judged.score > _BOTH * wanted.budget and here.rank + 2 * PACK <= wanted.ranks[-1]
            here = self._round(here, merged((*here.packs, *best_first[: 2 if far else 1])))
            here = self._bounded(here) if here.judged.score <= wanted.budget else self._watched(here)
            best = here if self._told(here, best.judged.distance) else best
            if here.within and (safe is None or here.better_than(safe, wanted.budget)):
                safe = here
            left.append((here.rank, min(left[-1][1], here.judged.headway)))
            stalled = len(left) > _STEPS and _slow(left[-1 - _STEPS], left[-1])
            if stalled:
                here = self._on_finer_grids(best)
                if here is best:
                    break
                best, left = here, [(here.rank, here.judged.headway)]
        last = self._polished(best)
        # Bringing packs back within their bounds may cost more than it is worth.
        return self._ended(safe if safe is not None and safe.better_than(last, wanted.budget) else last)

    def _in_sight(self, here: Found) -> Found:
        """The same terms on grids that end where lights of pictures do: beyond, nothing would hold their factors."""
        packs = tuple(in_sight(pack) for pack in here.packs)
        if self.wanted.axes is not None or all(new is old for new, old in zip(packs, here.packs, strict=True)):
            return here
        found = self._round(here, packs)
        self._told(found, here.judged.distance)
        return found

    def _polished(self, here: Found) -> Found:
        """The last rounds, until the packs keep within their bounds."""
        if here.met(self.wanted.budget):
            return here
        for _ in range(LAST_ROUNDS):
            before, here = here, self._better(self._round(here, here.packs), here)
            if here.judged.front > (1.0 - _LAST_GAIN) * before.judged.front:
                break
        return self._bounded(here)

    def _better(self, found: Found, before: Found) -> Found:
        return found if self._told(found, before.judged.distance) else before

    def _on_finer_grids(self, here: Found) -> Found:
        """The same terms with twice as many nodes an axis, for as long as that pays."""
        best = here
        while best.judged.score > self.wanted.budget and self.wanted.axes is None:
            packs = tuple(finer(pack, _MOST_NODES) for pack in best.packs)
            if all(pack.axes == before.axes for pack, before in zip(packs, best.packs, strict=True)):
                break
            here = self._round(best, packs)
            if not self._told(here, _PAYS * best.judged.distance):
                break
            best = here
        return best

    def _may_win(self, here: Found, rival: Found) -> bool:
        """Fewer terms than the rival's, or a better score than its candidate had with as few."""
        wanted = self.wanted
        if rival.judged.score <= wanted.budget and here.rank + PACK >= rival.rank:
            return False
        known = [
            trial.score
            for trial in self.judge.trials
            if trial.candidate == rival.candidate and trial.joint and trial.rank <= here.rank
        ]
        return not known or here.judged.score < min(known)

    def _ended(self, found: Found) -> Found:
        if found.judged.score <= self.wanted.budget:
            why = "budget met"
        elif found.rank + PACK > self.wanted.ranks[-1]:
            why = "none left to try"
        else:
            why = "more terms stopped paying"
        return replace(found, stopped=why)

    def _axes(self, frame: Frame, packs: tuple[FactorPack, ...]) -> tuple[Axis, ...]:
        """The grid that the material has in this frame already, else one made for it."""
        for pack in packs:
            if pack.frame == frame and pack.anisotropic != self.brdf.isotropic:
                return pack.axes
        if self.wanted.axes is not None and self.wanted.axes[0].name.endswith(("_i",) if frame == "io" else ("_h",)):
            return self.wanted.axes
        observed = self.judge.front.weights(self.brdf.wavelengths_nm)
        return axes_in_sight(frame, lobe_axes(self.brdf, frame, np.pi * observed[:, 1]))

    def _tell(self, lobe: int, frame: str, rank: int, judged: Judged, kept: bool, candidate: str, joint: bool) -> None:
        trial = Trial(lobe, frame, rank, self.judge.seconds, judged.error, judged.score, kept, candidate, joint)
        self.judge.tell(trial)


def _slow(before: tuple[int, float], now: tuple[int, float]) -> bool:
    """Whether terms between two states (terms, score) gained too little."""
    return now[1] > (1.0 - _TERM_GAIN * (now[0] - before[0])) * before[1]


def _frames(packs: tuple[FactorPack, ...]) -> str:
    return " + ".join(dict.fromkeys(pack.frame for pack in packs))
