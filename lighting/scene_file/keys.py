"""Keys of `scene.toml`, with the kind of value of each and the checks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError, UnknownNameError

TABLES = ("scene", "viewing", "part", "light", "camera", "interreflection", "review")
SCENE = {"name": "text", "observer": "text"}
VIEWING = {
    "reference_illuminance_lux": "number",
    "background_reflectance": "number",
    "adaptation": "text",
    "ocio_config": "text",
    "display": "text",
    "view": "text",
}
PART = {
    "name": "text",
    "shape": "text",
    "mesh": "text",
    "mesh_part": "text",
    "crease_deg": "number",
    "material": "text",
    "materials": "materials",
    "static": "flag",
    "translate": "vector",
    "rotate_deg": "vector",
    "scale": "scale",
    "uv_scale": "uv_scale",
    "uv_rotate_deg": "number",
    "uv_size_mm": "uv_size",
}
# Keys of a table for one material of a mesh file.
WORN = {"material": "text", "uv_scale": "uv_scale", "uv_rotate_deg": "number", "uv_size_mm": "uv_size"}
# Keys of each generated shape, besides those of every part.
SHAPES = {
    "sphere": {"subdivisions": "count", "uv": "flag"},
    "speed_shape": {"subdivisions": "count", "uv": "flag"},
    "cloth": {"divisions": "count"},
    "plane": {"width": "number", "depth": "number"},
    "patches": {"gap": "number", "tilt_deg": "number"},
}
LIGHT = {"name": "text", "kind": "text", "spectrum": "text", "entry": "entry", "spectrum_column": "text"}
CAMERA = {
    "name": "text",
    "position": "vector",
    "target": "vector",
    "up": "vector",
    "projection": "text",
    "vertical_fov_deg": "number",
    "height": "number",
    "width": "count",
    "height_px": "count",
    "samples": "count",
    "near": "number",
    "far": "number",
}
INTERREFLECTION = {"bounces": "bounces"}
REVIEW = {"on": "text", "materials": "texts", "illuminants": "texts"}

EXPECTED = {
    "text": "text in quotes",
    "file": "the name of a file, in quotes",
    "texts": "a list of texts",
    "materials": "a list of texts, or of a mesh a table of ids",
    "number": "a finite number",
    "entry": "a name in quotes, or a number from 1",
    "count": "a whole number, at least 1",
    "bounces": 'a whole number from 0, or "auto"',
    "flag": "true or false",
    "vector": "a list of three finite numbers",
    "scale": "a number or a list of three, none of them 0",
    "uv_scale": "a number or a list of two, none of them 0",
    "uv_size": "millimetres, or a list of two, more than 0",
}


def taken(table: Mapping[str, Any], kinds: Mapping[str, str], path: Path, where: str) -> dict[str, Any]:
    """Return the values of a table, each checked against its kind; a key that is not in `kinds` is an error."""
    got = {}
    for key, value in table.items():
        if key not in kinds:
            raise UnknownNameError("key", key, kinds, file=path, field=f"{where}.{key}")
        if not _fits(value, kinds[key]):
            expected = EXPECTED[kinds[key]]
            raise InputError(
                "wrong kind of value", file=path, field=f"{where}.{key}", found=repr(value), expected=expected
            )
        got[key] = np.array(value, dtype=np.float64) if kinds[key] == "vector" else value
    return got


def _fits(value: Any, kind: str) -> bool:
    number = type(value) in (int, float) and bool(np.isfinite(value))
    if kind in ("text", "file"):
        return isinstance(value, str) and bool(value)
    if kind == "entry":
        return _fits(value, "text") or _fits(value, "count")
    if kind == "texts":
        return isinstance(value, list) and bool(value) and all(isinstance(item, str) and item for item in value)
    if kind == "materials":
        return _fits(value, "texts") or (isinstance(value, dict) and all(map(_is_worn, value.values())) and bool(value))
    if kind == "flag":
        return isinstance(value, bool)
    if kind == "count":
        return type(value) is int and value >= 1
    if kind == "bounces":
        return value == "auto" or (type(value) is int and value >= 0)
    items: list[Any] = value if isinstance(value, list) else []
    vector = len(items) == 3 and all(_fits(item, "number") for item in items)
    if kind == "vector":
        return vector
    if kind == "uv_size":
        return _fits(value, "uv_scale") and all(item > 0 for item in (items or [value]))
    if kind in ("scale", "uv_scale"):
        several = len(items) == (3 if kind == "scale" else 2) and all(_fits(item, "number") for item in items)
        return (number and value != 0) or (several and all(item != 0 for item in items))
    return number


def _is_worn(value: Any) -> bool:
    """Return whether a value is a material id or a table, whose keys are checked when it is read."""
    return isinstance(value, dict) or _fits(value, "text")


@contextmanager
def errors_at(path: Path, where: str | None) -> Iterator[None]:
    """Add file and table to errors raised while building from a table; to errors about another file, where it is
    named.
    """
    try:
        yield
    except InputError as error:
        if error.file is not None:
            raise error.at(named_in=f"{path}, {where}" if where else str(path)) from error
        field = ".".join(part for part in (where, error.field) if part) or None
        raise error.at(file=path, field=field) from error
