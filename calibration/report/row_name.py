"""Short names on pages: of observers, and of rows in addresses."""

from __future__ import annotations

import re

from ...spectral.observers import observer_title


def row_id(name: str) -> str:
    """Return the name of a row for an address: without white space."""
    return re.sub(r"\s", "_", name)


def short_observer(name: str) -> str:
    """Return the field of a standard observer in degrees, with its year unless it is the usual one.

    >>> short_observer("CIE 1931 2 Degree Standard Observer"), short_observer("CIE 2015 2 Degree Standard Observer")
    ('2°', '2° (CIE 2015)')
    """
    words = observer_title(name).rsplit(" ", 1)
    if len(words) < 2 or not words[1].endswith("°"):
        return name
    return words[1] if tuple(words) in (("CIE 1931", "2°"), ("CIE 1964", "10°")) else f"{words[1]} ({words[0]})"
