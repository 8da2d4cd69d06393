"""Growth of a candidate by more and more terms, as long as they are needed and pay.

Four terms at a time are added, in the frame in which they reduce the residual more, or as many in either if the budget
is far, and more if there are many already: this splits a BRDF that has no lobes of its own. All packs are refined
jointly after each step. If terms alone do not help, grids become finer: factors of twice as many nodes, which start as
the same functions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...spectral.palette import Palette
from ..core.axes import Axis, Frame
from ..factored.pack import FactorPack
from .axis_samples import AxisSamples
from .candidates import Candidate
from .decompose import PACK
from .grids import lobe_axes
from .joint import new_terms
from .refinement import Refinement
from .visible_pairs import FARTHEST_LIGHT

# Stride of the samples that new terms begin on.
_THINNING = 2
# Sweeps of new terms alone.
_FIRST_SWEEPS = 8
# Multiple of the budget up to which four terms at a time are added.
_NEAR_BUDGET = 1.5
# Terms from which twice as many are added at a time, and from which this holds however near the budget is: a step with
# that many terms costs far more than it adds.
_MANY, _VERY_MANY = 32, 64
# Growth is judged over this many steps together.
_STEPS = 2
# Growth ends where those steps gained less than this share for each of their terms.
_GAIN_A_TERM = 0.003
# Nodes that an axis may come to have.
_MOST_NODES = 192
# Share of the distance that finer grids must get below.
_FINER_PAYS = 0.9


class Growth:
    """Growth of the candidates of one fit by terms, which `refinement` refines."""

    def __init__(self, refinement: Refinement) -> None:
        self.refinement = refinement
        self.brdf, self.judge, self.settings = refinement.brdf, refinement.judge, refinement.settings

    def first_terms(self, frame: Frame, rival: Candidate) -> FactorPack:
        """Fit a pack of four terms to everything, in one frame, on the grid that `rival` has there."""
        axes, seed = self._axes(frame, rival.packs), self.settings.seed
        return new_terms((), self.refinement.samples(PACK), frame, axes, PACK, seed)[0]

    def grow(self, candidate: Candidate, rival: Candidate | None = None) -> Candidate:
        """Return the best candidate grown from this one by more terms and finer grids.

        rival : growth ends as soon as the candidate can no longer beat this one.
        """
        budget, most = self.settings.budget, self.settings.ranks[-1]
        best = candidate = self._within_once_met(self._on_finer_grids(self._up_to_farthest_light(candidate)))
        steps, safe = [(candidate.rank, candidate.judgement.headway)], None
        while not best.meets(budget) and candidate.rank + PACK <= most:
            if rival is not None and not self._may_win(candidate, rival):
                break
            candidate = self._with_more_terms(candidate)
            best = candidate if self.refinement.is_gain(candidate, best.judgement.distance) else best
            if candidate.within and (safe is None or candidate.better_than(safe, budget)):
                safe = candidate
            steps.append((candidate.rank, min(steps[-1][1], candidate.judgement.headway)))
            if len(steps) > _STEPS and _is_slow(steps[-1 - _STEPS], steps[-1]):
                candidate = self._on_finer_grids(best)
                if candidate is best:
                    break
                best, steps = candidate, [(candidate.rank, candidate.judgement.headway)]
        last = best if best.meets(budget) else self.refinement.bring_within(best)
        # Bringing packs back within their bounds may cost more than it is worth.
        return self.ended(safe if safe is not None and safe.better_than(last, budget) else last)

    def ended(self, candidate: Candidate) -> Candidate:
        """Return the candidate with the reason why no more terms are tried."""
        if candidate.judgement.score <= self.settings.budget:
            why = "budget met"
        elif candidate.rank + PACK > self.settings.ranks[-1]:
            why = "none left to try"
        else:
            why = "more terms stopped paying"
        return replace(candidate, stopped=why)

    def _with_more_terms(self, candidate: Candidate) -> Candidate:
        """Grow by one step: fit new terms, then refine all packs jointly."""
        settings, packs = self.settings, candidate.packs
        self.judge.doing(f"{candidate.rank} terms in {candidate.frames}: looking for more")
        more = self._more(candidate)
        samples = self.refinement.samples(candidate.rank + more).thinned(_THINNING)
        # Half in either frame, or all in the one in which they leave less.
        each = PACK if more == PACK else more // len(settings.frames)
        tried = [
            new_terms(packs, samples, frame, self._axes(frame, packs), each, settings.seed, _FIRST_SWEEPS)
            for frame in settings.frames
        ]
        best_first = [pack for pack, _ in sorted(tried, key=lambda one: one[1])]
        candidate = self.refinement.refine_once(candidate, merged((*packs, *best_first[: 1 if more == PACK else None])))
        return self._within_once_met(candidate)

    def _within_once_met(self, candidate: Candidate) -> Candidate:
        """Bring a candidate that meets the budget within its bounds."""
        if candidate.within or candidate.judgement.score > self.settings.budget:
            return candidate
        return self.refinement.bring_within(candidate)

    def _more(self, candidate: Candidate) -> int:
        """Return the number of terms to add: few near the budget, more if there are many already."""
        left = self.settings.ranks[-1] - candidate.rank
        near = candidate.judgement.score <= _NEAR_BUDGET * self.settings.budget and candidate.rank < _VERY_MANY
        wanted = PACK if near else 2 * PACK
        wanted *= 1 if candidate.rank < _MANY else 2
        while wanted > left:
            wanted //= 2
        return wanted

    def _up_to_farthest_light(self, candidate: Candidate) -> Candidate:
        """Cut grids off at the farthest light, beyond which factors would be undetermined, and refine."""
        packs = tuple(up_to_farthest_light(pack) for pack in candidate.packs)
        same = all(new is old for new, old in zip(packs, candidate.packs, strict=True))
        if self.settings.axes is not None or same:
            return candidate
        found = self.refinement.refine_once(candidate, packs)
        self.refinement.is_gain(found, candidate.judgement.distance)
        return found

    def _on_finer_grids(self, candidate: Candidate) -> Candidate:
        """Refine the same terms on grids of twice as many nodes per axis, as long as that pays."""
        best = candidate
        while best.judgement.score > self.settings.budget and self.settings.axes is None:
            packs = tuple(finer(pack, _MOST_NODES) for pack in best.packs)
            if all(pack.axes == before.axes for pack, before in zip(packs, best.packs, strict=True)):
                break
            candidate = self.refinement.refine_once(best, packs)
            if not self.refinement.is_gain(candidate, _FINER_PAYS * best.judgement.distance):
                break
            best = candidate
        return best

    def _may_win(self, candidate: Candidate, rival: Candidate) -> bool:
        """Return whether it may still have fewer terms, and scores better than the rival did with as few."""
        if rival.judgement.score <= self.settings.budget and candidate.rank + PACK >= rival.rank:
            return False
        known = [
            trial.score
            for trial in self.judge.trials
            if trial.candidate == rival.name and trial.joint and trial.rank <= candidate.rank
        ]
        return not known or candidate.judgement.score < min(known)

    def _axes(self, frame: Frame, packs: tuple[FactorPack, ...]) -> tuple[Axis, ...]:
        """Return the material's grid in this frame if it has one, else a suitable one."""
        for pack in packs:
            if pack.frame == frame and pack.anisotropic != self.brdf.isotropic:
                return pack.axes
        asked = self.settings.axes
        if asked is not None and asked[0].name.endswith(("_i",) if frame == "io" else ("_h",)):
            return asked
        observed = self.judge.front.weights(self.brdf.wavelengths_nm)
        return axes_up_to_farthest_light(frame, lobe_axes(self.brdf, frame, np.pi * observed[:, 1]))


def _is_slow(before: tuple[int, float], now: tuple[int, float]) -> bool:
    """Return whether terms between two states (terms, headway) gained too little."""
    return now[1] > (1.0 - _GAIN_A_TERM * (now[0] - before[0])) * before[1]


def finer(pack: FactorPack, most: int) -> FactorPack:
    """Resample a pack to axes with a node between any two; an axis that would have more than `most` stays."""
    axes, factors = [], []
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        if 2 * axis.size - 1 <= most:
            axis = replace(axis, size=2 * axis.size - 1)
            between = np.empty((axis.size, pack.rank))
            between[::2], between[1::2] = factor, 0.5 * (factor[1:] + factor[:-1])
            factor = between
        axes.append(axis)
        factors.append(factor)
    return replace(pack, axes=tuple(axes), factors=tuple(factors), precision="single")


def axes_up_to_farthest_light(frame: Frame, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """Cut theta_d, in frame hd, off at the farthest light of samples; factors are clamped beyond."""
    if frame != "hd" or axes[1].maximum <= 0.5 * FARTHEST_LIGHT:
        return axes
    return (axes[0], replace(axes[1], maximum=0.5 * FARTHEST_LIGHT), *axes[2:])


def up_to_farthest_light(pack: FactorPack) -> FactorPack:
    """Resample the pack to `axes_up_to_farthest_light`, the same function up to there."""
    axes = axes_up_to_farthest_light(pack.frame, pack.axes)
    if axes is pack.axes:
        return pack
    position = pack.axes[1].position(axes[1].nodes)
    factor = AxisSamples.of(position, pack.axes[1].size, False).interpolated(pack.factors[1])
    factors = (pack.factors[0], factor, *pack.factors[2:])
    return replace(pack, axes=axes, factors=factors, precision="single")


def merged(packs: tuple[FactorPack, ...]) -> tuple[FactorPack, ...]:
    """Merge packs of the same frame and grid, in the order of their first appearance."""
    groups: dict[tuple, list[FactorPack]] = {}
    for pack in packs:
        groups.setdefault((pack.frame, pack.axes), []).append(pack)
    return tuple(
        replace(
            group[0],
            factors=tuple(np.hstack(columns) for columns in zip(*(pack.factors for pack in group), strict=True)),
            palette=Palette.of(np.vstack([pack.spectra for pack in group])),
        )
        for group in groups.values()
    )
