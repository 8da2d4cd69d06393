"""Material from a file without a catalogue: read and fitted as by an import, not stored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...runtime.errors import InputError
from ..catalogue.material import Material
from ..formats.input_file import head_of, is_zip
from ..records.models import SPECTRA, no_surface
from ..records.record import SUFFIX, read_record
from ..records.source import MaterialSource, Rejected
from .sources import read_sources
from .work import fit_material

#: ΔE94 that the fit aims at, as that of an import.
BUDGET = 0.5
# Most materials named of a file with several.
_NAMED = 6


def material_from(path: str | Path, budget: float = BUDGET) -> Material:
    """Read and fit the one surface in a file: a catalogue's material (.h5), any importable file, or a folder of maps.

    Its id is the path as given.

    Raises
    ------
    InputError : no such file; its content is no surface, cannot be fitted, or is several; it leaves a question open
        that an import asks.
    """
    path = Path(path)
    if path.suffix == SUFFIX:
        return replace(_surface(Material(**vars(read_record(path)))), id=str(path))
    if path.is_file() and is_zip(head_of(path)):
        hint = f"take the file out, or import all of it: metamer catalogue import {path}"
        raise InputError("an archive is not one material", file=path, expected="the file of one material", hint=hint)
    found = read_sources(path)
    sources = [one for one in found if isinstance(one, MaterialSource)]
    if not sources:
        refused = next(one for one in found if isinstance(one, Rejected))
        raise refused.reason
    if len(sources) > 1:
        names = ", ".join(one.id for one in sources[:_NAMED]) + (", ..." if len(sources) > _NAMED else "")
        hint = f"import it, and name one by its id: metamer catalogue import {path}"
        raise InputError("several materials", file=path, found=f"{len(sources)}: {names}", expected="one", hint=hint)
    (source,) = sources
    if source.model in SPECTRA:
        raise no_surface(source.model, str(path))
    fitted = fit_material(source, budget)
    if fitted.fast is None:
        raise InputError("could not be fitted", file=path, found=fitted.reason)
    return Material(
        str(path),
        source.family,
        source.model,
        source.parameters,
        source.provenance,
        fitted.fast,
        trials=fitted.trials,
    )


def _surface(material: Material) -> Material:
    if not material.is_surface:
        raise no_surface(material.model, material.id)
    return material
