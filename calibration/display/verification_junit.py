"""A verification as JUnit XML: a test case a criterion, so that a build server lists what failed."""

from __future__ import annotations

from xml.etree import ElementTree

from .verification import Verification


def verification_junit(found: Verification) -> str:
    """Write a verification as JUnit XML; a figure that is not resolved counts as failed."""
    failed = ("fail", "not resolved")
    failures = sum(row.verdict in failed for row in found.rows)
    suite = ElementTree.Element(
        "testsuite",
        {"name": f"metamer display verify: {found.record.name}", "tests": str(len(found.rows)),
         "failures": str(failures), "errors": "0"},
    )  # fmt: skip
    for row in found.rows:
        case = ElementTree.SubElement(suite, "testcase", {"classname": found.criteria.name, "name": row.words})
        value = "nothing" if row.value is None else f"{row.value:.3f} {row.unit}"
        words = f"{row.verdict}: {value}, nominal {row.criterion.nominal:g} {row.note}".strip()
        if row.verdict in failed:
            ElementTree.SubElement(case, "failure", {"message": words})
        elif row.verdict == "not measured":
            ElementTree.SubElement(case, "skipped", {"message": words})
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"
