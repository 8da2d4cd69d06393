"""Metamerism of materials: ΔE of each from the first, under each condition, worst first.

Colours are those of an annular 45:0 instrument, from the original data, including fluorescence.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...materials.catalogue.material import Material
from ...materials.catalogue.samples import sample_of
from ...runtime.errors import ComparisonError, InputError
from ...spectral.formula import Formula
from ...spectral.illuminants import illuminant
from ...spectral.metamerism import Conditions, metamerism_index
from ...spectral.observers import OBSERVERS, observer
from ...spectral.spectrum import Spectrum
from .choices import Choices
from .light_choice import LightChoice
from .state import Session

#: Conditions under which pairs are corrected to match before an index is computed.
REFERENCE = Conditions("D65", "1964_10")


@dataclass(frozen=True)
class Cell:
    """Comparison of a material with the first, under one light for one observer.

    delta_e : from the first, uncorrected. index : of metamerism, after correcting the pair to match under the reference
    conditions (ISO 18314-4, multiplicative); None with the reason in `no_index`.
    """

    material: str
    conditions: Conditions
    delta_e: float
    index: float | None
    no_index: str = ""


@dataclass(frozen=True)
class Metamerism:
    """Comparison of every material with the first, under every condition, worst first.

    standard : the first material, the reference of ΔE. formula : its description.
    """

    standard: str
    reference: Conditions
    formula: str
    cells: tuple[Cell, ...]

    def table(self) -> tuple[tuple[Conditions, ...], dict[str, tuple[float, ...]]]:
        """Return the conditions ordered by their largest ΔE, and each material's ΔE under them, materials in the same
        order.
        """
        conditions = tuple(dict.fromkeys(one.conditions for one in self.cells))
        found = {(one.material, one.conditions): one.delta_e for one in self.cells}
        names = dict.fromkeys(one.material for one in self.cells)
        return conditions, {name: tuple(found[name, one] for one in conditions) for name in names}


def metamerism(
    materials: Sequence[Material],
    lights: Mapping[str, Spectrum | None],
    observers: Sequence[str],
    formula: Formula,
    reference: Conditions = REFERENCE,
) -> Metamerism:
    """Compare materials with the first of them.

    Parameters
    ----------
    materials : at least two. lights : by name; a spectrum, or None for the illuminant of that name.
    observers : short names.

    Raises
    ------
    InputError : fewer than two materials, no light or no observer; a material without a colour (a light, or too small a
        spectral range); a duplicate.
    """
    for what, given, least in (("materials", materials, 2), ("lights", lights, 1), ("observers", observers, 1)):
        if len(given) < least:
            raise InputError("too few to compare", field=what, found=len(given), expected=f"{least} or more")
    names = [one.id for one in materials]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError("a material beside itself", field="materials", found=twice, expected="each once")
    cells = _cells(materials, lights, observers, formula, reference)
    order = sorted(cells, key=lambda one: (-one.delta_e, one.material, one.conditions.words))
    return Metamerism(names[0], reference, formula.words, tuple(order))


def _cells(
    materials: Sequence[Material],
    lights: Mapping[str, Spectrum | None],
    observers: Sequence[str],
    formula: Formula,
    reference: Conditions,
) -> Iterator[Cell]:
    readings, samples = [one.reading() for one in materials], [sample_of(one) for one in materials]
    for name, given in lights.items():
        power = illuminant(name) if given is None else given
        for who in observers:
            eye, conditions = observer(who), Conditions(name, who)
            white = eye.white(power)
            colours = [one.xyz(power, eye) for one in readings]
            for material, sample, xyz in zip(materials[1:], samples[1:], colours[1:], strict=True):
                index, why = None, "this lamp has no name as an illuminant"
                if given is None:
                    try:
                        index, why = metamerism_index(samples[0], sample, reference, conditions, formula), ""
                    except ComparisonError as reason:
                        why = str(reason)
                yield Cell(material.id, conditions, _difference(formula, colours[0], xyz, white), index, why)


def _difference(
    formula: Formula, standard: Float[np.ndarray, "3"], sample: Float[np.ndarray, "3"], white: Float[np.ndarray, "3"]
) -> float:
    return float(formula(standard, sample, white))


def session_of_cell(session: Session, cell: Cell, standard: str, choices: Choices) -> Session:
    """Return the session that shows a cell: the standard as A, the other as B, in its light, for its observer."""
    light = session.light
    named = LightChoice.named(cell.conditions.illuminant)
    if [one.name for one in light.lamps] != [cell.conditions.illuminant]:
        light = replace(named, rotation_deg=light.rotation_deg, dimming=light.dimming)
    other = replace(session.other, material=cell.material, light=None, observer=None)
    seen = session.wearing(choices.shown_part(session), standard)
    known = cell.conditions.observer if cell.conditions.observer in OBSERVERS else session.observer
    return replace(seen, light=light, observer=known, other=other)
