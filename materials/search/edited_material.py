"""Edited materials without a file: a catalogued one with other parameters, refitted, and a catalogue with it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...runtime.errors import InputError
from ...runtime.worker_pool import in_order
from ..catalogue.catalogue import Catalogue
from ..catalogue.material import Material
from ..intake.work import FitResult, fit_material
from ..records.source import MaterialSource
from .sliders import changed, slider

#: Error budget of the fast form of a varied material, ΔE94, 99th percentile: it is shown while it changes.
BUDGET = 1.0


@dataclass(frozen=True)
class VariedCatalogue(Catalogue):
    """Catalogue with additional materials without files: `made`, by id."""

    made: Mapping[str, Material] = field(default_factory=dict)

    @classmethod
    def of(cls, catalogue: Catalogue, made: Iterable[Material]) -> VariedCatalogue:
        """Return a catalogue with more materials; earlier additions stay."""
        before = catalogue.made if isinstance(catalogue, VariedCatalogue) else {}
        return cls(catalogue.folder, {**before, **{one.id: one for one in made}})

    def load(self, material_id: str) -> Material:
        """Implement `Catalogue.load`."""
        return self.made[material_id] if material_id in self.made else super().load(material_id)

    def state(self, material_id: str) -> tuple:
        """Return the state as of `Catalogue.state`; for a material without a file, the identity of its fast form."""
        return (id(self.made[material_id].fast),) if material_id in self.made else super().state(material_id)


def varied(material: Material, values: Mapping[str, float | int], budget: float = BUDGET) -> Material:
    """Edit a material's parameters and refit its fast form: about a second.

    Its id states the changes; its error is measured; its provenance is that of the material, with a note.

    Parameters
    ----------
    values : by names of sliders (`sliders.sliders`).

    Raises
    ------
    UnknownNameError, InputError : as `sliders.changed`; a material that could not be fitted.
    """
    source = _source(material, values)
    return _made(source, fit_material(source, budget))


def varied_along(
    material: Material,
    ranges: Mapping[str, tuple[float | int, float | int]],
    count: int,
    budget: float = BUDGET,
    jobs: int = 1,
) -> Iterator[Material]:
    """Apply `varied` at `count` steps, two at least, of sliders that move together from the first value to the second.

    All steps are checked before the first is fitted. jobs : processes that fit; with 1 it is done in this one.

    Raises
    ------
    UnknownNameError, InputError : as of `varied`; less than two steps.
    """
    if count < 2:
        raise InputError("no steps", field="count", found=count, expected="2 or more, both ends among them")
    if not ranges:
        raise InputError("nothing is changed", field=material.id, expected="a parameter and two values")
    surface = material.surface()
    steps = {name: slider(surface, name, material.id).steps(*ends, count) for name, ends in ranges.items()}
    sources = [_source(material, {name: values[k] for name, values in steps.items()}) for k in range(count)]
    fits = in_order(fit_material, [(source, budget) for source in sources], jobs)
    return (_made(source, fitted) for source, fitted in zip(sources, fits, strict=True))


def _source(material: Material, values: Mapping[str, float | int]) -> MaterialSource:
    """Make the source of the material that is to be fitted."""
    if not values:
        raise InputError("nothing is changed", field=material.id, expected="a parameter and a value")
    original = changed(material.surface(), values, material.id)
    words = ", ".join(f"{name} {value:g}" for name, value in values.items())
    parameters = {"wavelengths_nm": original.wavelengths_nm, **original.parameters()}
    said = material.provenance
    provenance = replace(said, notes=" + ".join(filter(None, (said.notes, f"changed: {words}"))))
    name = f"{material.id} with {words}"
    return MaterialSource(name, material.family, original.NAME, parameters, provenance, Path(material.id))


def _made(source: MaterialSource, fitted: FitResult) -> Material:
    """Return the material that came of it."""
    if fitted.fast is None:
        raise InputError("could not be fitted", field=source.id, found=fitted.reason)
    one = source
    return Material(one.id, one.family, one.model, one.parameters, one.provenance, fitted.fast, trials=fitted.trials)
