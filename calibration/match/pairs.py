"""Samples paired with their standard: differences, verdicts and indices under every light and for every observer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...runtime.errors import ComparisonError, InputError
from ...spectral.axis_letters import White
from ...spectral.difference import Differences, differences, lab_from_xyz
from ...spectral.formula import Formula
from ...spectral.illuminants import illuminant
from ...spectral.measurement import AllowedDifference, why_not_comparable
from ...spectral.metamerism import Conditions, Correction, colour_inconstancy, metamerism_index
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ..report.direction import direction
from .angles import OverAngles, over_angles
from .tolerance import Tolerance, Verdict
from .uncertainty import Repeatability, Spread, scatter, spread
from .whites import WhiteIndex, WhiteScale, white_indices

#: Verdicts, that first which decides where several are met.
WORST_FIRST: tuple[Verdict, ...] = ("fail", "not resolved", "pass", "not judged")
#: Corrections of pairs that do not quite match, made before the effect of a change of conditions is told.
CORRECTIONS: tuple[Correction, ...] = ("multiplicative", "parameric")

# Differences in CIELAB that show as 0.00 are no direction.
_SHOWN = 0.005


@dataclass(frozen=True)
class MatchOptions:
    """Options of a comparison of pairs.

    conditions : illuminants and observers, the first the reference of all indices. formulas : of ΔE; that of the
    tolerance is among them. repeatability : of the instrument, None if unknown. whites : whiteness and yellowness, by
    name. across : accepted differences between measurements. notes : on the conditions.
    """

    conditions: tuple[Conditions, ...]
    formulas: tuple[Formula, ...]
    tolerance: Tolerance | None = None
    repeatability: Repeatability | None = None
    whites: tuple[WhiteScale, ...] = ()
    across: tuple[AllowedDifference, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def judging(self) -> Formula:
        """Illuminants of the indices and spreads."""
        return self.tolerance.formula if self.tolerance is not None else self.formulas[0]


@dataclass(frozen=True, eq=False)
class PairDifference:
    """Difference of a sample from its standard under one illuminant for one observer; Lab (3,), ΔE by formula."""

    conditions: Conditions
    white: White
    standard_lab: Float[np.ndarray, "3"]
    sample_lab: Float[np.ndarray, "3"]
    off: Differences
    delta_e: dict[str, float]
    words: str
    spread: Spread | None
    verdict: Verdict


class Towards(NamedTuple):
    """A direction in words, the conditions under which it holds, and their verdict."""

    verdict: Verdict
    words: str
    conditions: tuple[Conditions, ...]


@dataclass(frozen=True, eq=False)
class Index:
    """Index of a change of conditions, or the reason why there is none: name, conditions, and value or words."""

    name: str
    changed: str
    value: float | None
    words: str = ""


@dataclass(frozen=True, eq=False)
class MatchedPairs:
    """One sample: its differences, the effect of changed conditions, and requested whiteness and yellowness.

    angles : if it was read at several.
    """

    sample: Sample
    differences: tuple[PairDifference, ...]
    indices: tuple[Index, ...] = field(default=())
    whites: tuple[WhiteIndex, ...] = ()
    angles: OverAngles | None = None

    @property
    def verdict(self) -> Verdict:
        """Worst verdict over all conditions."""
        found = {one.verdict for one in self.differences}
        return next(verdict for verdict in WORST_FIRST if verdict in found)

    @property
    def worst(self) -> PairDifference:
        """Conditions that decide the sample's verdict: those of the largest difference among all with it."""
        deciding = [one for one in self.differences if one.verdict == self.verdict]
        return max(deciding, key=lambda one: next(iter(one.delta_e.values())))

    @property
    def directions(self) -> tuple[Towards, ...]:
        """Direction under all conditions, failing ones first, equal ones grouped."""
        found: dict[tuple[Verdict, str], list[Conditions]] = {}
        for one in sorted(self.differences, key=lambda one: WORST_FIRST.index(one.verdict)):
            found.setdefault((one.verdict, one.words), []).append(one.conditions)
        return tuple(Towards(verdict, words, tuple(where)) for (verdict, words), where in found.items())


def matched(standard: Sample, samples: Sequence[Sample], asked: MatchOptions) -> tuple[MatchedPairs, ...]:
    """Compare samples with their standard, in their order.

    Raises
    ------
    ComparisonError : a sample is the standard itself, or was measured differently; or a side has no colour under some
        of the conditions.
    InputError : no samples.
    """
    if not samples:
        raise InputError("no sample", expected="one sample or more beside the standard")
    for sample in samples:
        if reason := why_not_comparable(standard.side, sample.side, asked.across):
            raise ComparisonError(reason)
        check_another(standard, sample)
    found = []
    for sample in samples:
        told = tuple(
            _difference(standard.at(where.geometry), sample.at(where.geometry), where, asked)
            for where in asked.conditions
        )
        white = white_indices(standard, sample, asked.whites, asked.conditions, asked.repeatability)
        by_angle = [(where.geometry, one.delta_e) for where, one in zip(asked.conditions, told, strict=True)]
        found.append(
            MatchedPairs(
                sample, told, _indices(standard, sample, asked), white, over_angles(standard, sample, by_angle)
            )
        )
    return tuple(found)


def check_another(standard: Sample, sample: Sample) -> None:
    """Raise `ComparisonError` if both are identical, which is no evidence about a batch.

    Surfaces of different finish are distinct, even with bodies derived from one reading.
    """
    if (standard.source, standard.name) == (sample.source, sample.name):
        raise ComparisonError(f"{sample.name} is its own standard: name another sample")
    ours, theirs = (
        [reading for part in (side, *side.angles) for reading in part.readings] for side in (standard, sample)
    )
    alike = standard.finish == sample.finish or not (standard.finish and sample.finish)
    same = (
        alike
        and len(ours) == len(theirs) > 0
        and all(
            one.wavelengths_nm.shape == other.wavelengths_nm.shape
            and (one.wavelengths_nm == other.wavelengths_nm).all()
            and (one.samples == other.samples).all()
            for one, other in zip(ours, theirs, strict=True)
        )
    )
    if same:
        raise ComparisonError(
            f"{sample.name} of {sample.source} has the numbers of the standard, {standard.name} of {standard.source}, "
            "to the last digit: a second measurement never has"
        )


def _difference(standard: Sample, sample: Sample, where: Conditions, asked: MatchOptions) -> PairDifference:
    white = observer(where.observer).white(illuminant(where.illuminant))
    one_xyz, other_xyz = (side.xyz(where.illuminant, where.observer) for side in (standard, sample))
    first, second = lab_from_xyz(one_xyz, white), lab_from_xyz(other_xyz, white)
    for side, lab in ((standard, first), (sample, second)):
        if not np.isfinite(lab).all():
            raise InputError(
                "not a colour", file=side.source, field=side.name, found=str(lab), expected="finite numbers"
            )
    off = differences(first, second)
    formulas = tuple(one.at(where.geometry) for one in asked.formulas)
    delta_e = {one.name: float(one(one_xyz, other_xyz, white)) for one in formulas}
    known, least = None, _SHOWN
    verdict: Verdict = "not judged"
    if asked.repeatability is not None:
        covariance = scatter(standard, sample, asked.repeatability, where.illuminant, where.observer)
        known = spread(first, second, white, covariance, formulas)
        least = max(known.lightness, known.chroma, known.hue, _SHOWN)
    if asked.tolerance is not None and not (standard.made_up or sample.made_up):
        name = asked.tolerance.formula.name
        verdict = asked.tolerance.verdict(delta_e[name], None if known is None else known.delta_e[name])
    return PairDifference(where, white, first, second, off, delta_e, direction(first, off, least), known, verdict)


def _indices(standard: Sample, sample: Sample, asked: MatchOptions) -> tuple[Index, ...]:
    reference, *tests = asked.conditions
    if reference.geometry:
        # Effect coatings have none (ISO 18314-4).
        return ()
    formula = asked.judging
    found = []
    for test in tests:
        light, eye = test.illuminant != reference.illuminant, test.observer != reference.observer
        # No index is defined for a change of both.
        if light and eye:
            continue
        for correction in CORRECTIONS:
            name = f"metamerism, change of {'observer' if eye else 'illuminant'}, {correction}"
            told = partial(metamerism_index, standard, sample, reference, test, formula, correction)
            found.append(_told(name, test, told))
        for side, who in ((standard, "standard"), (sample, "sample")):
            if light:
                told = partial(colour_inconstancy, side, reference, test, formula)
                found.append(_told(f"colour inconstancy of the {who}", test, told))
    return tuple(found)


def _told(name: str, test: Conditions, value: Callable[[], float]) -> Index:
    try:
        return Index(name, test.words, value())
    except ComparisonError as reason:
        return Index(name, test.words, None, str(reason))
