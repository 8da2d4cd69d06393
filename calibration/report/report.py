"""Review report: one self-contained page for signature, and the same figures as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from ...runtime.errors import InputError
from ...runtime.files import made_folder, written_whole
from ...runtime.json_text import indented_json
from .history import HISTORY, Run, history_text, with_run
from .page import render_page
from .rating import Rating, as_json
from .review_facts import (
    ADAPTED,
    LitColour,
    ReviewedLight,
    ReviewedMaterial,
    light_document,
    lights_of_rows,
    material_document,
    materials_of_rows,
    shift_document,
)
from .review_words import facts_sentence, summary_of, verdict_sentence
from .row import ReferenceNoise, ReviewRow, RowColour, WorstPixel
from .statistics import SelfCheck, verdict

SCHEMA = "metamer.review/2"


@runtime_checkable
class Plan(Protocol):
    """Scene plan as stated by the report."""

    @property
    def basis_size(self) -> int:
        """Number of spectral coefficients that the pictures were computed with."""
        ...

    @property
    def reasons(self) -> Sequence[str]:
        """Reasons for that number, in words and figures."""
        ...


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
    history: Sequence[Run] = (),
    ratings: Sequence[Rating] = (),
    materials: Sequence[ReviewedMaterial] = (),
    lights: Sequence[ReviewedLight] = (),
    display: str = "sRGB - Display",
) -> tuple[Path, Path]:
    """Write `index.html`, `review.json` and `history.json` into `folder`; returns the first two paths.

    Parameters
    ----------
    rows : in the order of the review; rows of one material make one card, and the page shows the worst card first.
    chain_words : the colour chain from spectrum to display, a sentence each.
    checks : from `statistics.self_check` on one of the references; the page shows them and fails without them.
    created : when, as ISO 8601; now by default.
    warnings : why pictures of this review may show nothing, a line each; they stand on top of the page.
    history : earlier runs; this one is added to them.
    ratings : a reviewer's protocol, which has a section of its own.
    materials, lights : facts about them; by default those of the rows.
    display : name of the display that pictures are encoded for.

    Raises
    ------
    InputError : no rows, a budget that is not positive, or a folder that cannot be written to.
    """
    if not rows:
        raise InputError("a report without rows", field="rows", found="none", expected="at least one material")
    if not (math.isfinite(budget) and budget > 0):
        raise InputError("the budget is not a colour difference", field="budget", found=budget, expected="ΔE94 > 0")
    materials, lights = materials or materials_of_rows(rows), lights or lights_of_rows(rows)
    by_id = {one.id: one for one in materials}
    said, facts = verdict_of(rows, budget, display, checks)
    document = {
        "schema": SCHEMA,
        "metamer": version,
        "created": created or datetime.now(UTC).isoformat(timespec="seconds"),
        "renderer": renderer_name,
        "status": status(rows, budget, checks),
        "verdict": said,
        "facts": facts,
        "summary": summary_of(rows, budget),
        "display": display,
        "budget_delta_e94": float(budget),
        "formula": formula,
        "plan": {"basis_size": int(plan.basis_size), "reasons": [str(reason) for reason in plan.reasons]},
        "warnings": [str(line) for line in warnings],
        "colour_chain": [str(words) for words in chain_words],
        "self_check": [
            {"what": check.label, "expected": check.expected, "found": check.found, "passed": check.passed}
            for check in checks
        ],
        "protocol": as_json(ratings),
        "lights": [light_document(one) for one in lights],
        "materials": [material_document(one) for one in materials],
        "results": [_result(row, budget, by_id[row.material].under(row.illuminant, row.observer)) for row in rows],
    }
    folder = made_folder(folder)
    figures = indented_json(document) + "\n"
    p99 = {row.name: row.statistics.p99 for row in rows}
    runs = with_run(history, Run(document["created"], version, document["status"], p99))
    for path, text in (
        (folder / "review.json", figures),
        (folder / HISTORY, history_text(runs)),
        (folder / "index.html", render_page(document, rows, title, runs)),
    ):
        with written_whole(path) as beside:
            beside.write_text(text, encoding="utf-8")
    return folder / "index.html", folder / "review.json"


def status(rows: Sequence[ReviewRow], budget: float, checks: Sequence[SelfCheck]) -> str:
    """Return the worst verdict of all rows; `invalid` if the report's self-check is missing or failed."""
    if not checks or not all(check.passed for check in checks):
        return "invalid"
    found = {verdict(row.statistics, budget) for row in rows}
    return next(word for word in ("over", "near", "pass") if word in found)


def verdict_of(rows: Sequence[ReviewRow], budget: float, display: str, checks: Sequence[SelfCheck]) -> tuple[str, str]:
    """Return the opening sentences of a review, for page, print and terminal."""
    summary, valid = summary_of(rows, budget), status(rows, budget, checks) != "invalid"
    undefined = sum(row.statistics.undefined for row in rows)
    return verdict_sentence(summary, display, valid), facts_sentence(summary, budget, undefined)


def _result(row: ReviewRow, budget: float, lit: LitColour | None) -> dict[str, Any]:
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
        "colour": None if row.colour is None else _colour(row.colour, lit),
        "shift": None if lit is None else shift_document(lit.shift),
        "limits": None if row.limits is None else asdict(row.limits),
        "shift_lab": None if row.shift is None else list(row.shift),
        "worst_pixel": None if row.worst is None else _worst(row.worst),
        "reference_noise": None if row.noise is None else _noise(row.noise),
        "notes": list(row.notes),
    }


def _worst(worst: WorstPixel) -> dict[str, Any]:
    curves = {
        "wavelengths_nm": worst.wavelengths_nm,
        "reference_factor": worst.reference_factor,
        "picture_factor": worst.picture_factor,
    }
    return {
        "place": list(worst.place),
        "delta_e94": worst.delta_e94,
        "reference_lab": worst.reference_lab.tolist(),
        "picture_lab": worst.picture_lab.tolist(),
        **{name: None if values is None else values.tolist() for name, values in curves.items()},
    }


def _noise(noise: ReferenceNoise) -> dict[str, Any]:
    figures = {"mean": noise.mean, "p99": noise.p99, "aimed": noise.aimed}
    return {**figures, "directions": noise.directions, "limited": noise.limited}


def _colour(colour: RowColour, lit: LitColour | None) -> dict[str, Any]:
    lab = colour.lab.tolist()
    around = [
        {"aspecular": angle, "xyz": xyz.tolist(), "lab": there.tolist(), "lch": _lch(*there.tolist())}
        for angle, xyz, there in colour.around
    ]
    adapted = None if lit is None or lit.adapted_lab is None else lit.adapted_lab.tolist()
    found = {"xyz": colour.xyz.tolist(), "lab": lab, "lch": _lch(*lab), "geometry": colour.geometry, "around": around}
    return found | {"adapted_lab": adapted, "adaptation": ADAPTED}


def _lch(lightness: float, a: float, b: float) -> list[float]:
    """Compute L*, C*ab and hue angle from 0 up to 360 degrees (CIE 015:2018 eq. 8.11-8.12); a grey's hue is 0."""
    hue = math.degrees(math.atan2(b, a)) % 360.0
    return [lightness, math.hypot(a, b), hue if hue < 360.0 else 0.0]  # a hair below 0 comes out as 360
