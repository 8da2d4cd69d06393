"""One step more than a fit took: the terms that it would have added, and the score that they would have led to."""

from __future__ import annotations

from collections.abc import Sequence

from .candidate_scoring import Trial


def one_more_step(trials: Sequence[Trial], candidate: str, rank: int, score: float) -> tuple[int, float] | None:
    """Estimate the terms and the score of one more step of growth; None where no terms were added.

    Where more terms were tried, they changed the score by as much as they did before bounds were kept; else by as much
    as the last terms that were added.

    Parameters
    ----------
    candidate, rank, score : of what the fit ended with; trials of other candidates do not count.
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
