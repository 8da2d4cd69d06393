"""Counts and times in words."""

from __future__ import annotations


def counted(number: int, what: str) -> str:
    """Format a count of things.

    >>> counted(1, "row"), counted(2, "row")
    ('1 row', '2 rows')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def in_words(seconds: float) -> str:
    """Format a time in words, with the precision of an estimate.

    >>> in_words(0.2), in_words(41.0), in_words(95.0), in_words(1300.0), in_words(8000.0)
    ('1 s', '41 s', '1 min 35 s', '22 min', '2 h 13 min')
    """
    whole = max(1, round(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 600:
        return f"{whole // 60} min {whole % 60} s" if whole % 60 else f"{whole // 60} min"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
