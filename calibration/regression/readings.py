"""Files of measured spectra as a side: each reading under each light."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...spectral.formats.colours_only import Coloured, UnclearColoursError, read_colours
from ...spectral.formats.registry import details_of_readings, read_filling_gaps
from ...spectral.illuminants import illuminant
from ...spectral.measurement import FILE_NAME, Measurement
from ...spectral.observers import observer
from ...spectral.sample import Sample
from ...spectral.spectrum import Spectrum
from .picture_files import SeenSpectra
from .row import FLOAT64_ROUNDOFF, ComparedSide, PixelLayer, Pixels, Row, RowName


def readings_side(path: Path, seen: SeenSpectra) -> ComparedSide:
    """Return the reflectances of CxF, CGATS, instruments' text, CSV, ... by their names.

    Files of colours alone have colours for their stated light and observer only.

    Raises
    ------
    InputError : no file of spectra or colours; a duplicate name, or an emission, which has no white.
    """
    try:
        file, left_out = read_filling_gaps(path, seen.answer)
    except InputError as refusal:
        # A file of colours alone is refused by readers of spectra, who say why.
        try:
            colours = read_colours(path, seen.answer)
        except UnclearColoursError as reason:
            raise reason.at(file=path) from None
        except InputError:
            raise refusal from None
        return _colours_side(path, colours)
    _check_names(path, [entry.name for entry in file.entries])
    eye, beside = observer(seen.observer), details_of_readings(file, path)
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
        measured = Measurement.of(entry.spectrum.quantity, {**beside, **entry.details}, entry.name)
        for light in seen.lights:
            load = partial(_pixel, entry.spectrum, light, seen.observer)
            layer = PixelLayer(load, path, spectrum=partial(_spectrum, entry.spectrum))
            rows.append(Row(RowName(entry.name, light, eye.name), {"reading": layer}, measurement=measured))
    facts = {"format": file.format, **{key: str(value) for key, value in file.details.items()}}
    return ComparedSide(
        path, "readings", tuple(rows), facts, (*file.notes, *([left_out] if left_out else []), seen.words)
    )


def _check_names(path: Path, names: Sequence[str]) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError(
            "two readings of one name cannot be told apart",
            file=path,
            field="name",
            found=", ".join(twice[:4]),
            expected="each name once",
            hint="name repeated readings apart, or give their mean",
        )


def _colours_side(path: Path, colours: Sequence[Coloured]) -> ComparedSide:
    _check_names(path, [one.name for one in colours])
    rows = []
    for one in colours:
        name, stated = one.name, one.stated
        measured = Measurement.of(None, {**one.details, FILE_NAME: path.stem}, name)
        sample = Sample(name, str(path), stated=stated)
        for colour in stated:
            if colour.illuminant is None or colour.observer is None:
                raise InputError(
                    "a colour without its illuminant and observer",
                    file=path,
                    field=name,
                    found=f"illuminant {colour.illuminant or 'not stated'}, observer {colour.observer or 'not stated'}",
                    expected="both, as the instrument was set",
                    hint="export the measurement with its spectra, or say it, such as --colours-for D50/1931_2",
                )
            light, eye = colour.illuminant, colour.observer
            row = RowName(name, light, observer(eye).name)
            if row not in [told.name for told in rows[-len(stated) :]]:
                layer = PixelLayer(partial(_stated, sample, light, eye), path)
                rows.append(Row(row, {"reading": layer}, measurement=measured))
    chain = ("Colours without spectra count for the light and observer that their file states.",)
    return ComparedSide(path, "readings", tuple(rows), {}, chain)


def _stated(sample: Sample, light: str, eye: str) -> Pixels:
    return pixel(sample.xyz(light, eye), observer(eye).white(illuminant(light)))


def _pixel(reading: Spectrum, light: str, eye: str) -> Pixels:
    weights = observer(eye).weights(illuminant(light), reading.wavelengths_nm)
    return pixel(weights @ reading.samples, weights.sum(axis=1))


def _spectrum(reading: Spectrum, place: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the single spectrum."""
    del place
    return reading.wavelengths_nm, reading.samples


def pixel(xyz: np.ndarray, white: np.ndarray) -> Pixels:
    """One colour (3,) as a picture of one pixel, in double precision."""
    return Pixels(xyz.reshape(1, 1, 3), np.ones((1, 1)), white, FLOAT64_ROUNDOFF)
