"""A match as JUnit XML: a test case a sample, so that a build server lists what failed."""

from __future__ import annotations

from xml.etree import ElementTree

from ..report.junit_xml import Outcome, case_of, junit_text
from .page import MatchReport
from .pairs import MatchedPairs
from .tolerance import Verdict

# Nobody knows whether what is not resolved is right, and nobody has asked whether what is not judged is.
_OUTCOMES: dict[Verdict, Outcome] = {
    "pass": "passed",
    "fail": "failed",
    "not resolved": "skipped",
    "not judged": "skipped",
}


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
