"""Hash of all inputs of a result: equal hashes mean equal results."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np


def fingerprint(*values: Any) -> str:
    """Compute the SHA-256 of numbers, words, arrays and nested dataclasses of these; types and shapes count.

    >>> fingerprint(1, "a") == fingerprint(1, "a"), fingerprint(1) == fingerprint(1.0)
    (True, False)

    Raises
    ------
    TypeError : a value of another kind, whose content is unknown.
    """
    found = hashlib.sha256()
    _feed(found.update, values)
    return found.hexdigest()


# By identity: what is kept goes with its object.
_kept: WeakKeyDictionary[Any, str] = WeakKeyDictionary()


def kept_fingerprint(value: Any) -> str:
    """Return the cached `fingerprint` of an immutable object that is compared by identity."""
    found = _kept.get(value)
    if found is None:
        found = _kept[value] = fingerprint(value)
    return found


def _feed(take: Callable[[bytes], object], value: Any) -> None:
    def head(*words: object) -> None:
        take((" ".join(map(str, (type(value).__name__, *words))) + "\n").encode())

    if value is None or isinstance(value, bool | int | float | complex | np.generic):
        head(repr(value))
    elif isinstance(value, str | bytes | Path):
        data = value if isinstance(value, bytes) else str(value).encode("utf-8", "surrogateescape")
        head(len(data))
        take(data)
    elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
        head(value.dtype.str, value.shape)
        take(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        head(len(fields(value)))
        for each in fields(value):
            _feed(take, each.name)
            _feed(take, getattr(value, each.name))
    elif isinstance(value, Mapping):
        head(len(value))
        for key, held in value.items():
            _feed(take, key)
            _feed(take, held)
    elif isinstance(value, Sequence | set | frozenset):
        head(len(value))
        for held in value if isinstance(value, Sequence) else sorted(value):
            _feed(take, held)
    else:
        raise TypeError(f"no fingerprint of {type(value).__name__}")
