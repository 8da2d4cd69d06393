"""A match as JUnit XML, a test case a sample, for build servers; and as a few lines of Markdown, for merge requests."""

from __future__ import annotations

from xml.etree import ElementTree

from ..report.junit_xml import Outcome, case_of, junit_text
from ..report.text_tables import escaped
from .page import UNKNOWN, MatchReport
from .pairs import MatchedPairs
from .tolerance import VERDICT_WORDS, Verdict

# Nobody knows whether what is not resolved is right, and nobody has asked whether what is not judged is.
_OUTCOMES: dict[Verdict, Outcome] = {
    "pass": "passed",
    "fail": "failed",
    "not resolved": "skipped",
    "not judged": "skipped",
}
# So many samples are read in a merge request.
_MOST = 15
_SIGNS: dict[Verdict, str] = {"pass": "✅", "not resolved": "⚠️", "fail": "❌", "not judged": ""}


def as_junit(report: MatchReport) -> str:
    """Return a suite of the samples, in the order given."""
    said = [f"Standard: {report.standard.name} of {report.standard.source}.", *report.notes]
    return junit_text("metamer match", [_case(report, one) for one in report.samples], "\n".join(said))


def _case(report: MatchReport, one: MatchedPairs) -> ElementTree.Element:
    name = report.asked.judging.name
    lines = [f"{one.verdict}: ΔE {name} {one.worst.delta_e[name]:.2f} under {one.worst.conditions.words}"]
    for found in one.differences:
        spread = "" if found.spread is None else f" ± {found.spread.delta_e[name]:.2f}"
        lines.append(f"{found.conditions.words}: {found.verdict}, {found.delta_e[name]:.2f}{spread}, {found.words}")
    return case_of(report.standard.name, one.sample.name, _OUTCOMES[one.verdict], "\n".join(lines))


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
