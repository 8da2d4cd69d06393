"""Files of measured spectra as a side: each reading under each light."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np

from ...spectral.errors import InputError
from ...spectral.formats.reading import read_spectra
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from .picture_files import Seen
from .row import Layer, Pixels, Row, RowName, Side


def readings_side(path: Path, seen: Seen) -> Side:
    """The reflectances of CxF, CGATS, instruments' text, CSV, ... by their names.

    Raises
    ------
    InputError : no file of spectra; one that holds a name twice, or an emission, which has no white.
    """
    file = read_spectra(path)
    twice = [name for name, count in Counter(entry.name for entry in file.entries).items() if count > 1]
    if twice:
        raise InputError(
            "two readings of one name cannot be told apart",
            file=path,
            field="name",
            found=", ".join(twice[:4]),
            expected="each name once",
            hint="name repeated readings apart, or give their mean",
        )
    eye = observer(seen.observer)
    rows = []
    for entry in file.entries:
        if entry.spectrum.quantity == "emission":
            raise InputError(
                "an emission has no white to be compared under",
                file=path,
                field=entry.name,
                found="emission",
                expected="reflectances or transmittances",
            )
        for light in seen.lights:
            name = RowName(entry.name, light, eye.name)
            rows.append(Row(name, {"reading": Layer(partial(_pixel, entry.spectrum, light, seen.observer), path)}))
    facts = {"format": file.format, **{key: str(value) for key, value in file.details.items()}}
    return Side(path, "readings", tuple(rows), facts, (*file.notes, seen.words))


def _pixel(reading: Spectrum, light: str, eye: str) -> Pixels:
    weights = observer(eye).weights(illuminant(light), reading.wavelengths_nm)
    return pixel(weights @ reading.samples, weights.sum(axis=1))


def pixel(xyz: np.ndarray, white: np.ndarray) -> Pixels:
    """One colour (3,) as a picture of one pixel, in double precision."""
    return Pixels(xyz.reshape(1, 1, 3), np.ones((1, 1)), white, relative_step=2.0**-53)
