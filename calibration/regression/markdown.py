"""A comparison as a few lines of Markdown, for a merge request."""

from __future__ import annotations

from ..report.text_tables import escaped
from .result import STATES, Result
from .words import common_parts, short_name, shown_rows, verdict_words

# So many rows are read in a merge request.
_MOST = 15
_SIGNS = {"pass": "✅", "warn": "⚠️", "fail": "❌"}


def as_markdown(result: Result) -> str:
    """The verdict, how many rows went which way, and the worst of them."""
    lines = [f"### {_SIGNS[result.tier]} Colour: {escaped(verdict_words(result))}", ""]
    counts = [f"{result.count(state)} {state}" for state in STATES if result.count(state)]
    lines += [f"{', '.join(counts)}. ΔE94 of after against before:", ""]
    shown, common = shown_rows(result), common_parts(result.rows)
    if shown:
        lines += ["| row | state | | layer | mean | p99 | max |", "|---|---|---|---|--:|--:|--:|"]
    for row in shown[:_MOST]:
        start = f"| {escaped(short_name(row, common))} | {row.state} | {_SIGNS[row.tier]} {row.tier} |"
        lines += [
            f"{start} {kind} | {found.mean:.3f} | {found.p99:.3f} | {found.max:.3f} |"
            for kind, found in row.layers.items()
            if not found.identical
        ] or [f"{start} | | | |"]
    if len(shown) > _MOST:
        lines += ["", f"... and {len(shown) - _MOST} more rows."]
    for one in result.pooled:
        lines += ["", f"{_SIGNS[one.tier]} {escaped(one.criterion.label)} ({one.of}), over all rows: {one.value:.3f}"]
    lines += [f"- {escaped(note)}" for note in result.notes]
    checks = "; ".join(f"{one.expected:.3f} put in, {one.found:.3f} found" for one in result.checks)
    return "\n".join([*lines, "", f"Check of itself: {checks or 'none could be made'}.", ""])
