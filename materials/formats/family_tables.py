"""Tables of spectra that materials are described from, each with its source, licence and hash."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.formats.csv import read_csv_spectra
from ...spectral.formats.import_options import Scale
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Quantity, Spectrum, as_float, check_values

Kind = Literal["reflectance", "index"]
# A refractive index is held as an emission is: finite and not negative, without an upper bound, interpolated linearly.
_MEASURED_AS: dict[Kind, Quantity] = {"reflectance": "reflectance", "index": "emission"}
_KEYS = ("file", "colour_checker", "source", "licence", "geometry", "quantity", "scale", "sha256")


@dataclass(frozen=True, eq=False)
class FamilyTable:
    """Spectra by column name; read, and checked against `sha256`, when first asked for.

    origin : a CSV file, or the name of a chart of colour-science.
    scale : of a reflectance: "fraction", or "percent", which is divided by 100.
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
    scale: Scale = "fraction"

    @cached_property
    def _spectra(self) -> dict[str, Spectrum]:
        if isinstance(self.origin, str):
            spectra = _colour_checker(self.origin, self.file, self.name)
            digest = hashlib.sha256()
            for column, spectrum in spectra.items():
                digest.update(column.encode() + np.stack([spectrum.wavelengths_nm, spectrum.samples]).tobytes())
            found = digest.hexdigest()
        else:
            # Percent has no upper bound before it is divided.
            measured = "radiance factor" if self.scale == "percent" else _MEASURED_AS[self.quantity]
            spectra = read_csv_spectra(self.origin, measured)
            if self.scale == "percent":
                spectra = {column: _in_fractions(spectrum, self.origin, column) for column, spectrum in spectra.items()}
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

    @cached_property
    def labels(self) -> dict[str, str]:
        """Display names of the spectra, by column: those of a chart, others unchanged."""
        found = {column: column for column in self.columns}
        if isinstance(self.origin, str):
            found |= {column: label for column, label, _ in _patches(self.origin, self.file, self.name)}
        return found

    def spectrum(self, column: str) -> Spectrum:
        """Return the spectrum of a column, on its own wavelengths."""
        if column not in self._spectra:
            raise UnknownNameError("column", column, self._spectra, file=self.origin, field=self.name)
        return self._spectra[column]


def constant_spectrum(value: object, quantity: Kind) -> Spectrum:
    """Return the same reflectance or index at every working wavelength."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError("not a number", found=repr(value), expected="a number")
    grid = WORKING_WAVELENGTHS_NM
    values = np.full(grid.size, as_float(value))
    check_values(values, grid, _MEASURED_AS[quantity], field="constant")
    return Spectrum.sampled(grid, values, _MEASURED_AS[quantity])


def tables_from(description: Mapping[str, Any], file: Path) -> dict[str, FamilyTable]:
    """Return the tables that a `sources.toml` describes, by name; nothing of them is read yet."""
    return {name: _table(name, entry, file) for name, entry in description.items()}


def _table(name: str, entry: Any, file: Path) -> FamilyTable:
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
    scale = entry.get("scale", "fraction")
    if scale not in get_args(Scale):
        raise UnknownNameError("scale", str(scale), get_args(Scale), file=file, field=f"{name}.scale")
    if scale == "percent" and (quantity != "reflectance" or "file" not in entry):
        hint = "leave scale out"
        raise InputError(
            "no percent here", file=file, field=f"{name}.scale", expected="a file of reflectances", hint=hint
        )
    origin = file.parent / str(entry["file"]) if "file" in entry else str(entry["colour_checker"])
    geometry, sha256 = str(entry.get("geometry", "")), str(entry.get("sha256", ""))
    return FamilyTable(
        name, origin, str(entry["source"]), str(entry["licence"]), geometry, quantity, sha256, file, scale
    )


def _in_fractions(spectrum: Spectrum, file: Path, column: str) -> Spectrum:
    values = spectrum.samples / 100.0
    check_values(values, spectrum.wavelengths_nm, "reflectance", file=file, field=column)
    return Spectrum.sampled(spectrum.wavelengths_nm, values, "reflectance")


def _colour_checker(chart: str, file: Path, name: str) -> dict[str, Spectrum]:
    """Return the patches of a chart of colour-science; a density in brackets is left out of the names."""
    return {
        column: Spectrum.sampled(values.wavelengths, values.values) for column, _, values in _patches(chart, file, name)
    }


def _patches(chart: str, file: Path, name: str) -> list[tuple[str, str, Any]]:
    """Return column, display name and spectrum of each patch."""
    from ...spectral.colour_library import colour_science
    from .naming import slug

    charts = colour_science().SDS_COLOURCHECKERS
    if chart not in charts:
        raise UnknownNameError("chart", chart, charts, file=file, field=f"{name}.colour_checker")
    named = [(patch.partition("(")[0].strip(), values) for patch, values in charts[chart].items()]
    return [(slug(label), label, values) for label, values in named]
