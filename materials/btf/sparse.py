"""Arrays of whole numbers that are nearly all 0, the others small: these are kept, and how many zeros come before each.

Compressed, a byte a number takes half of what two would: only the few that no byte holds stand apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Int

# A run of so many zeros that no number ends.
_ON = 255
# What stands for a number that no byte holds.
_LARGE = np.iinfo(np.int8).min


def sparse(values: Int[np.ndarray, "..."]) -> dict[str, Any]:
    """Encode an array for a file: `shape`, `runs` of zeros in bytes, 255 where as many go before a further run,
    `others` in bytes, -128 where the next of `large` stands there.
    """
    flat = values.ravel()
    places = np.flatnonzero(flat)
    before = np.diff(places, prepend=-1) - 1
    whole = before // _ON
    runs = np.full(len(places) + int(whole.sum()), _ON, dtype=np.uint8)
    runs[np.cumsum(whole + 1) - 1] = before % _ON
    others = flat[places]
    small = np.abs(others.astype(np.int64)) <= -(_LARGE + 1)
    kept = {"others": np.where(small, others, _LARGE).astype(np.int8), "large": others[~small]}
    return {"shape": np.array(values.shape, dtype=np.int32), "runs": runs, **kept}


def dense(kept: Mapping[str, Any]) -> Int[np.ndarray, "..."]:
    """Return the array of which `sparse` made this."""
    large, small = np.asarray(kept["large"]), np.asarray(kept["others"])
    others = small.astype(large.dtype)
    others[small == _LARGE] = large
    runs = np.asarray(kept["runs"]).astype(np.int64)
    shape = tuple(int(length) for length in np.asarray(kept["shape"]))
    ends = runs < _ON
    found = np.zeros(int(np.prod(shape)), dtype=others.dtype)
    found[(np.cumsum(runs + ends) - 1)[ends]] = others
    return found.reshape(shape)
