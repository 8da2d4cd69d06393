"""Spectra in objects of other libraries and of plain Python, recognised by their attributes without imports."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError

#: Kinds that are known, for messages.
KINDS = (
    "colour.SpectralDistribution, colour.MultiSpectralDistributions, (wavelengths_nm, values), {nm: value}, or a "
    "pandas Series or DataFrame over nm"
)
# Begins the names that colour-science gives what nobody named: the class and its number in memory.
_UNNAMED = ("SpectralDistribution (", "MultiSpectralDistributions (")
# A wavelength as a label, the heading of a column of them, and the shortest one that a label is taken for.
_LABEL = re.compile(r"(\d+(?:\.\d*)?)\s*(?:nm)?", re.IGNORECASE)
_NM_HEADING = re.compile(r"(?:wave[ _-]?lengths?|wl|lambda|λ)[\W_]*(?:nm)?\W*|\W*nm\W*", re.IGNORECASE)
_SHORTEST_NM = 200.0


def foreign_curves(value: Any) -> list[tuple[str, Float[np.ndarray, " L"], Float[np.ndarray, " L"]]] | None:
    """Take curves out of another library's object, or out of plain Python's.

    Parameters
    ----------
    value : one of `KINDS`. A tuple of two is wavelengths and values; values (L, n) are n curves.

    Returns
    -------
    list or None : name ("" without one), nm ascending, values; None for other objects.

    Raises
    ------
    InputError : a table whose wavelengths are not in its index, but in its headings or in a column.
    """
    name = str(getattr(value, "name", "") or "")
    name = "" if name.startswith(_UNNAMED) else name
    names: list[str] | None = None
    if hasattr(value, "wavelengths") and hasattr(value, "values") and not isinstance(value, Mapping):
        nm, values = value.wavelengths, value.values
        names = [str(label) for label in value.labels] if hasattr(value, "labels") else None
    elif hasattr(value, "to_numpy") and hasattr(value, "index"):
        _check_wavelengths_in_index(value)
        labels = [_nm(label) for label in value.index]
        nm, values = value.index if None in labels else labels, value.to_numpy()
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


def _check_wavelengths_in_index(table: Any) -> None:
    """Refuse a table over something else whose headings, or one of whose columns, are wavelengths."""
    headings = list(getattr(table, "columns", ()))
    if all((_nm(label) or 0.0) >= _SHORTEST_NM for label in table.index):
        return
    others = [heading for heading in headings if (_nm(heading) or 0.0) < _SHORTEST_NM]
    column = next((heading for heading in others if _NM_HEADING.fullmatch(str(heading).strip())), None)
    if len(headings) - len(others) > 1:
        # Lots in rows: what stands beside the wavelengths is their name, and more than one such column is too much.
        hint = "df.T"
        if others:
            hint = f"df.set_index({others[0]!r}).T" + (", without the other columns" if len(others) > 1 else "")
        found = "wavelengths as headings, and lots in rows"
    elif column is not None:
        hint, found = f"df.set_index({column!r})", f"wavelengths in the column {column!r}"
    elif len(table.index) > 1 and list(table.index) == list(range(len(table.index))):
        # The index that pandas makes where nobody names one.
        hint = "df.set_index(the column of wavelengths)"
        found = f"rows numbered from 0 to {len(table.index) - 1}"
    else:
        return
    raise InputError(
        "a table whose index is no wavelengths", field="value", found=found, expected="nm as its index", hint=hint
    )


def _nm(label: Any) -> float | None:
    """Parse a wavelength from a label such as 400, "400" or "400 nm"; None for other labels."""
    found = _LABEL.fullmatch(str(label).strip())
    return float(found[1]) if found else None


def _is_array(value: Any) -> bool:
    """Return True for arrays and sequences of numbers, but not for objects that are spectra themselves."""
    indexed = hasattr(value, "to_numpy") and not hasattr(value, "index")
    return isinstance(value, np.ndarray | list | tuple | range) or indexed
