"""Checks of session values, with errors that name field, found and expected; values are never clamped."""

from __future__ import annotations

import math
from collections.abc import Collection

from ...lighting.vectors import Number
from ...runtime.errors import InputError, UnknownNameError

Vector = tuple[float, float, float]


def check_within(value: Number, low: Number, high: Number, field: str, unit: str = "") -> None:
    """Check for a finite number from `low` to `high`."""
    if not (math.isfinite(value) and low <= value <= high):
        expected = f"{low:g} to {high:g}{unit and ' '}{unit}"
        raise InputError("out of range", field=field, found=value, expected=expected)


def check_positive(value: Number, field: str, unit: str = "") -> None:
    """Check for a finite number above 0."""
    if not (math.isfinite(value) and value > 0.0):
        raise InputError("out of range", field=field, found=value, expected=f"more than 0{unit and ' '}{unit}, finite")


def check_vector(value: Vector, field: str) -> None:
    """Check for three finite numbers."""
    if len(value) != 3 or not all(math.isfinite(one) for one in value):
        raise InputError("not a point or direction", field=field, found=value, expected="three finite numbers")


def check_known(value: str, known: Collection[str], field: str, kind: str) -> None:
    """Check for a known name."""
    if value not in known:
        raise UnknownNameError(kind, value, known, field=field)


def check_text(value: str, field: str) -> None:
    """Check for non-blank text that can be written to a file."""
    if not value.strip():
        raise InputError("no text", field=field, found=repr(value), expected="some letters")
    _check_writable(value, field)


def _check_writable(value: str, field: str) -> None:
    """Check for text that can be encoded in UTF-8: no surrogates, as in undecodable file names."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(
            "text that cannot be kept", field=field, found=ascii(value), expected="characters of Unicode"
        ) from None
