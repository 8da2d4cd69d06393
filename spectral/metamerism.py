"""Pairs that match under one light and not under another: metamerism indices, and colour inconstancy.

A pair that does not quite match under the reference conditions is first corrected, so that the index measures the
change alone (CIE 015:2018, 9.2; ISO 18314-4): either the sample's tristimulus values under the test conditions are
multiplied by the ratio of standard to sample under the reference, or the sample's spectrum receives the standard's
fundamental, the part visible under the reference conditions (the parameric decomposition of H. S. Fairman, Color
Research and Application 12, 1987). A change of observer in place of the light is treated likewise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from ..runtime.errors import ComparisonError, UnknownNameError
from .adaptation import adaptation_matrix
from .formula import Formula
from .illuminants import illuminant
from .observers import observer
from .sample import Sample

Correction = Literal["multiplicative", "parameric", "none"]
# nm at which spectra are decomposed.
_GRID = np.arange(380.0, 781.0, 5.0)


@dataclass(frozen=True)
class Conditions:
    """Illuminant and observer, by name; and an angle in its notation, "" for a single geometry."""

    illuminant: str
    observer: str
    geometry: str = ""

    @property
    def words(self) -> str:
        """All names."""
        return ", ".join(one for one in (self.geometry, self.illuminant, self.observer) if one)


def metamerism_index(
    standard: Sample,
    sample: Sample,
    reference: Conditions,
    test: Conditions,
    formula: Formula,
    correction: Correction = "multiplicative",
) -> float:
    """Compute ΔE under the test conditions of a pair corrected to match under the reference ones.

    Raises
    ------
    ComparisonError : a side has no spectrum; it fluoresces, and is corrected by its spectrum; it is an effect coating,
        whose colour has further conditions; or it is black, so that the ratio is undefined.
    """
    if correction not in get_args(Correction):
        raise UnknownNameError("correction", correction, get_args(Correction))
    for side in (standard, sample):
        if side.effect:
            raise ComparisonError(
                f"{side.name}: {side.effect}; ISO 18314-4 leaves effect coatings out, for their colour changes with "
                "angles too"
            )
        if not side.spectral:
            raise ComparisonError(f"{side.name}: no spectrum, so its colour under another light is not known")
    white = observer(test.observer).white(illuminant(test.illuminant))
    first = standard.xyz(test.illuminant, test.observer)
    if correction == "parameric":
        second = first + _difference_of_blacks(standard, sample, reference, test)
    else:
        second = sample.xyz(test.illuminant, test.observer)
    if correction == "multiplicative":
        wanted, found = (one.xyz(reference.illuminant, reference.observer) for one in (standard, sample))
        if not (found > 0.0).all():
            raise ComparisonError(f"{sample.name}: black under {reference.words}, so that nothing can be multiplied")
        second = second * (wanted / found)
    return float(formula(first, second, white))


def _difference_of_blacks(
    standard: Sample, sample: Sample, reference: Conditions, test: Conditions
) -> Float[np.ndarray, "3"]:
    """Compute the tristimulus values of the difference of both metameric blacks under the test conditions."""
    for side in (standard, sample):
        if side.seen is not None:
            raise ComparisonError(f"{side.name}: fluoresces, so no spectrum of reflectance can be decomposed")
    seen = observer(reference.observer).weights(illuminant(reference.illuminant), _GRID)
    off = sample.factor(_GRID) - standard.factor(_GRID)
    black = off - seen.T @ np.linalg.lstsq(seen @ seen.T, seen @ off, rcond=None)[0]
    return observer(test.observer).weights(illuminant(test.illuminant), _GRID) @ black


def colour_inconstancy(sample: Sample, reference: Conditions, test: Conditions, formula: Formula) -> float:
    """Compute the colour inconstancy of a sample between two lights after adaptation.

    ΔE between it under the reference light and its corresponding colour under the test light (CMCCON02 of M. R. Luo et
    al., Color Research and Application 28, 2003, with complete adaptation by CAT02; it is their index with the formula
    CMC 1:1).

    Raises
    ------
    ComparisonError : no spectrum.
    """
    if not sample.spectral:
        raise ComparisonError(f"{sample.name}: no spectrum, so its colour under another light is not known")
    whites = [observer(one.observer).white(illuminant(one.illuminant)) for one in (test, reference)]
    corresponding = adaptation_matrix(whites[0], whites[1], "CAT02") @ sample.xyz(test.illuminant, test.observer)
    here = sample.xyz(reference.illuminant, reference.observer)
    return float(formula(here, corresponding, whites[1]))
