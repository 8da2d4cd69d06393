"""Materials as one flat table for spreadsheets and data frames: names, colours, errors, and a column a wavelength."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...runtime.distribution import install_hint
from ...runtime.errors import InputError
from ...runtime.sheets import Cell, write_workbook
from ...spectral.spectrum import Spectrum
from ..records.material import MaterialRecord
from .spectrum import exported_spectrum

#: Lights of the CIELAB columns, for the CIE 1931 observer, and wavelengths of the spectral columns, nm.
LIGHTS, WAVELENGTHS_NM = ("D65", "A", "FL11"), np.arange(400.0, 701.0, 10.0)
HEADINGS = (
    "id", "family", "model", "standing", "quantity", "source", "licence", "geometry",
    *(f"{axis} {light}" for light in LIGHTS for axis in ("L*", "a*", "b*")),
    "fit ΔE94 mean", "fit ΔE94 p99",
    *(f"{nm:g} nm" for nm in WAVELENGTHS_NM),
)  # fmt: skip


def material_lines(records: Iterable[MaterialRecord]) -> tuple[list[list[Cell]], list[str]]:
    """Return a line of `HEADINGS` a material, and what there is to say of them.

    Cells are empty where a record has nothing to say: of the spectrum beyond the measured range, of colours of a light.
    """
    lines, notes = [], []
    for record in records:
        said, error = record.provenance, record.error
        line: list[Cell] = [record.id, record.family, record.model, said.standing, record.quantity]
        line += [said.source, said.licence, said.geometry or None]
        try:
            spectrum = exported_spectrum(record).spectrum
        except InputError as reason:
            notes.append(f"{record.id}: no spectrum and no colours: {reason.problem}")
            spectrum = None
        line += _colours(spectrum)
        line += [None, None] if error is None else [error.mean, error.p99]
        line += _samples(spectrum)
        lines.append(line)
    return lines, notes


def _colours(spectrum: Spectrum | None) -> list[Cell]:
    if spectrum is None or spectrum.quantity == "emission":
        return [None] * (3 * len(LIGHTS))
    try:
        return [float(value) for light in LIGHTS for value in spectrum.lab(light)]
    except InputError:  # too little of the visible
        return [None] * (3 * len(LIGHTS))


def _samples(spectrum: Spectrum | None) -> list[Cell]:
    if spectrum is None:
        return [None] * len(WAVELENGTHS_NM)
    low, high = spectrum.wavelengths_nm[[0, -1]]
    values = spectrum.resampled(WAVELENGTHS_NM).samples
    return [float(value) if low <= nm <= high else None for nm, value in zip(WAVELENGTHS_NM, values, strict=True)]


def write_material_workbook(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    """Write an .xlsx of one sheet; returns what there is to say.

    Raises
    ------
    InputError : openpyxl is not installed, or the folder cannot be written to.
    """
    lines, notes = material_lines(records)
    write_workbook(path, "materials", HEADINGS, lines)
    return tuple(notes)


def write_material_parquet(path: Path, records: Iterable[MaterialRecord]) -> tuple[str, ...]:
    """Write an Apache Parquet file of the same columns; returns what there is to say.

    Raises
    ------
    InputError : pyarrow is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as reason:
        raise InputError("Parquet needs pyarrow", file=path, hint=install_hint("parquet")) from reason
    lines, notes = material_lines(records)
    numbers = HEADINGS.index(f"L* {LIGHTS[0]}")
    kinds = [pyarrow.string() if at < numbers else pyarrow.float64() for at in range(len(HEADINGS))]
    columns = [pyarrow.array([line[at] for line in lines], kind) for at, kind in enumerate(kinds)]
    parquet.write_table(pyarrow.table(columns, names=list(HEADINGS)), path)
    return tuple(notes)
