"""Baseline: the accepted pictures of a suite. Small, the same bytes for the same pictures.

    DIR/baseline.json      what made it, every row, and the SHA-256 of its files: written last, and in one step
    DIR/pixels/HASH.exr    XYZ and coverage in half precision; HASH begins that SHA-256: no file is ever rewritten

If a process ends between the two, the old `baseline.json` remains, with all its files.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from ...runtime.errors import ComparisonError, InputError
from ...runtime.files import half_written, made_folder, read_bytes, read_text, written_whole
from ...runtime.locks import alone_at_work, remove_abandoned
from ...spectral.formats.exr import read_exr, write_exr
from .picture_files import read_xyz
from .row import FLOAT32_ROUNDOFF, HALF_ROUNDOFF, ComparedSide, LayerKind, LayerNoise, PixelLayer, Pixels, Row, RowName

MANIFEST, PIXELS = "baseline.json", "pixels"
SCHEMA = "metamer.baseline/1"
#: Sentence on the precision of stored pixels.
QUANTISATION = (
    "XYZ in half precision, each number within 1/2048 of itself; in single precision where a highlight is above 65504"
)
# The largest number of half precision.
_LARGEST_HALF = 65504.0
_DIGITS = 32
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class BaselineContent:
    """Content of `baseline.json`: name and hash of the suite, relevant facts of the machine; rows as JSON."""

    suite: Mapping[str, str]
    environment: Mapping[str, str]
    facts: Mapping[str, str]
    chain: tuple[str, ...]
    rows: tuple[Mapping[str, Any], ...]


def record(
    side: ComparedSide,
    folder: Path,
    suite: Mapping[str, str],
    environment: Mapping[str, str],
    progress: Progress = lambda done, total, what: None,
) -> None:
    """Write a side as a baseline, replacing an existing one.

    Raises
    ------
    ComparisonError : the existing one is of another suite.
    InputError : the folder cannot be written to, is full, or another process writes to it.
    """
    check_place(folder, suite)
    with changing(folder):
        rows = []
        for number, row in enumerate(side.rows):
            rows.append(_recorded(row, folder))
            progress(number + 1, len(side.rows), str(row.name))
        put(folder, BaselineContent(suite, environment, side.facts, side.chain, tuple(rows)))


def check_place(folder: Path, suite: Mapping[str, str]) -> None:
    """Raise `ComparisonError` if a baseline, or a run, of another suite is in the folder."""
    if (folder / MANIFEST).is_file():
        check_suite(folder, read_kept(folder).suite, "what is to be recorded there", suite)


def check_suite(folder: Path, ours: Mapping[str, str], other: Path | str, theirs: Mapping[str, str]) -> None:
    """Raise `ComparisonError` if a folder belongs to a different suite."""
    if ours.get("name") != theirs.get("name"):
        raise ComparisonError(
            f"{folder} is of another suite\n"
            f"  found: {ours.get('name')!r}; and {theirs.get('name')!r} in {other}\n"
            "  expected: one suite for both; another folder, or another name in [suite]"
        )


@contextmanager
def changing(folder: Path) -> Iterator[None]:
    """Lock a baseline for writing, and remove half-written leftovers of a killed process."""
    made_folder(folder)
    made_folder(folder / PIXELS)
    with alone_at_work(folder, "another process writes to this baseline"):
        for stray in half_written(folder):
            remove_abandoned(stray)
        yield


def put(folder: Path, kept: BaselineContent) -> None:
    """Write `baseline.json` in one step, and then remove files that no row refers to."""
    document = {
        "schema": SCHEMA,
        "suite": dict(kept.suite),
        "quantisation": QUANTISATION,
        "environment": dict(kept.environment),
        "facts": dict(kept.facts),
        "colour_chain": list(kept.chain),
        "rows": [dict(row) for row in kept.rows],
    }
    with written_whole(folder / MANIFEST) as beside:
        beside.write_text(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8")
    named = {layer["sha256"][:_DIGITS] for row in kept.rows for layer in row["layers"].values()}
    for file in (folder / PIXELS).glob("*.exr"):
        if file.stem not in named:
            file.unlink()


def read_kept(folder: Path) -> BaselineContent:
    """Read `baseline.json`.

    Raises
    ------
    InputError : it is missing, damaged or of another schema.
    """
    path = folder / MANIFEST
    if not path.is_file():
        hint = f"record one: metamer report baseline SUITE -o {folder}"
        raise InputError("no baseline", file=folder, expected=f"a folder that holds {MANIFEST}", hint=hint)
    try:
        found = json.loads(read_text(path))
        schema = found["schema"]
        kept = BaselineContent(
            found["suite"], found["environment"], found["facts"], tuple(found["colour_chain"]), tuple(found["rows"])
        )
    except (ValueError, KeyError, TypeError) as reason:
        raise _damaged(path, f"{type(reason).__name__}: {reason}") from None
    if schema != SCHEMA:
        raise InputError("a baseline of another schema", file=path, field="schema", found=schema, expected=SCHEMA)
    return kept


def baseline_side(folder: Path) -> ComparedSide:
    """Return a baseline as a side.

    Raises
    ------
    InputError : as `read_kept`, and on loading pixels whose file differs from the recorded one.
    """
    kept = read_kept(folder)
    try:
        rows = tuple(_row(folder, found) for found in kept.rows)
    except (KeyError, TypeError, ValueError, AttributeError) as reason:
        raise _damaged(folder / MANIFEST, f"{type(reason).__name__}: {reason}") from None
    return ComparedSide(folder, "baseline", rows, {**kept.facts, **kept.environment}, kept.chain)


def as_recorded(side: ComparedSide) -> ComparedSide:
    """Return a side with pixels rounded as in a baseline, so that equal pictures are equal bytes."""
    rows = tuple(
        replace(
            row,
            layers={kind: replace(layer, load=partial(_rounded, layer.load)) for kind, layer in row.layers.items()},
        )
        for row in side.rows
    )
    return replace(side, rows=rows)


def _damaged(path: Path, found: str) -> InputError:
    hint = "take it back from version control, or record it again: metamer report baseline"
    return InputError("the baseline is damaged", file=path, found=found, expected="as it was recorded", hint=hint)


def _stored(xyz: Float[np.ndarray, "H W 3"]) -> np.ndarray:
    """Round to half precision if it can represent the largest number, else to single."""
    finite = xyz[np.isfinite(xyz)]
    largest = np.abs(finite).max(initial=0.0)
    return np.asarray(xyz, dtype=np.float16 if largest <= _LARGEST_HALF else np.float32)


def _rounded(load: Callable[[], Pixels]) -> Pixels:
    pixels = load()
    stored = _stored(pixels.xyz)
    roundoff = HALF_ROUNDOFF if stored.dtype == np.float16 else FLOAT32_ROUNDOFF
    return replace(
        pixels,
        xyz=stored.astype(np.float32),
        coverage=pixels.coverage.astype(np.float32),
        white_xyz=pixels.white_xyz.astype(np.float32).astype(np.float64),
        unit_roundoff=max(roundoff, pixels.unit_roundoff),
    )


def _recorded(row: Row, folder: Path) -> dict[str, Any]:
    """Write the files of a row; return its entry in the manifest."""
    layers = {}
    for kind, layer in row.layers.items():
        pixels = layer.load()
        noise = None if layer.noise is None else {"mean": layer.noise.mean, "p99": layer.noise.p99}
        layers[kind] = {"sha256": _written(pixels, folder), "noise": noise}
    return {
        **row.name._asdict(),
        "layers": layers,
        "approximation": None if row.approximation is None else dict(row.approximation),
        "notes": list(row.notes),
    }


def _written(pixels: Pixels, folder: Path) -> str:
    """Write the pixels under the name of their hash; return the SHA-256."""
    stored = _stored(pixels.xyz)
    channels = {name: stored[..., index] for index, name in enumerate("XYZ")}
    channels["A"] = pixels.coverage.astype(np.float32)
    if pixels.mask is not None:
        channels["judged"] = pixels.mask.astype(np.float16)
    passing = folder / PIXELS / ".passing.exr"
    try:
        write_exr(passing, {"whiteXYZ": pixels.white_xyz.astype(np.float32)}, channels)
        digest = hashlib.sha256(passing.read_bytes()).hexdigest()
        passing.replace(pixel_file(folder, digest))
    finally:
        passing.unlink(missing_ok=True)
    return digest


def pixel_file(folder: Path, sha256: str) -> Path:
    """Return the file of that hash; raises `ValueError` for an invalid hash."""
    if len(sha256) != 64 or set(sha256) - set("0123456789abcdef"):
        raise ValueError(f"no SHA-256: {sha256[:80]!r}")
    return folder / PIXELS / f"{sha256[:_DIGITS]}.exr"


def _row(folder: Path, found: Mapping[str, Any]) -> Row:
    name = RowName(*(str(found[part]) for part in RowName._fields))
    layers: dict[LayerKind, PixelLayer] = {}
    for kind, held in found["layers"].items():
        noise = None if held["noise"] is None else LayerNoise(float(held["noise"]["mean"]), float(held["noise"]["p99"]))
        path = pixel_file(folder, held["sha256"])
        layers[cast(LayerKind, kind)] = PixelLayer(partial(_read, path, held["sha256"]), path, {}, noise)
    off = found["approximation"]
    off = None if off is None else {key: float(value) for key, value in off.items()}
    return Row(name, layers, off, tuple(str(note) for note in found["notes"]))


def _read(path: Path, sha256: str) -> Pixels:
    """Read the pixels, verified by their hash."""
    digest = hashlib.sha256(read_bytes(path, "pixels of a baseline")).hexdigest()
    if digest != sha256:
        raise _damaged(path, f"SHA-256 {digest[:12]}..., not {sha256[:12]}...")
    pixels = read_xyz(path)
    judged = read_exr(path)[1].get("judged")
    return pixels if judged is None else replace(pixels, mask=judged > 0)
