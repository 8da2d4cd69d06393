"""Spectra as other libraries and plain Python hold them, known by their attributes: none of these is imported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

#: Kinds that are known, for messages.
KINDS = (
    "colour.SpectralDistribution, colour.MultiSpectralDistributions, (wavelengths_nm, values), {nm: value}, or a "
    "pandas Series or DataFrame over nm"
)
# Begins the names that colour-science gives what nobody named: the class and its number in memory.
_UNNAMED = ("SpectralDistribution (", "MultiSpectralDistributions (")


def foreign_curves(value: Any) -> list[tuple[str, Float[np.ndarray, " L"], Float[np.ndarray, " L"]]] | None:
    """Take curves out of another library's object, or out of plain Python's.

    Parameters
    ----------
    value : one of `KINDS`. A tuple of two is wavelengths and values; values (L, n) are n curves.

    Returns
    -------
    list or None : name ("" where it has none), nm ascending, values; None where it is nothing of the kind.
    """
    name = str(getattr(value, "name", "") or "")
    name = "" if name.startswith(_UNNAMED) else name
    names: list[str] | None = None
    if hasattr(value, "wavelengths") and hasattr(value, "values") and not isinstance(value, Mapping):
        nm, values = value.wavelengths, value.values
        names = [str(label) for label in value.labels] if hasattr(value, "labels") else None
    elif hasattr(value, "to_numpy") and hasattr(value, "index"):
        nm, values = value.index, value.to_numpy()
        names = [str(label) for label in value.columns] if hasattr(value, "columns") else None
    elif isinstance(value, Mapping):
        nm, values = list(value), list(value.values())
    elif isinstance(value, tuple) and len(value) == 2 and all(map(_is_array, value)):
        nm, values = value
    else:
        return None
    try:
        nm, values = np.asarray(nm, dtype=np.float64), np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    if nm.ndim != 1 or values.ndim not in (1, 2) or values.shape[0] != nm.size or not nm.size:
        return None
    order = np.argsort(nm, kind="stable")
    columns = values.reshape(nm.size, -1)[order].T
    if names is None or len(names) != len(columns):
        names = [name] if len(columns) == 1 else [f"{name} {number}".strip() for number in range(1, len(columns) + 1)]
    return [(label, nm[order], column) for label, column in zip(names, columns, strict=True)]


def _is_array(value: Any) -> bool:
    """Return True for arrays and sequences of numbers, and not for what is a spectrum by itself."""
    indexed = hasattr(value, "to_numpy") and not hasattr(value, "index")
    return isinstance(value, np.ndarray | list | tuple | range) or indexed
