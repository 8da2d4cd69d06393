"""Colours that came beside a record's spectrum, held against those that the spectrum itself gives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...spectral.formats.registry import SpectralEntry, StatedColour
from ...spectral.stated_colours import StatedComparison, compared
from .material import MaterialRecord


def stated_colours(original: Mapping[str, Any]) -> tuple[StatedColour, ...]:
    """Return stated colours as a record stores them: `stated.N.space`, `.values`, and where the file said so
    `.illuminant` and `.observer`.
    """
    numbers = sorted(
        int(name.split(".")[1])
        for name in original
        if name.startswith("stated.") and name.endswith(".space") and name.split(".")[1].isdecimal()
    )
    found = []
    for place in (f"stated.{number}." for number in numbers):
        space, values = original[f"{place}space"], original.get(f"{place}values", ())
        if space in ("XYZ", "Lab") and np.shape(values) == (3,):
            light, eye = (original.get(place + name) or None for name in ("illuminant", "observer"))
            found.append(StatedColour(space, np.asarray(values, dtype=np.float64), light, eye))
    return tuple(found)


def recomputed_colours(record: MaterialRecord) -> tuple[StatedComparison, ...]:
    """Return every stated colour of a record beside what its spectrum gives; none where it keeps no single spectrum.

    Raises
    ------
    InputError : a colour is stated for a light or an observer that is not tabulated here.
    """
    spectrum, stated = record.measured_spectrum(), stated_colours(record.original)
    if spectrum is None or spectrum.samples.ndim != 1 or not stated:
        return ()
    return compared(SpectralEntry(record.id, spectrum, stated))
