"""A match as a few lines of Markdown, for a merge request."""

from __future__ import annotations

from ..report.text_tables import escaped
from .page import UNKNOWN, MatchReport
from .tolerance import VERDICT_WORDS, Verdict

# So many samples are read in a merge request.
_MOST = 15
_SIGNS: dict[Verdict, str] = {"pass": "✅", "not resolved": "⚠️", "fail": "❌", "not judged": ""}


def as_markdown(report: MatchReport) -> str:
    """Return the sentence of the page, and the worst samples, each under the light that decides."""
    name = report.asked.judging.name
    lines = ["### " + f"{_SIGNS[report.verdict]} {escaped(report.standard.name)}".strip(), ""]
    lines += [f"{escaped(report.summary)}.", "", escaped(report.facts), ""]
    lines += [f"| sample | | ΔE {name} | ± | under | direction |", "|---|---|--:|--:|---|---|"]
    for one in report.worst_first[:_MOST]:
        worst = one.worst
        spread = "" if worst.spread is None else f"{worst.spread.delta_e[name]:.2f}"
        verdict = f"{_SIGNS[one.verdict]} {VERDICT_WORDS[one.verdict]}".strip()
        figures = f"{worst.delta_e[name]:.2f} | {spread} | {escaped(report.place(worst.conditions))} | {worst.words}"
        lines.append(f"| {escaped(one.sample.name)} | {verdict} | {figures} |")
    if len(report.samples) > _MOST:
        lines += ["", f"... and {len(report.samples) - _MOST} more samples."]
    told = (*report.crossed, *(() if report.asked.repeatability is not None else (UNKNOWN,)))
    return "\n".join([*lines, "", *(f"{escaped(words)}\n" for words in told)])
