"""Standing of a material, in the word beside every picture of it; and whether its fit met the budget."""

from __future__ import annotations

from typing import Protocol


class Aimed(Protocol):
    """Fit's budget, its score, and the estimated result of one more step (`FitError`)."""

    @property
    def budget(self) -> float | None:
        """ΔE94."""
        ...

    @property
    def score(self) -> float | None:
        """ΔE94."""
        ...

    @property
    def more_terms(self) -> float | None:
        """Terms of one more step."""
        ...

    @property
    def more_score(self) -> float | None:
        """ΔE94 after one more step."""
        ...


def misses_budget(fit: Aimed) -> bool:
    """Return whether a fit aimed at a budget and missed it."""
    return fit.budget is not None and fit.score is not None and fit.score > fit.budget


def missed_figures(fit: Aimed) -> str:
    """Format `missed_words` as figures for a table; "" if the budget is not missed.

    >>> from types import SimpleNamespace
    >>> missed_figures(SimpleNamespace(budget=0.5, score=0.84, more_terms=16, more_score=0.77))
    '0.84 > 0.5, +16: 0.77'
    """
    if not misses_budget(fit):
        return ""
    more = "" if fit.more_terms is None else f", +{fit.more_terms:g}: {fit.more_score:.2f}"
    return f"{fit.score:.2f} > {fit.budget:g}{more}"


def missed_words(fit: Aimed) -> str:
    """State by how much a fit misses its budget, and the estimated gain of one more step; "" if it does not.

    >>> from types import SimpleNamespace
    >>> missed_words(SimpleNamespace(budget=0.5, score=0.84, more_terms=16, more_score=0.77))
    'misses the budget of ΔE94 0.5 by 0.34; 16 more terms would have led to about 0.77'
    >>> missed_words(SimpleNamespace(budget=0.5, score=3.0, more_terms=16, more_score=3.2))
    'misses the budget of ΔE94 0.5 by 2.50; 16 more terms would have gained nothing'
    """
    if not misses_budget(fit):
        return ""
    assert fit.budget is not None and fit.score is not None
    found = f"misses the budget of ΔE94 {fit.budget:g} by {fit.score - fit.budget:.2f}"
    if fit.more_terms is None or fit.more_score is None:
        return found
    more = f"{found}; {fit.more_terms:g} more {'term' if fit.more_terms == 1 else 'terms'} would have"
    gains = f"{fit.more_score:.2f}" < f"{fit.score:.2f}" and fit.more_score < fit.score
    return f"{more} led to about {fit.more_score:.2f}" if gains else f"{more} gained nothing"


def standing_of(kind: str) -> str:
    """Return the standing of a kind of provenance: measured, analytic, uplifted or reconstructed.

    >>> standing_of("uplifted(mallett-yuksel)"), standing_of("measured")
    ('uplifted', 'measured')
    """
    return kind.partition("(")[0]
