"""Machine-readable outputs of a comparison.

JSON, as docs/regression.md documents it; JUnit XML, a test case per row; a few lines of Markdown; a table for
spreadsheets.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ...runtime.sheets import Cell, csv_text, write_workbook
from ..report.junit_xml import Outcome, case_of, junit_text
from ..report.text_tables import escaped
from .causes import what_changed
from .criteria import Tier
from .result import AskedCriteria, Figures, Result, RowResult, SideWords
from .row import RowName
from .words import readable_names, shown_rows, verdict_words

_OUTCOMES: dict[Tier, Outcome] = {"pass": "passed", "warn": "warned", "fail": "failed"}
# Most rows that are read in a merge request.
_MOST = 15
_SIGNS = {"pass": "✅", "warn": "⚠️", "fail": "❌"}
#: Headings of the table, a line a layer of a row; ΔE is ΔE94.
HEADINGS = (
    *RowName._fields,
    "state",
    "status",
    "layer",
    "mean",
    "median",
    "p95",
    "p99",
    "max",
    "floor of mean",
    "floor of max",
    "shift L*",
    "shift a*",
    "shift b*",
    "pixels",
    "undefined pixels",
    "share reshaped",
    "approximation p99 before",
    "approximation p99 after",
    "notes",
)

SCHEMA = "metamer.regression/1"


def as_junit(result: Result) -> str:
    """Return a suite of the rows, of the criteria over rows, and of the self-test. Warnings pass, with a note."""
    cases = [_row_case(row) for row in result.worst_first]
    for one in result.pooled:
        found = f"{one.criterion.label} ({one.of}) is {one.value:.4g}; {one.criterion.words}"
        cases.append(case_of("over rows", f"{one.criterion.label} ({one.of})", _OUTCOMES[one.tier], found))
    for check in result.checks:
        words = f"expected {check.expected:.4f}, found {check.found:.4f}"
        cases.append(case_of("self-check", check.label, "passed" if check.passed else "failed", words))
    if not result.checks:
        cases.append(case_of("self-check", "a known difference", "failed", "none could be put in"))
    said = [f"{result.before.path} against {result.after.path}", verdict_words(result), *result.notes]
    return junit_text("metamer report", cases, "\n".join(said))


def _row_case(row: RowResult) -> ElementTree.Element:
    lines = [f"{row.state}"]
    for kind, found in row.layers.items():
        lines.append(
            f"{kind}: ΔE94 mean {found.mean:.4f}, p95 {found.p95:.4f}, p99 {found.p99:.4f}, max {found.max:.4f}"
        )
    over = [one for one in row.asked if one.tier != "pass"]
    lines += [f"{one.tier}: {one.criterion.label} ({one.of}) is {one.value:.4g}; {one.criterion.words}" for one in over]
    return case_of(row.name.material or "row", str(row.name), _OUTCOMES[row.tier], "\n".join([*lines, *row.notes]))


def as_markdown(result: Result) -> str:
    """Return the sentence of the page, and the worst rows with what changed."""
    lines = [f"### {_SIGNS[result.tier]} Did any colour move?", "", f"{escaped(verdict_words(result))}.", ""]
    shown, names = shown_rows(result), readable_names(result.rows)
    if shown:
        lines += ["ΔE94 of after against before:", ""]
        lines += ["| | | on average | 99 % within | at most | what changed |", "|---|---|--:|--:|--:|---|"]
    for row in shown[:_MOST]:
        # The layer that moved most tells of the row.
        moved = max(row.layers.values(), key=lambda one: one.mean, default=None)
        figures = ("", "", "") if moved is None else (f"{value:.2f}" for value in (moved.mean, moved.p99, moved.max))
        cells = (escaped(names[row.name]), _SIGNS[row.tier], *figures, what_changed(row)[0])
        lines.append(f"| {' | '.join(cells)} |")
    if len(shown) > _MOST:
        lines += ["", f"... and {len(shown) - _MOST} more."]
    for one in result.pooled:
        lines += ["", f"{_SIGNS[one.tier]} {escaped(one.criterion.label)} ({one.of}), over all: {one.value:.3f}"]
    if result.notes:
        lines += ["", *(f"- {escaped(note)}" for note in result.notes)]
    return "\n".join([*lines, ""])


def table(result: Result) -> Iterator[list[Cell]]:
    """Yield the lines under `HEADINGS`, the worst row first; None for empty cells."""
    for row in result.worst_first:
        for kind, figures in row.layers.items():
            yield _line(row, kind, figures)
        if not row.layers:
            yield _line(row, None, None)


def as_csv(result: Result) -> str:
    """Format the table by RFC 4180."""
    return csv_text(HEADINGS, table(result))


def write_xlsx(result: Result, path: Path) -> None:
    """Write the table as a workbook; raises as `write_workbook` does."""
    write_workbook(path, "regression", HEADINGS, table(result))


def _line(row: RowResult, kind: str | None, found: Figures | None) -> list[Cell]:
    off = row.approximation or (None, None)
    figures: list[Cell] = [None] * 13
    if found is not None:
        statistics = (found.mean, found.median, found.p95, found.p99, found.max, found.floor_mean, found.floor_max)
        figures = [*statistics, *found.shift, found.pixels, found.undefined, found.reshaped]
    return [*row.name, row.state, row.tier, kind, *figures, *off, " ".join(row.notes) or None]


def as_json(result: Result, version: str) -> str:
    """Format the document as JSON; numbers that are not finite become null."""
    return json.dumps(document(result, version), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def document(result: Result, version: str) -> dict[str, Any]:
    """Build the JSON document; rows are in their original order."""
    return {
        "schema": SCHEMA,
        "metamer": version,
        "status": result.tier if result.valid else "invalid",
        "identical": result.identical,
        "before": _side(result.before),
        "after": _side(result.after),
        "across": list(result.across),
        "notes": list(result.notes),
        "self_check": [
            {"what": one.label, "expected": one.expected, "found": _number(one.found), "passed": one.passed}
            for one in result.checks
        ],
        "criteria": [
            {
                "label": one.label,
                "statistic": one.statistic,
                "formula": one.formula.name,
                "warn": one.warn,
                "fail": one.fail,
                "of": list(one.of),
                "names": {part: list(patterns) for part, patterns in (one.names or {}).items()},
                "region": one.region,
                "over": "rows" if one.pooled else "pixels",
            }
            for one in result.criteria
        ],
        "over_rows": [_asked(one) for one in result.pooled],
        "results": [_row(row) for row in result.rows],
    }


def _side(side: SideWords) -> dict[str, Any]:
    return {"path": str(side.path), "kind": side.kind, "facts": dict(side.facts), "colour_chain": list(side.chain)}


def _row(row: RowResult) -> dict[str, Any]:
    return {
        **row.name._asdict(),
        "state": row.state,
        "status": row.tier,
        "layers": {kind: _figures(figures) for kind, figures in row.layers.items()},
        "criteria": [_asked(one) for one in row.asked],
        "approximation_p99": None if row.approximation is None else list(row.approximation),
        "notes": list(row.notes),
    }


def _figures(found: Figures) -> dict[str, Any]:
    statistics = {key: _number(getattr(found, key)) for key in ("mean", "median", "p95", "p99", "max")}
    floor = {"mean": _number(found.floor_mean), "max": _number(found.floor_max)}
    return {
        "delta_e94": statistics,
        "floor_delta_e94": floor,
        "pixels": found.pixels,
        "undefined_pixels": found.undefined,
        "reshaped": found.reshaped,
        "identical": found.identical,
        "moved": found.moved,
        "shift_lab": [_number(value) for value in found.shift],
        "worst_pixel": {
            "row": found.worst[0],
            "column": found.worst[1],
            "before_lab": [_number(value) for value in found.before_lab],
            "after_lab": [_number(value) for value in found.after_lab],
        },
    }


def _asked(one: AskedCriteria) -> dict[str, Any]:
    figures = {"value": _number(one.value), "floor": _number(one.floor), "resolved": one.resolved}
    return {"label": one.criterion.label, "of": one.of, **figures, "status": one.tier}


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
