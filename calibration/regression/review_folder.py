"""A folder that `metamer review` has written, as a side: picture and reference of every row."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import read_text
from ...spectral.formats.exr import read_exr
from .picture_files import xyz_layer
from .row import ComparedSide, LayerKind, LayerNoise, PixelLayer, Pixels, Row, RowName

FIGURES = "review.json"
_SCHEMAS = ("metamer.review/1", "metamer.review/2")
_MAP = "ΔE94 EXR"
_FILES: tuple[tuple[LayerKind, str], ...] = (("picture", "XYZ EXR"), ("reference", "reference EXR"))


def review_side(folder: Path) -> ComparedSide:
    """Return all rows of a review, without its date and durations.

    Raises
    ------
    InputError : `review.json` is damaged, of another schema, or names missing files.
    """
    path = folder / FIGURES
    document = _document(path)
    try:
        rows = tuple(_row(folder, path, found) for found in document["results"])
        plan = document["plan"]
        facts = {
            "metamer": str(document["metamer"]),
            "renderer": str(document["renderer"]),
            "plan": f"{plan['basis_size']} coefficients",
            "budget": f"ΔE94 {document['budget_delta_e94']:g}",
            "review": str(document["status"]),
        }
        chain = tuple(str(line) for line in document["colour_chain"])
    except (KeyError, TypeError, ValueError, AttributeError) as reason:
        raise InputError(
            "not the figures of a review",
            file=path,
            field=str(reason.args[0]) if isinstance(reason, KeyError) else None,
            found=f"{type(reason).__name__}: {reason}",
            expected=f"the fields of {document['schema']}",
            hint="review again into this folder",
        ) from None
    return ComparedSide(folder, "review", rows, facts, chain)


def _document(path: Path) -> Mapping[str, Any]:
    try:
        found = json.loads(read_text(path))
    except ValueError as reason:
        raise InputError(
            "the figures cannot be read",
            file=path,
            found=str(reason),
            expected="JSON",
            hint="review again into this folder",
        ) from None
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema not in _SCHEMAS:
        expected = " or ".join(_SCHEMAS)
        raise InputError("another schema", file=path, field="schema", found=schema, expected=expected)
    return found


def _row(folder: Path, path: Path, found: Mapping[str, Any]) -> Row:
    noise = found.get("reference_noise")
    layers: dict[LayerKind, PixelLayer] = {}
    for kind, label in _FILES:
        layer = xyz_layer(_inside(folder, path, found["files"][label]))
        layer = replace(layer, load=partial(_judged, layer.load, _inside(folder, path, found["files"][_MAP])))
        if kind == "reference" and noise is not None:
            layer = replace(layer, noise=LayerNoise(float(noise["mean"]), float(noise["p99"])))
        layers[kind] = layer
    said = layers["picture"].said
    name = RowName(str(found["material"]), str(found["illuminant"]), str(found["observer"]))
    name = name._replace(scene=said.get("scene", ""), view=said.get("camera", ""))
    figures = {key: float(found["delta_e94"][key]) for key in ("mean", "p95", "p99", "max")}
    return Row(name, layers, figures, tuple(str(note) for note in found["notes"]))


def _judged(load: Callable[[], Pixels], map_file: Path) -> Pixels:
    """Return the pixels judged by the review: in a scene of several materials a row is about one of them."""
    pixels = load()
    plane = read_exr(map_file)[1].get("deltaE94")
    if plane is None or plane.shape != pixels.coverage.shape:
        raise InputError(
            "not the map of its picture",
            file=map_file,
            field="deltaE94",
            found="no such channel" if plane is None else f"{plane.shape[1]} x {plane.shape[0]}",
            expected=f"{pixels.coverage.shape[1]} x {pixels.coverage.shape[0]}",
            hint="review again into this folder",
        )
    return replace(pixels, mask=~np.isnan(plane))


def _inside(folder: Path, path: Path, name: str) -> Path:
    """Return a file named by the figures, which must be in their folder."""
    file = folder / name
    if not file.resolve().is_relative_to(folder.resolve()):
        raise InputError("a file outside of the review", file=path, field="files", found=name, expected="a path inside")
    return file
