"""The review report: one self-contained page for the person who signs the colour, and the same figures as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, UInt8

from ..spectral.errors import ComparisonError, InputError
from ..spectral.files import made_folder, written_whole
from . import coded_map, plots
from .statistics import DeltaEStatistics, SelfCheck, verdict

SCHEMA = "metamer.review/1"


@runtime_checkable
class Plan(Protocol):
    """What the report says of a scene plan."""

    @property
    def basis_size(self) -> int:
        """Number of spectral coefficients that the pictures were computed with."""
        ...

    @property
    def reasons(self) -> Sequence[str]:
        """Why that many, in words and numbers."""
        ...


@dataclass(frozen=True, eq=False)
class RowColour:
    """The colour of a material's original data under the light of a row, for the row's observer.

    Parameters
    ----------
    xyz : Y = 1 for the perfect diffuser.
    lab : CIELAB relative to the row's white.
    geometry : how it is lit and seen, such as "45a:0".
    """

    xyz: Float[np.ndarray, "3"]
    lab: Float[np.ndarray, "3"]
    geometry: str


@dataclass(frozen=True, eq=False)
class ReviewRow:
    """One material under one light; make it with `review_row`, which encodes the pictures and lets the arrays go.

    Parameters
    ----------
    material, illuminant, observer : names.
    statistics : ΔE94 over the compared pixels.
    image : picture file, relative to the report's folder.
    picture, reference : lossless WebP files, as shown on the page, of `width` x `height` pixels.
    delta_e_map : PNG of the same size, as of `coded_map`.
    reduced : how many pixels in a row became one of these.
    seconds : how long each step took, by its name.
    files : further files beside the page by their label, relative to its folder.
    wavelengths_nm, reflectance : (L,) curve of the material, or None; `reflectance_label` says what was measured.
    colour : of the original data under this light, or None; `swatch` is the same, display-encoded.
    white_xyz : white of this light for this observer.
    notes : what has to be said of this row: clipped pixels, extrapolated wavelengths, missing numbers.
    provenance : where the material comes from, as label and text.
    """

    material: str
    illuminant: str
    observer: str
    statistics: DeltaEStatistics
    image: str
    picture: bytes
    reference: bytes
    delta_e_map: bytes
    width: int
    height: int
    reduced: int = 1
    seconds: Mapping[str, float] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    wavelengths_nm: Float[np.ndarray, "L"] | None = None
    reflectance: Float[np.ndarray, "L"] | None = None
    reflectance_label: str = "Reflectance"
    swatch: tuple[int, int, int] | None = None
    colour: RowColour | None = None
    white_xyz: Float[np.ndarray, "3"] | None = None
    notes: tuple[str, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)


def review_row(
    material: str,
    illuminant: str,
    observer: str,
    *,
    statistics: DeltaEStatistics,
    picture: UInt8[np.ndarray, "H W 3"],
    reference: UInt8[np.ndarray, "H W 3"],
    delta_e: Float[np.ndarray, "H W"],
    budget: float,
    rows: int,
    image: str,
    **more: Any,
) -> ReviewRow:
    """A row from display-encoded pictures and a ΔE map (NaN: not compared, infinite: no number).

    `rows` is how many rows the report will have: with many, the embedded pictures are reduced to keep the page quick
    to open (linear light for pictures, the largest value for maps) and a note says so. `more` goes to `ReviewRow`.

    Raises
    ------
    ComparisonError : picture and reference are the same array.
    """
    if np.may_share_memory(picture, reference):
        raise ComparisonError(f"{material} under {illuminant}: picture and reference are the same array")
    factor = plots.reduction(max(delta_e.shape), plots.embedded_side(rows))
    notes = [*more.pop("notes", ())]
    if factor > 1:
        notes.append(f"Shown at 1/{factor} of its size; the figures are those of the full picture.")
    if statistics.max == 0.0:
        notes.append("Every compared pixel is exactly equal: make sure that the reference is computed independently.")
    if statistics.undefined:
        notes.append(f"{statistics.undefined} compared pixels hold no number; they are in none of the figures.")
    reduced = plots.reduce_map(delta_e, factor)
    return ReviewRow(
        material=material,
        illuminant=illuminant,
        observer=observer,
        statistics=statistics,
        image=image,
        picture=plots.lossless(plots.reduce_picture(picture, factor)),
        reference=plots.lossless(plots.reduce_picture(reference, factor)),
        delta_e_map=coded_map.map_png(reduced, budget),
        width=reduced.shape[1],
        height=reduced.shape[0],
        reduced=factor,
        notes=tuple(notes),
        **more,
    )


def write_report(
    folder: str | Path,
    rows: Sequence[ReviewRow],
    plan: Plan,
    renderer_name: str,
    budget: float,
    chain_words: Sequence[str],
    version: str,
    *,
    checks: Sequence[SelfCheck],
    title: str = "Colour review",
    formula: str = "CIE 1994",
    created: str | None = None,
    warnings: Sequence[str] = (),
) -> tuple[Path, Path]:
    """Write `index.html` and `review.json` into `folder`; returns both paths.

    Parameters
    ----------
    rows : in the order of the review; rows of one material make one card, and the page shows the worst card first.
    chain_words : the colour chain from spectrum to display, a sentence each.
    checks : from `statistics.self_check` on one of the references; the page shows them and fails without them.
    created : when, as ISO 8601; now by default.
    warnings : why pictures of this review may show nothing, a line each; they stand on top of the page.

    Raises
    ------
    InputError : no rows, a budget that is not positive, or a folder that cannot be written to.
    """
    if not rows:
        raise InputError("a report without rows", field="rows", found="none", expected="at least one material")
    if not (math.isfinite(budget) and budget > 0):
        raise InputError("the budget is not a colour difference", field="budget", found=budget, expected="ΔE94 > 0")
    document = {
        "schema": SCHEMA,
        "metamer": version,
        "created": created or datetime.now(UTC).isoformat(timespec="seconds"),
        "renderer": renderer_name,
        "status": status(rows, budget, checks),
        "budget_delta_e94": float(budget),
        "formula": formula,
        "plan": {"basis_size": int(plan.basis_size), "reasons": [str(reason) for reason in plan.reasons]},
        "warnings": [str(line) for line in warnings],
        "colour_chain": [str(words) for words in chain_words],
        "self_check": [
            {"what": check.label, "expected": check.expected, "found": check.found, "passed": check.passed}
            for check in checks
        ],
        "results": [_result(row, budget) for row in rows],
    }
    from .page import render_page

    folder = made_folder(folder)
    figures = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    for path, text in (
        (folder / "review.json", figures),
        (folder / "index.html", render_page(document, rows, title)),
    ):
        with written_whole(path) as beside:
            beside.write_text(text, encoding="utf-8")
    return folder / "index.html", folder / "review.json"


def status(rows: Sequence[ReviewRow], budget: float, checks: Sequence[SelfCheck]) -> str:
    """The worst verdict of all rows; `invalid` where the report's check of itself is missing or failed."""
    if not checks or not all(check.passed for check in checks):
        return "invalid"
    found = {verdict(row.statistics, budget) for row in rows}
    return next(word for word in ("over", "near", "pass") if word in found)


def _result(row: ReviewRow, budget: float) -> dict[str, Any]:
    figures = row.statistics
    return {
        "material": row.material,
        "illuminant": row.illuminant,
        "observer": row.observer,
        "status": verdict(figures, budget),
        "delta_e94": {"mean": figures.mean, "p95": figures.p95, "p99": figures.p99, "max": figures.max},
        "pixels": figures.pixels,
        "undefined_pixels": figures.undefined,
        "image": row.image,
        "files": dict(row.files),
        "seconds": {step: float(seconds) for step, seconds in row.seconds.items()},
        "white_xyz": None if row.white_xyz is None else row.white_xyz.tolist(),
        "colour": None if row.colour is None else _colour(row.colour),
        "notes": list(row.notes),
    }


def _colour(colour: RowColour) -> dict[str, Any]:
    return {"xyz": colour.xyz.tolist(), "lab": colour.lab.tolist(), "geometry": colour.geometry}
