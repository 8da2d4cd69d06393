"""Joint refinement of all packs of a candidate, and guards that bring them back within their bounds."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace

import numpy as np

from ..core.brdf import Brdf
from ..factored.pack import FactorPack
from .bounded_spectra import within_bounds
from .bounds import Bounds
from .candidate_scoring import Judge
from .candidates import Candidate, FitSettings
from .joint import refined, refined_without_extrapolation
from .visible_samples import SeenSamples, seen_samples

# Pairs drawn for each pixel of the protocol's square; some two thirds are above the horizon.
_PAIRS_A_PIXEL = 3.5
# Fewest pairs drawn.
_FEWEST_PAIRS = 12_000
# Factor of the pairs of an anisotropic surface, for its azimuths.
_TIMES_FOR_AZIMUTHS = 1.7
# Most rounds of refinement.
_ROUNDS = 2
# Share of the distance that a round must gain for another one to follow.
_LEAST_GAIN = 0.03
# Factor of the weight of errors under light from behind, from one round to the next.
_BACK_STEP = 3.0
# Largest weight of errors under light from behind.
_MOST_BACK_WEIGHT = 9.0
# Rounds that bring packs back within their bounds, at most.
_BOUNDING_ROUNDS = 9
# Sweeps of each such round.
_BOUNDING_SWEEPS = 3
# Cost of leaving the bounds by 0.02 at one guard, as a share of that of all errors.
_GUARD_COST = 1e-3
# Multiple of their bounds up to which packs may be for spectra alone to be tried.
_NEARLY_WITHIN = 1.15
# Rounds from one trial of spectra alone to the next, however far packs are beyond their bounds.
_TRY_SPECTRA_EVERY = 3
# Factor by which spectra alone may raise the cost of all errors.
_DEAREST_SPECTRA = 1.1
# Factor of the weight of guards set before, in each such round from the second on.
_FIRMER = 2.0
# Terms from which pairs are drawn anew, so that many terms are not fitted to the same ones for long; and factors of
# their number before the first of these and from each on: few terms have few unknowns.
_DRAWN_ANEW = (8, 24, 64, 96)
_TIMES_FOR_TERMS = (0.4, 1.0, 2.0, 2.0, 2.0)
# Stride of the samples that spectra alone are fitted to.
_SPECTRA_THINNED = 4


class Refinement:
    """Joint refinement of one fit: its samples, drawn when first needed, and its bounds.

    Bounds come last: guards set while terms are added would be weighed against errors many times the final ones, and
    outweigh the picture.
    """

    def __init__(self, brdf: Brdf, judge: Judge, settings: FitSettings) -> None:
        self.brdf, self.judge, self.settings = brdf, judge, settings
        self.bounds = Bounds.of(brdf)
        # Number of times that pairs were drawn anew, and the last samples.
        self._drawn: tuple[int, SeenSamples] | None = None

    def samples(self, terms: int) -> SeenSamples:
        """Return samples of the BRDF, as many as suit this number of terms."""
        times = bisect_right(_DRAWN_ANEW, terms)
        if self._drawn is None or self._drawn[0] != times:
            pairs = max(_PAIRS_A_PIXEL * self.judge.pixels**2, _FEWEST_PAIRS) * _TIMES_FOR_TERMS[times]
            pairs = max(pairs, _FEWEST_PAIRS)
            pairs *= 1.0 if self.brdf.isotropic else _TIMES_FOR_AZIMUTHS
            self._drawn = times, seen_samples(self.brdf, int(pairs), self.settings.seed + times)
        return self._drawn[1]

    def refine(self, candidate: Candidate) -> Candidate:
        """Refine the candidate for some rounds, as long as that pays; return the best of them."""
        best = candidate
        for _ in range(_ROUNDS):
            before = best.judgement.score
            candidate = self.refine_once(candidate, candidate.packs)
            best = candidate if self.is_gain(candidate, before) else best
            gained = candidate.judgement.distance <= (1.0 - _LEAST_GAIN) * before
            more_weight = candidate.judgement.back_decides and candidate.back_weight < _MOST_BACK_WEIGHT
            if best.judgement.score <= self.settings.budget or not (gained or more_weight):
                break
        return best

    def refine_once(self, candidate: Candidate, packs: tuple[FactorPack, ...]) -> Candidate:
        """Refine the candidate with `packs` in place of its own, by some sweeps.

        While light from behind decides the score, the weight of errors under it grows with every call.
        """
        if candidate.judgement.back_decides:
            weight = min(_BACK_STEP * candidate.back_weight, _MOST_BACK_WEIGHT)
        else:
            weight = max(candidate.back_weight / _BACK_STEP, 1.0)
        found = replace(candidate, packs=packs, stopped="", back_weight=weight, within=False)
        self.judge.doing(f"{found.rank} terms in {found.frames}")
        samples = self.samples(found.rank)
        if weight != 1.0:
            samples = samples.reweighted(np.where(samples.lit_from_behind, weight, 1.0))
        packs, relative = refined(packs, samples)
        judgement = self.judge.judge_packs(packs, None, relative)
        return replace(found, packs=packs, judgement=judgement, relative_error=relative)

    def is_gain(self, candidate: Candidate, before: float) -> bool:
        """Return whether the candidate's distance is less than `before`; record the trial either way."""
        kept = candidate.judgement.distance < before
        self.judge.record(0, candidate.frames, candidate.rank, candidate.judgement, kept, candidate.name, joint=True)
        return kept

    def bring_within(self, candidate: Candidate) -> Candidate:
        """Refine the same terms with guards at violations of the bounds, until there are none.

        These sweeps, which refine the appearance too, are the last that the packs get.
        """
        packs, within = self._enforced(candidate)
        if packs is candidate.packs:
            return replace(candidate, within=within)
        judgement = self.judge.judge_packs(packs, None, candidate.relative_error)
        return replace(candidate, packs=packs, judgement=judgement, within=within)

    def _enforced(self, candidate: Candidate) -> tuple[tuple[FactorPack, ...], bool]:
        """Bring packs within the bounds; return them and whether that succeeded.

        Spectra alone fix the remaining violations as soon as that is cheap.
        """
        packs, samples = candidate.packs, None
        for number in range(_BOUNDING_ROUNDS):
            violations = self.bounds.violations(packs)
            if not len(violations):
                return packs, True
            # Packs that are within all bounds as they come need none.
            samples = self.samples(candidate.rank) if samples is None else samples
            self.judge.doing(f"{candidate.rank} terms: {len(violations)} places are still out of the bounds of shading")
            last = number == _BOUNDING_ROUNDS - 1
            turn = number % _TRY_SPECTRA_EVERY == _TRY_SPECTRA_EVERY - 1
            if violations.worst_excess <= _NEARLY_WITHIN or turn or last:
                mended, done = within_bounds(packs, samples.thinned(_SPECTRA_THINNED), self.bounds, violations)
                if done and (last or samples.cost(mended) <= _DEAREST_SPECTRA * samples.cost(packs)):
                    return mended, True
            standing = replace(samples, guards=(_FIRMER if number else 1.0) * samples.guards)
            cost = _GUARD_COST * samples.cost(packs)
            samples = standing.with_guards(violations.wi, violations.wo, self.bounds.limits, cost)
            packs = refined_without_extrapolation(packs, samples, _BOUNDING_SWEEPS)
        return packs, self.bounds.extremes(packs).within
