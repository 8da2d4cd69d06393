"""Fit of factor packs to a BRDF, with as few terms as an error budget in ΔE94 allows.

Frames, split, rank and precision are chosen by trials (`search`), judged by the appearance of a sphere
(`candidate_scoring`). One frame alone would need far more terms than a sum of packs: Schwenk 2010, section 3.4, notes
which materials suit which frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ..core.axes import Axis, Frame
from ..core.brdf import Brdf, Lobe
from ..core.fit_error import FitError
from ..factored.pack import FactoredBrdf
from .bounds import Bounds
from .candidate_scoring import Judge, Trial
from .candidates import Candidate, FitSettings
from .half_precision import HalfStorage, half_storage, single_storage
from .lobe_table import METHODS, Method
from .search import RIVALLED, TABLE_TERMS, Search

__all__ = ["METHODS", "Fit", "FitError", "Method", "Trial", "fit"]

#: Numbers of terms that are tried; the last is the most that a fit has in all.
RANKS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48, 64, 80, 96)


@dataclass(frozen=True)
class Fit:
    """Packs whose sum approximates a BRDF, and their joint error.

    fast : packs as stored, in half precision if its cost is negligible; `storage` states the cost.
    error : measured on the packs as stored.
    score : compared with the budget (`Trial`), of the packs as stored.
    candidate, stopped : the winning split of the BRDF, and why no more terms were tried.
    trials : all attempts, in order.
    """

    fast: FactoredBrdf
    error: FitError
    storage: HalfStorage
    score: float
    candidate: str
    stopped: str
    trials: tuple[Trial, ...]

    @property
    def rank(self) -> int:
        """Terms of all packs."""
        return self.fast.rank

    @property
    def stored_bytes(self) -> int:
        """Bytes that a renderer needs: factors as stored, spectra in single precision."""
        return sum(
            (2 if pack.precision == "half" else 4) * sum(factor.size for factor in pack.factors)
            + 4 * pack.palette.values.size
            for pack in self.fast.packs
        )


def fit(
    brdf: Brdf,
    *,
    budget: float = 0.5,
    seed: int = 0,
    axes: tuple[Axis, ...] | None = None,
    ranks: tuple[int, ...] = RANKS,
    pixels: int = 128,
    frame: Frame | None = None,
    method: Method = "joint",
    smooth: bool = False,
    precision: Literal["auto", "single"] = "auto",
    tried: Callable[[Trial], None] = lambda trial: None,
    doing: Callable[[str], None] = lambda phase: None,
) -> Fit:
    """Fit factor packs to `brdf`, their spectra sampled on the working wavelengths.

    Parameters
    ----------
    budget : ΔE94 that the 99th percentile on the sphere protocol should not exceed under any of `protocol.LIGHTS`, with
        0.3 of it for the mean and 4 times as much for the 99th percentile of the highlight's own pixels. The measured
        error is reported whether or not it is met: a budget may be out of reach of `ranks` or of the grid.
    seed : of the random starts; the same seed gives the same bits on the same machine.
    axes : grid for a BRDF of one lobe, in place of the one chosen for it.
    ranks : numbers of terms to try for each lobe, ascending; no more than the last are tried in all.
    pixels : of the sphere protocol; recorded in the error's `protocol`.
    frame : fits the BRDF as one lobe in this frame, in place of the lobes that it names itself.
    method : "joint": tables first, then all packs refined jointly on visible samples, and split into frames as it pays.
        "weighted": each lobe's table alone, its nodes weighted by visibility. "incremental", "refitted": the packs of
        four of Schwenk 2010, section 3.3, each fitted to the residual, without and with a refit of all.
    smooth : smooths the factors of the tables (figure 4 there): fewer ripples, less sharpness.
    precision : "auto" stores half precision if it adds at most 0.1 to the 99th percentile; "single" never does.
    tried : called after each trial. doing : called with a description of the current work, some seconds apart at most.

    Raises
    ------
    InputError : not a BRDF, the budget is not positive, or the BRDF is not finite somewhere above the horizon.
    """
    if not isinstance(brdf, Brdf):
        raise InputError(
            "not a BRDF",
            field="brdf",
            found=repr(brdf)[:80],
            expected="a BRDF, such as of material.brdf()",
            hint='metamer.Material.from_spectrum(spectrum, "family/name") makes a material of a spectrum',
        )
    if not budget > 0:
        raise InputError("unusable budget", field="budget", found=budget, expected="a positive ΔE94")
    if not ranks:
        raise InputError("no ranks to try", field="ranks", found=0, expected="at least one number of terms")
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS, field="method")
    lobes: tuple[Lobe, ...] = brdf.lobes() if frame is None else (Lobe(frame, brdf),)
    if axes is not None and len(lobes) != 1:
        raise InputError("one grid for several lobes", field="axes", found=len(lobes), expected="a BRDF of one lobe")
    doing("looking at the original")
    judge = Judge(brdf, lobes, pixels, tried, doing)
    both: tuple[Frame, ...] = ("io", "hd")
    frames: tuple[Frame, ...] = both if frame is None and axes is None else tuple(lobe.frame for lobe in lobes)
    search = Search(brdf, judge, FitSettings(budget, seed, tuple(ranks), method, smooth, axes, frames))
    best = search.lobewise(lobes)
    short = best.rank <= RIVALLED and not (best.meets(budget) and best.rank <= TABLE_TERMS)
    if method == "joint" and len(ranks) > 1 and short:
        for other in frames:
            if [lobe.frame for lobe in lobes] != [other]:
                rival = search.whole(other, best)
                best = rival if rival.better_than(best, budget) else best
    return _stored(best, judge, search.refinement.bounds, precision, budget)


def _stored(best: Candidate, judge: Judge, bounds: Bounds, precision: str, budget: float) -> Fit:
    """Choose the stored precision; return the packs in it and their error."""
    storage, judgement, extremes = single_storage(best.packs), best.judgement, bounds.extremes(best.packs)
    if precision == "auto" and all(np.any(pack.spectra) for pack in best.packs):
        half = half_storage(best.packs, lambda packs: judge.judge_packs(packs).error.p99)
        after = judge.judge_packs(half.packs, None, best.relative_error)
        if judgement.score <= budget < after.score:
            storage = replace(storage, reason=f"kept single: half precision would miss the budget of ΔE94 {budget:g}")
        elif (rounded := bounds.extremes(best.packs, half.packs)).within or not extremes.within:
            storage, judgement, extremes = half, after, rounded
        else:
            storage = replace(storage, reason="kept single: half precision would leave the bounds of shading")
    terms, score = one_more_step(judge.trials, best.name, best.rank, judgement.score) or (None, None)
    error = replace(
        judgement.error,
        most_negative=extremes.lowest,
        largest=extremes.ratio,
        budget=budget,
        score=judgement.score,
        more_terms=terms,
        more_score=score,
    )
    return Fit(
        FactoredBrdf(storage.packs, error),
        error,
        storage,
        judgement.score,
        best.name,
        best.stopped,
        tuple(judge.trials),
    )


def one_more_step(trials: Sequence[Trial], candidate: str, rank: int, score: float) -> tuple[int, float] | None:
    """Estimate the terms and the score of one more step of growth; None if no terms were added.

    If more terms were tried, the score is assumed to change by as much as theirs did before bounds were enforced; else
    by as much as with the last terms added.

    Parameters
    ----------
    candidate, rank, score : of the result of the fit; trials of other candidates are ignored.
    """
    grown: dict[int, float] = {}
    for trial in trials:
        if trial.joint and trial.candidate == candidate:
            grown[trial.rank] = min(trial.score, grown.get(trial.rank, trial.score))
    if rank not in grown or not grown[rank] > 0.0:
        return None
    more = min((other for other in grown if other > rank), default=None)
    if more is not None:
        return more - rank, score * grown[more] / grown[rank]
    before = max((other for other in grown if other < rank), default=None)
    if before is None or not grown[before] > 0.0:
        return None
    return rank - before, score * min(grown[rank] / grown[before], 1.0)
