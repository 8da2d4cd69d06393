"""A comparison as JUnit XML: a test case a row, so that a build server lists what failed."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from .result import Result, RowResult
from .words import verdict_words

# What XML 1.0 has no place for.
_ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def as_junit(result: Result) -> str:
    """A suite of the rows, of the criteria over rows, and of the check of itself. Warnings pass, and say so."""
    cases = [_row_case(row) for row in result.worst_first]
    for one in result.pooled:
        found = f"{one.criterion.label} ({one.of}) is {one.value:.4g}; {one.criterion.words}"
        cases.append(_case("over rows", f"{one.criterion.label} ({one.of})", one.tier, found))
    for check in result.checks:
        words = f"expected {check.expected:.4f}, found {check.found:.4f}"
        cases.append(_case("self-check", check.label, "pass" if check.passed else "fail", words))
    if not result.checks:
        cases.append(_case("self-check", "a known difference", "fail", "none could be put in"))
    failures = sum(case.find("failure") is not None for case in cases)
    attributes = {"name": "metamer report", "tests": str(len(cases)), "failures": str(failures), "errors": "0"}
    suite = ElementTree.Element("testsuite", attributes)
    suite.extend(cases)
    said = ElementTree.SubElement(suite, "system-out")
    said.text = _text(
        "\n".join([f"{result.before.path} against {result.after.path}", verdict_words(result), *result.notes])
    )
    suites = ElementTree.Element("testsuites", {key: attributes[key] for key in ("tests", "failures", "errors")})
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _row_case(row: RowResult) -> ElementTree.Element:
    lines = [f"{row.state}"]
    for kind, found in row.layers.items():
        lines.append(
            f"{kind}: ΔE94 mean {found.mean:.4f}, p95 {found.p95:.4f}, p99 {found.p99:.4f}, max {found.max:.4f}"
        )
    over = [one for one in row.asked if one.tier != "pass"]
    lines += [f"{one.tier}: {one.criterion.label} ({one.of}) is {one.value:.4g}; {one.criterion.words}" for one in over]
    return _case(row.name.material or "row", str(row.name), row.tier, "\n".join([*lines, *row.notes]))


def _case(of: str, name: str, tier: str, words: str) -> ElementTree.Element:
    case = ElementTree.Element("testcase", {"classname": _text(of), "name": _text(name)})
    if tier == "fail":
        failure = ElementTree.SubElement(case, "failure", {"message": _text(words.splitlines()[0])})
        failure.text = _text(words)
    elif tier == "warn":
        ElementTree.SubElement(case, "system-out").text = _text(f"warning: {words}")
    return case


def _text(words: str) -> str:
    return _ILLEGAL.sub("?", words)
