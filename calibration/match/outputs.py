"""Machine-readable outputs of a match: JSON with every figure; JUnit XML, a test case per sample; Markdown."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...spectral.sample import Sample
from ..report.junit_xml import Outcome, case_of, junit_text
from ..report.text_tables import escaped
from .angles import OverAngles
from .batch import Batch
from .page import UNKNOWN, MatchReport
from .pairs import MatchedPairs, PairDifference
from .tolerance import VERDICT_WORDS, Verdict

# Nobody knows whether what is not resolved is right, and nobody has asked whether what is not judged is.
_OUTCOMES: dict[Verdict, Outcome] = {
    "pass": "passed",
    "fail": "failed",
    "not resolved": "skipped",
    "not judged": "skipped",
}
# Most samples listed in a merge request.
_MOST = 15
_SIGNS: dict[Verdict, str] = {"pass": "✅", "not resolved": "⚠️", "fail": "❌", "not judged": ""}

SCHEMA = "metamer.match/1"


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
    """Write the sentence of the page, and the worst samples, each under its deciding light."""
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


def figures(report: MatchReport) -> dict[str, Any]:
    """Return a document for JSON."""
    asked = report.asked
    return {
        "schema": SCHEMA,
        "version": report.version,
        "signed": dict(report.signed),
        "standard": _side(report.standard),
        "tolerance": None if asked.tolerance is None else asked.tolerance.words,
        "formulas": [one.words for one in asked.formulas],
        "across": list(report.crossed),
        "summary": report.summary,
        "notes": list(report.notes),
        "samples": [_matched(one) for one in report.samples],
        "batches": [_batch(one) for one in report.batches],
    }


def _side(side: Sample) -> dict[str, Any]:
    return {
        "name": side.name,
        "source": side.source,
        "readings": side.count,
        "effect": side.effect,
        "details": dict(side.details),
        "measurement": side.measurement.words,
    }


def _matched(one: MatchedPairs) -> dict[str, Any]:
    return _side(one.sample) | {
        "verdict": one.verdict,
        "directions": [
            {"verdict": told.verdict, "words": told.words, "conditions": [asdict(where) for where in told.conditions]}
            for told in one.directions
        ],
        "differences": [_difference(found) for found in one.differences],
        "indices": [asdict(index) for index in one.indices],
        "whites": [asdict(index) for index in one.whites],
        "angles": None if one.angles is None else _over_angles(one.angles),
    }


def _over_angles(found: OverAngles) -> dict[str, Any]:
    by_formula = {name: {"mean": mean, "largest": largest} for name, (mean, largest) in found.by_formula.items()}
    return asdict(found) | {"flop_difference": found.flop_difference, "by_formula": by_formula}


def _difference(found: PairDifference) -> dict[str, Any]:
    off = {name: float(value) for name, value in asdict(found.off).items()}
    return asdict(found.conditions) | {
        "verdict": found.verdict,
        "white_xyz": _listed(found.white),
        "standard_lab": _listed(found.standard_lab),
        "sample_lab": _listed(found.sample_lab),
        "difference": off,
        "delta_e": found.delta_e,
        "words": found.words,
        "uncertainty_k2": None if found.spread is None else asdict(found.spread),
    }


def _batch(found: Batch | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "count": found.count,
        "mean": _listed(found.mean),
        "deviation": _listed(found.deviation),
        "scatter": found.scatter,
        "per_sample": None if found.per_sample is None else _listed(found.per_sample),
        "per_sample_95": None if found.uncertain is None else _listed(found.uncertain),
    }


def _listed(values: np.ndarray) -> list[float]:
    return [float(value) for value in values]
