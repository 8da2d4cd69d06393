"""A comparison as a few lines of Markdown, for a merge request."""

from __future__ import annotations

from ..report.text_tables import escaped
from .causes import what_changed
from .result import Result
from .words import readable_names, shown_rows, verdict_words

# So many rows are read in a merge request.
_MOST = 15
_SIGNS = {"pass": "✅", "warn": "⚠️", "fail": "❌"}


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
