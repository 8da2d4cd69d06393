"""Indented JSON, as `json.dumps` writes it, but by its C encoder, which that does not use with an indent."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from typing import Any

_SCALARS = frozenset({str, int, float, bool, type(None)})


def indented_json(value: Any, indent: int = 1) -> str:
    """Return the text of `json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False)`.

    Raises
    ------
    ValueError : NaN or an infinite number. TypeError : a value that JSON cannot represent, or a key that is no text.
    """
    return _text(value, "\n", " " * indent)


def _text(value: Any, line: str, step: str) -> str:
    """Encode a value.

    line : a line feed, and the indentation of the value itself.
    """
    inner = line + step
    if not (isinstance(value, dict | list | tuple) and value):
        return _encoder(", ")(value)
    named = isinstance(value, dict)
    if _SCALARS.issuperset(map(type, value.values() if named else value)):
        whole = _encoder(f",{inner}")(value)
        return f"{whole[0]}{inner}{whole[1:-1]}{line}{whole[-1]}"
    if named:
        parts = [f"{_key(name)}: {_text(held, inner, step)}" for name, held in value.items()]
    else:
        parts = [_text(held, inner, step) for held in value]
    first, last = "{}" if named else "[]"
    return f"{first}{inner}{f',{inner}'.join(parts)}{line}{last}"


def _key(name: Any) -> str:
    if not isinstance(name, str):
        raise TypeError(f"{name!r}, where a name is expected")
    return _encoder(", ")(name)


@cache
def _encoder(between: str) -> Callable[[Any], str]:
    return json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(between, ": ")).encode
