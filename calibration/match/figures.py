"""Every figure of a match, for programs: `metamer.match/1`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from ...spectral.sample import Sample
from .angles import OverAngles
from .batch import Batch
from .page import MatchReport
from .pairs import MatchedPairs, PairDifference

SCHEMA = "metamer.match/1"


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
