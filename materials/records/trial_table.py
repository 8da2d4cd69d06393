"""Tables of a fit's trials and lights: one row each, one column per field; fields may be added or removed."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.fit_error import FitError, LightError

if TYPE_CHECKING:
    from ..fitting.candidate_scoring import Trial

_PLAIN = (bool, int, float, str, type(None))


def trial_table(trials: Sequence[Trial | LightError]) -> np.ndarray:
    """Make a structured array (N,): a column per field, "error.mean" and so on for those of the error; text is UTF-8.

    Missing numbers (None) are NaN; tuples of plain values are JSON text. Anything else is left out.
    """
    rows = [_row(trial) for trial in trials]
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: _column([row.get(name) for row in rows]) for name in names}
    table = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def trials_from(table: np.ndarray) -> tuple[Trial, ...]:
    """Return the trials of a table. Unknown columns are ignored, fields without a column have their defaults.

    Raises TypeError if a field without a default has no column.
    """
    # Imported here, so that a look into a catalogue does not wait for the fit.
    from ..fitting.candidate_scoring import Trial

    return tuple(
        _built(Trial, {name: table[name][row] for name in table.dtype.names or ()}) for row in range(len(table))
    )


def lights_from(table: np.ndarray) -> tuple[LightError, ...]:
    """Return the figures of each light of a table that `trial_table` made."""
    return tuple(
        _built(LightError, {name: table[name][row] for name in table.dtype.names or ()}) for row in range(len(table))
    )


def _row(trial: Trial | LightError) -> dict[str, Any]:
    row = {}
    for field in dataclasses.fields(trial):
        value = getattr(trial, field.name)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            inner = {f"{field.name}.{part.name}": getattr(value, part.name) for part in dataclasses.fields(value)}
        else:
            inner = {field.name: value}
        for name, plain in inner.items():
            plain = plain.item() if isinstance(plain, np.generic) else plain
            if isinstance(plain, tuple | list) and all(isinstance(part, _PLAIN) for part in plain):
                plain = json.dumps(plain)
            if isinstance(plain, _PLAIN):
                row[name] = plain
    return row


def _column(values: list[Any]) -> np.ndarray:
    if any(isinstance(value, str) for value in values):
        return np.array([(value or "").encode("utf-8") for value in values])
    if any(value is None for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(values)


def _built(kind: type, cells: dict[str, Any]) -> Any:
    found = {}
    for field in dataclasses.fields(kind):
        inner = {name.partition(".")[2]: cell for name, cell in cells.items() if name.startswith(f"{field.name}.")}
        if inner:
            found[field.name] = _built(FitError, inner)
        elif field.name in cells:
            found[field.name] = _value(cells[field.name], str(field.type))
    return kind(**found)


def _value(cell: Any, annotation: str) -> Any:
    if isinstance(cell, bytes):
        text = cell.decode("utf-8")
        if annotation.startswith("tuple"):
            return tuple(json.loads(text))
        return None if not text and "None" in annotation else text
    value = cell.item()
    if isinstance(value, float) and np.isnan(value) and "None" in annotation:
        return None
    # A column with gaps is one of floats, whatever its field is.
    for plain in (bool, int):
        if isinstance(value, float) and annotation.startswith(plain.__name__):
            return plain(value)
    return value
