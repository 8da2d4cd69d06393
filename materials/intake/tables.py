"""Tables of spectra that materials are described from, each with its source, licence and hash."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from ...spectral.errors import InputError, UnknownNameError
from ...spectral.formats.csv import read_csv_spectra
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Quantity, Spectrum, check_values

Kind = Literal["reflectance", "index"]
# A refractive index is held as an emission is: finite and not negative, without an upper bound, interpolated linearly.
_MEASURED_AS: dict[Kind, Quantity] = {"reflectance": "reflectance", "index": "emission"}
_KEYS = ("file", "colour_checker", "source", "licence", "geometry", "quantity", "sha256")
_LARGEST = sys.float_info.max


@dataclass(frozen=True, eq=False)
class Table:
    """Spectra by column name; read, and checked against `sha256`, when first asked for.

    origin : a CSV file, or the name of a chart of colour-science.
    file, name : where the table is described, for messages.
    """

    name: str
    origin: Path | str
    source: str
    licence: str
    geometry: str
    quantity: Kind
    sha256: str
    file: Path

    @cached_property
    def _spectra(self) -> dict[str, Spectrum]:
        if isinstance(self.origin, str):
            spectra = _colour_checker(self.origin, self.file, self.name)
            digest = hashlib.sha256()
            for column, spectrum in spectra.items():
                digest.update(column.encode() + np.stack([spectrum.wavelengths_nm, spectrum.samples]).tobytes())
            found = digest.hexdigest()
        else:
            spectra = read_csv_spectra(self.origin, _MEASURED_AS[self.quantity])
            found = hashlib.sha256(self.origin.read_bytes()).hexdigest()
        if self.sha256 and found != self.sha256:
            raise InputError(
                "the table is not the one that was described",
                file=self.origin if isinstance(self.origin, Path) else f"colour-science: {self.origin}",
                field=f"sha256 of [{self.name}] in {self.file}",
                found=found,
                expected=self.sha256,
                hint="fetch the original table again, or describe the new one: source, licence and hash",
            )
        return spectra

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the spectra."""
        return tuple(self._spectra)

    def spectrum(self, column: str) -> Spectrum:
        """The spectrum of a column, on its own wavelengths."""
        if column not in self._spectra:
            raise UnknownNameError("column", column, self._spectra, file=self.origin, field=self.name)
        return self._spectra[column]


def constant_spectrum(value: object, quantity: Kind) -> Spectrum:
    """The same reflectance or index at every working wavelength."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError("not a number", found=repr(value), expected="a number")
    grid = WORKING_WAVELENGTHS_NM
    # A whole number may be too large for any float; the check below refuses what stands for it.
    values = np.full(grid.size, float(value) if abs(value) < _LARGEST else np.inf)
    check_values(values, grid, _MEASURED_AS[quantity], field="constant")
    return Spectrum.sampled(grid, values, _MEASURED_AS[quantity])


def tables_from(description: Mapping[str, Any], file: Path) -> dict[str, Table]:
    """The tables that a `sources.toml` describes, by name; nothing of them is read yet."""
    return {name: _table(name, entry, file) for name, entry in description.items()}


def _table(name: str, entry: Any, file: Path) -> Table:
    if not isinstance(entry, dict):
        raise InputError("not a table of spectra", file=file, field=name, found=repr(entry), expected=f"[{name}]")
    for key in entry:
        if key not in _KEYS:
            raise UnknownNameError("key", key, _KEYS, file=file, field=f"{name}.{key}")
    for key in ("source", "licence"):
        if not str(entry.get(key, "")).strip():
            raise InputError("a table without its origin", file=file, field=f"{name}.{key}", expected="a sentence")
    if ("file" in entry) == ("colour_checker" in entry):
        raise InputError("where are the spectra?", file=file, field=name, expected="either file or colour_checker")
    quantity = entry.get("quantity", "reflectance")
    if quantity not in get_args(Kind):
        raise UnknownNameError("quantity", str(quantity), get_args(Kind), file=file, field=f"{name}.quantity")
    origin = file.parent / str(entry["file"]) if "file" in entry else str(entry["colour_checker"])
    geometry, sha256 = str(entry.get("geometry", "")), str(entry.get("sha256", ""))
    return Table(name, origin, str(entry["source"]), str(entry["licence"]), geometry, quantity, sha256, file)


def _colour_checker(chart: str, file: Path, name: str) -> dict[str, Spectrum]:
    """The patches of a chart of colour-science; a density in brackets is left out of the names."""
    from ...spectral.tables import colour_science
    from ..formats.naming import slug

    charts = colour_science().SDS_COLOURCHECKERS
    if chart not in charts:
        raise UnknownNameError("chart", chart, charts, file=file, field=f"{name}.colour_checker")
    return {
        slug(patch.partition("(")[0]): Spectrum.sampled(values.wavelengths, values.values)
        for patch, values in charts[chart].items()
    }
