"""A comparison as JUnit XML: a test case a row, so that a build server lists what failed."""

from __future__ import annotations

from xml.etree import ElementTree

from ..report.junit_xml import Outcome, case_of, junit_text
from .criteria import Tier
from .result import Result, RowResult
from .words import verdict_words

_OUTCOMES: dict[Tier, Outcome] = {"pass": "passed", "warn": "warned", "fail": "failed"}


def as_junit(result: Result) -> str:
    """Return a suite of the rows, of the criteria over rows, and of the check of itself. Warnings pass, and say so."""
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
