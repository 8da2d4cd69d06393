"""What a material's provenance is worth, in the word that stands beside every picture of it."""

from __future__ import annotations


def standing_of(kind: str) -> str:
    """What a kind of provenance is worth, in one word: measured, analytic, uplifted or reconstructed.

    >>> standing_of("uplifted(mallett-yuksel)"), standing_of("measured")
    ('uplifted', 'measured')
    """
    return kind.partition("(")[0]
