"""Whiteness and yellowness of a standard and its samples, on request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import ComparisonError
from ...spectral.difference import lab_from_xyz, xyz_from_lab
from ...spectral.illuminants import illuminant
from ...spectral.metamerism import Conditions
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ...spectral.whiteness import WhitenessMethod, defined_for, index_of_xyz, whiteness, yellowness
from .uncertainty import Repeatability, deviation_of, scatter

#: Scales of near whites: a method of whiteness, or "yellowness", of ASTM E313.
WhiteScale = WhitenessMethod | Literal["yellowness"]


@dataclass(frozen=True)
class WhiteIndex:
    """One scale under one illuminant and observer.

    name, conditions : in words. standard, sample : the index of each; standard_tint, sample_tint : if it has one; None
    without one, for the reason in `words`. uncertainty : of sample minus standard, k = 2; None if the repeatability is
    unknown.
    """

    name: str
    conditions: str
    standard: float | None = None
    sample: float | None = None
    standard_tint: float | None = None
    sample_tint: float | None = None
    uncertainty: float | None = None
    words: str = ""

    @property
    def off(self) -> float | None:
        """Sample minus standard."""
        return None if self.standard is None or self.sample is None else self.sample - self.standard


def white_indices(
    standard: Sample,
    sample: Sample,
    scales: tuple[WhiteScale, ...],
    conditions: tuple[Conditions, ...],
    known: Repeatability | None,
) -> tuple[WhiteIndex, ...]:
    """Compute each scale under the conditions that it is defined for; one without numbers if there are none."""
    found = []
    for scale in scales:
        method = _method(scale)
        meant = [one for one in conditions if defined_for(one, method)]
        # Under any other, the refusal says what it is for.
        for where in meant or conditions[:1]:
            sides = standard.at(where.geometry), sample.at(where.geometry)
            found.append(_index(*sides, scale, where, known))
    return tuple(found)


def _method(scale: WhiteScale) -> WhitenessMethod | None:
    return None if scale == "yellowness" else scale


def _index(
    standard: Sample, sample: Sample, scale: WhiteScale, where: Conditions, known: Repeatability | None
) -> WhiteIndex:
    method = _method(scale)
    name = "yellowness, ASTM E313" if method is None else f"whiteness, {method}"
    told: list[tuple[float | None, float | None]] = []
    why = []
    for side in (standard, sample):
        try:
            if method is None:
                told.append((yellowness(side, where), None))
            else:
                white = whiteness(side, where, method)
                told.append((white.index, white.tint))
        except ComparisonError as reason:
            told.append((None, None))
            why.append(str(reason))
    uncertainty = None
    if known is not None and not why:
        uncertainty = _uncertainty(standard, sample, method, where, known)
    (first, first_tint), (second, second_tint) = told
    words = "; ".join(dict.fromkeys(why))
    return WhiteIndex(name, where.words, first, second, first_tint, second_tint, uncertainty, words)


def _uncertainty(
    standard: Sample, sample: Sample, method: WhitenessMethod | None, where: Conditions, known: Repeatability
) -> float:
    """Compute the uncertainty, k = 2, of the difference: all its scatter about the sample."""
    white = observer(where.observer).white(illuminant(where.illuminant))
    lab = lab_from_xyz(sample.xyz(where.illuminant, where.observer), white)
    covariance = scatter(standard, sample, known, where.illuminant, where.observer)

    def index(labs: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        return index_of_xyz(xyz_from_lab(labs, white), where, method)

    return deviation_of(index, lab, covariance)
