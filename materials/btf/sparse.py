"""Arrays of whole numbers that are nearly all 0: only the others are kept, and how many zeros come before each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Int

# A run of so many zeros that no number ends.
_ON = 255


def sparse(values: Int[np.ndarray, "..."]) -> dict[str, Any]:
    """What a file keeps: `shape`, `runs` of zeros in bytes, 255 where as many go before a further run, and `others`."""
    flat = values.ravel()
    places = np.flatnonzero(flat)
    before = np.diff(places, prepend=-1) - 1
    whole = before // _ON
    runs = np.full(len(places) + int(whole.sum()), _ON, dtype=np.uint8)
    runs[np.cumsum(whole + 1) - 1] = before % _ON
    return {"shape": np.array(values.shape, dtype=np.int32), "runs": runs, "others": flat[places]}


def dense(kept: Mapping[str, Any]) -> Int[np.ndarray, "..."]:
    """The array of which `sparse` made this."""
    runs, others = np.asarray(kept["runs"]).astype(np.int64), np.asarray(kept["others"])
    shape = tuple(int(length) for length in np.asarray(kept["shape"]))
    ends = runs < _ON
    found = np.zeros(int(np.prod(shape)), dtype=others.dtype)
    found[(np.cumsum(runs + ends) - 1)[ends]] = others
    return found.reshape(shape)
