"""Rows of a review, one file per set, so that an interrupted review can be resumed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.files import written_whole
from .row import Limits, ReferenceNoise, ReviewRow, RowColour, WorstPixel
from .statistics import DeltaEStatistics, SelfCheck


@dataclass(frozen=True, eq=False)
class DrawnRows:
    """Rows that were drawn together, and further results.

    Parameters
    ----------
    checks : self-checks of the report made with them.
    warnings : on their pictures.
    files : SHA-256 of each of their files, by its name.
    """

    rows: tuple[ReviewRow, ...]
    checks: tuple[SelfCheck, ...] = ()
    warnings: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)


_KINDS = (DrawnRows, ReviewRow, RowColour, ReferenceNoise, Limits, WorstPixel, DeltaEStatistics, SelfCheck)
_TYPES = {kind.__name__: kind for kind in _KINDS}
_TREE, _DATA = "tree", "data"


def write_rows(path: Path, drawn: DrawnRows) -> None:
    """Write everything in `drawn` to one file."""
    data = bytearray()
    tree = json.dumps(_plain(drawn, data)).encode()
    members = {name: np.frombuffer(content, dtype=np.uint8) for name, content in ((_TREE, tree), (_DATA, data))}
    with written_whole(path) as beside, beside.open("wb") as file:
        np.savez(file, **members)  # type: ignore[arg-type]


def read_rows(path: Path) -> DrawnRows:
    """Read the rows of `write_rows`.

    Raises
    ------
    OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile : not such a file, or of another version.
    """
    # Opened here: numpy leaves a damaged file open.
    with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
        found = _whole(json.loads(held[_TREE].tobytes()), held[_DATA].tobytes())
    if not isinstance(found, DrawnRows):
        raise TypeError("no rows")
    return found


def read_file_names(path: Path) -> tuple[str, ...]:
    """Return the names of the files of rows, `DrawnRows.files`, without reading the rows; raises as `read_rows`."""
    with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
        return tuple(_whole(json.loads(held[_TREE].tobytes())["of"]["files"], b""))


def _plain(value: Any, data: bytearray) -> Any:
    """Convert `value` to JSON types; the content of arrays and bytes is appended to `data`."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, bytes | np.ndarray):
        start = len(data)
        data += value if isinstance(value, bytes) else value.tobytes()
        if isinstance(value, bytes):
            return {"bytes": [start, len(value)]}
        return {"array": [start, value.dtype.str, list(value.shape)]}
    kind = type(value).__name__
    if is_dataclass(value) and kind in _TYPES:
        return {"a": kind, "of": {each.name: _plain(getattr(value, each.name), data) for each in fields(value)}}
    if isinstance(value, Mapping):
        return {"map": [[str(key), _plain(held, data)] for key, held in value.items()]}
    if isinstance(value, tuple | list):
        return {kind: [_plain(held, data) for held in value]}
    raise TypeError(f"a row cannot hold {kind}")


def _whole(tree: Any, data: bytes) -> Any:
    """Restore the tree passed to `_plain`."""
    if not isinstance(tree, dict):
        return tree
    if "a" in tree:
        return _TYPES[tree["a"]](**{name: _whole(held, data) for name, held in tree["of"].items()})
    ((kind, held),) = tree.items()
    if kind == "map":
        return {key: _whole(each, data) for key, each in held}
    if kind in ("tuple", "list"):
        return (tuple if kind == "tuple" else list)(_whole(each, data) for each in held)
    if kind == "bytes":
        start, length = held
        return data[start : start + length]
    start, dtype, shape = held
    return np.ndarray(shape, dtype, data, start).copy()
