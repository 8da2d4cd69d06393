"""A match as a few lines of Markdown, for a merge request."""

from __future__ import annotations

from ..report.text_tables import escaped
from .page import MatchReport
from .pairs import WORST_FIRST
from .tolerance import Verdict

# So many samples are read in a merge request.
_MOST = 15
_SIGNS: dict[Verdict, str] = {"pass": "✅", "not resolved": "⚠️", "fail": "❌", "not judged": ""}


def as_markdown(report: MatchReport) -> str:
    """The verdict, and the worst samples, each under the light that decides."""
    name = report.asked.judging.name
    head = f"{_SIGNS[report.verdict]} {escaped(report.standard.name)}: {report.verdict}".strip()
    counts = ", ".join(f"{count} {verdict}" for verdict, count in report.counts.items())
    lines = [f"### {head}", "", f"{counts}. {escaped(report.summary)}.", ""]
    lines += [f"| sample | | ΔE {name} | ± | under | direction |", "|---|---|--:|--:|---|---|"]
    samples = sorted(report.samples, key=lambda one: (WORST_FIRST.index(one.verdict), -one.worst.delta_e[name]))
    for one in samples[:_MOST]:
        worst = one.worst
        spread = "" if worst.spread is None else f"{worst.spread.delta_e[name]:.2f}"
        verdict = f"{_SIGNS[one.verdict]} {one.verdict}".strip()
        figures = f"{worst.delta_e[name]:.2f} | {spread} | {escaped(worst.conditions.words)} | {worst.words}"
        lines.append(f"| {escaped(one.sample.name)} | {verdict} | {figures} |")
    if len(samples) > _MOST:
        lines += ["", f"... and {len(samples) - _MOST} more samples."]
    return "\n".join([*lines, "", *(f"- {escaped(words)}" for words in report.notes), ""])
