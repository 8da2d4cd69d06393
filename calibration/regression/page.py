"""The page of a comparison: the verdict first, then the worst rows with their pictures, and every row as a line."""

from __future__ import annotations

import math
from typing import Any

from .. import plots
from ..page import html_environment
from .result import STATES, Result, RowResult
from .row import LayerKind, Row, Side
from .shown import Shown, shown
from .words import common_parts, short_name, shown_rows, verdict_words

# So many rows are shown as pictures.
MOST_CARDS = 24
_LABELS = {"pass": ("✓", "pass"), "warn": ("▲", "near"), "fail": ("✕", "over")}


def render_page(result: Result, before: Side, after: Side, version: str) -> str:
    """One HTML page without anything from outside.

    Raises
    ------
    InputError : a picture that has gone since it was compared.
    """
    wanted = [row for row in shown_rows(result) if row.layers][:MOST_CARDS]
    limit = _limit(result)
    side = plots.embedded_side(max(len(wanted), 1))
    sides: list[dict[Any, Row]] = [{row.name: row for row in one.rows} for one in (before, after)]
    single = len(result.rows) == 1
    cards = []
    for row in wanted:
        a = sides[0][row.name]
        # Two single pictures are a pair whatever the second is called.
        b = next(iter(sides[1].values())) if single else sides[1][row.name]
        cards.append({"row": row, "pictures": _pictures(row, a, b, limit, side)})
    common = common_parts(result.rows)
    environment = html_environment(name=lambda row: short_name(row, common), id=id)
    return environment.get_template("regression.html").render(
        result=result,
        verdict=verdict_words(result),
        labels=_LABELS,
        counts={state: result.count(state) for state in STATES if result.count(state)},
        common=str(common) if any(common) else "",
        cards=cards,
        anchors={id(card["row"]): f"r{index}" for index, card in enumerate(cards)},
        top=f"{plots.SCALE_BUDGETS * limit:.3g}",
        gradient=plots.scale_words(limit)["gradient"],
        version=version,
    )


def _pictures(row: RowResult, a: Row, b: Row, limit: float, side: int) -> list[Shown]:
    """The layers that moved; where nothing did, those that there are."""
    moved: list[LayerKind] = [kind for kind, found in row.layers.items() if found.moved]
    return [shown(a, b, kind, limit, side) for kind in moved or row.layers]


def _limit(result: Result) -> float:
    """A third of the ΔE94 that the maps' scale ends at: the largest p99 of a layer that moved, and 0.1 at least."""
    largest = max((found.p99 for row in result.rows for found in row.layers.values() if found.moved), default=0.0)
    return max(0.1, largest if math.isfinite(largest) else 0.0) / plots.SCALE_BUDGETS
