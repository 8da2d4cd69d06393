"""Writes spectra as a comma-separated table, wavelengths down the first column, numbers as exact as float64."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from .registry import SpectralEntry

_SCALES = {
    "reflectance": "reflectance, fractions of 1",
    "transmittance": "transmittance, fractions of 1",
    "radiance factor": "radiance factor, 1 for the perfect diffuser",
}


def write_csv(path: str | Path, entries: Sequence[SpectralEntry], comments: Sequence[str] = ()) -> None:
    """Write spectra that share their wavelengths and quantity; `comments` stand before them, each behind a #.

    Raises
    ------
    InputError
        Nothing to write, spectra of several quantities or wavelengths, or a folder that cannot be written to.
    """
    if not entries:
        raise InputError("nothing to write", file=path, expected="one spectrum or more")
    first = entries[0].spectrum
    for entry in entries:
        other = entry.spectrum
        if other.quantity != first.quantity or not np.array_equal(other.wavelengths_nm, first.wavelengths_nm):
            same = other.quantity != first.quantity
            raise InputError(
                "spectra of several quantities in one table"
                if same
                else "spectra of different wavelengths in one table",
                file=path,
                field=entry.name,
                found=_axis(entry),
                expected=f"{_axis(entries[0])}, as {entries[0].name}",
                hint="give a folder as OUT, for one file each, or use --format cxf",
            )
    units = sorted({entry.details.get("units", "unit not stated") for entry in entries})
    said = _SCALES.get(first.quantity) or f"{first.quantity}, {'; '.join(units)}"
    with written_whole(path) as beside, beside.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {' '.join(line.split())}\n" for line in (*comments, said))
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["wavelength_nm", *(" ".join(entry.name.split()) for entry in entries)])
        columns = [first.wavelengths_nm.tolist(), *(entry.spectrum.samples.tolist() for entry in entries)]
        table.writerows([repr(value) for value in row] for row in zip(*columns, strict=True))


def _axis(entry: SpectralEntry) -> str:
    grid = entry.spectrum.wavelengths_nm
    return f"{entry.spectrum.quantity} at {grid.size} wavelengths from {grid[0]:g} to {grid[-1]:g} nm"
