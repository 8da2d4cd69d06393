"""Page of a verification for printing and signature; and its JUnit XML, a test case per criterion."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from ..report.page import html_environment
from .verification import Verification, trend

# Icons of verdicts, which need no colour; and verdicts that people call otherwise.
_ICONS = {"recommended": "i-ok", "pass": "i-ok", "not resolved": "i-near", "fail": "i-warn", "not measured": ""}
_WORDS = {"pass": "passes", "fail": "fails", "not resolved": "too close to call"}
# Patches and earlier figures that are listed.
_WORST, _EARLIER = 8, 6


def verification_page(found: Verification) -> str:
    """Render one self-contained HTML page."""
    order = np.argsort(-found.delta_e)[:_WORST]
    white = found.readings.white_xyz
    unit = "cd/m²" if found.readings.absolute else "of white = 100"
    rows = [
        (row, ", ".join(f"{value:.2f}" for _, value in trend(found.record, row.criterion.statistic)[-_EARLIER:]))
        for row in found.rows
    ]
    return (
        html_environment()
        .get_template("display.html")
        .render(
            found=found,
            rows=rows,
            icons=_ICONS,
            words=_WORDS,
            worst=[(found.readings.codes[at].tolist(), float(found.delta_e[at])) for at in order],
            white=f"x {white[0] / white.sum():.4f}, y {white[1] / white.sum():.4f}, {white[1]:.1f} {unit}",
        )
    )


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
