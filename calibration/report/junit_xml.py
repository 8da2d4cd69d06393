"""JUnit XML, as build servers read it: cases, and the document that holds them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal
from xml.etree import ElementTree

# Characters that XML 1.0 does not allow.
_ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

Outcome = Literal["passed", "warned", "failed", "skipped"]


def case_of(of: str, name: str, outcome: Outcome, words: str) -> ElementTree.Element:
    """Make one test case; `words` state why it failed or was skipped. Warnings pass, with a note."""
    case = ElementTree.Element("testcase", {"classname": _text(of), "name": _text(name)})
    if outcome in ("failed", "skipped"):
        kind = "failure" if outcome == "failed" else "skipped"
        reason = ElementTree.SubElement(case, kind, {"message": _text(words.splitlines()[0])})
        reason.text = _text(words)
    elif outcome == "warned":
        ElementTree.SubElement(case, "system-out").text = _text(f"warning: {words}")
    return case


def junit_text(name: str, cases: Sequence[ElementTree.Element], said: str) -> str:
    """Return a document of one suite; `said` is its output."""
    failures, skipped = (sum(case.find(kind) is not None for case in cases) for kind in ("failure", "skipped"))
    counts = {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "skipped": str(skipped)}
    suite = ElementTree.Element("testsuite", {"name": _text(name), **counts})
    suite.extend(cases)
    ElementTree.SubElement(suite, "system-out").text = _text(said)
    suites = ElementTree.Element("testsuites", counts)
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _text(words: str) -> str:
    return _ILLEGAL.sub("?", words)
