"""A comparison as JSON: `metamer.regression/1`, as docs/regression.md lists it."""

from __future__ import annotations

import json
import math
from typing import Any

from .result import AskedCriteria, Figures, Result, RowResult, SideWords

SCHEMA = "metamer.regression/1"


def as_json(result: Result, version: str) -> str:
    """Return the document; numbers are finite, what is not is null."""
    return json.dumps(document(result, version), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def document(result: Result, version: str) -> dict[str, Any]:
    """Return the same before it is text. Rows stand in their order, not the worst first."""
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
