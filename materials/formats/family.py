"""Reader of family descriptions: TOML files with a model and its parameters, spectra by table and column.

A folder of descriptions also holds `sources.toml`, which lists its tables of spectra with their source, licence and
SHA-256 (`family_tables`). docs/catalogue.md describes the format of both.
"""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import read_text
from ...spectral.projection import finer_note
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ...spectral.wavelengths import material_wavelengths
from ..analytic.instrument import ReadBrdf
from ..records.colour_standing import COLOUR, COLOUR_RANGE, STANDINGS, TITLE
from ..records.material import Provenance
from ..records.models import model_named
from ..records.source import MaterialSource, Rejected
from .family_tables import FamilyTable, Kind, constant_spectrum, tables_from

NAME = "family description"
SUFFIXES = (".toml",)
TABLES_FILE = "sources.toml"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_FAMILY_KEYS = ("family", "kind", "colour", "notes", "material")
_MATERIAL_KEYS = ("name", "title", "model", "notes", "each")
# In place of a geometry: the spectrum is that of the model's own body, not of the whole.
_OF_THE_BODY = "body"
_OURS = re.compile(rb"^\s*(family\s*=|\[\[\s*material\s*\]\])", re.MULTILINE)


def recognises(path: Path, head: bytes) -> bool:
    """True for a .toml file that says `family =` or `[[material]]`, whole or not."""
    return path.suffix.lower() in SUFFIXES and path.name != TABLES_FILE and _OURS.search(path.read_bytes()) is not None


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """Yield every material of the family; an error in one of them does not stop the others."""
    yield from _family(path)


def companions(path: Path) -> Iterator[Path]:
    """Yield the files that belong to a description: `sources.toml` beside it, and the tables that it lists."""
    manifest = path.parent / TABLES_FILE
    if manifest.is_file():
        yield manifest
        try:
            tables = tables_from(read_toml(manifest), manifest)
        except InputError:
            return
        yield from (table.origin for table in tables.values() if isinstance(table.origin, Path))


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file as a dictionary; raises `InputError` that names it."""
    try:
        return tomllib.loads(read_text(path, "a TOML file"))
    except tomllib.TOMLDecodeError as reason:
        raise InputError("not valid TOML", file=path, found=str(reason)) from None


def _family(path: Path) -> Iterator[MaterialSource | Rejected]:
    values = read_toml(path)
    _expect_keys(values, _FAMILY_KEYS, path, "")
    family = _name(values.get("family"), path, "family")
    manifest = path.parent / TABLES_FILE
    tables = tables_from(read_toml(manifest), manifest) if manifest.exists() else {}
    entries = values.get("material", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InputError("not a list of materials", file=path, field="material", expected="[[material]] sections")
    for entry in entries:
        template = str(entry.get("name"))
        try:
            table = _table(entry["each"], tables, path, f"{template}.each") if "each" in entry else None
            labels = {"": ""} if table is None else table.labels
        except InputError as reason:
            yield Rejected(f"{family}/{template}", reason)
            continue
        for column, label in labels.items():
            name = template.replace("{column}", column)
            try:
                yield _Entry(path, family, name, column, label, values | entry, tables).material()
            except InputError as reason:
                yield Rejected(f"{family}/{name}", reason)


@dataclass(frozen=True)
class _Entry:
    """One material of a description: `values` are its own keys over those of its family."""

    path: Path
    family: str
    name: str
    column: str
    label: str
    values: Mapping[str, Any]
    tables: Mapping[str, FamilyTable]

    def material(self) -> MaterialSource:
        _name(self.name, self.path, "name")
        model = model_named(str(self.values.get("model")), self.path, f"{self.name}.model")
        kinds = {field.name: str(field.type) for field in dataclasses.fields(cast(Any, model)) if field.init}
        _expect_keys(self.values, (*_FAMILY_KEYS, *_MATERIAL_KEYS, *kinds), self.path, self.name)
        said = self._said()
        used: dict[str, FamilyTable] = {}
        read = model.READ if issubclass(model, ReadBrdf) else None
        notes = [str(self.values.get("notes", ""))]
        arguments = {key: self.values[key] for key in kinds if key in self.values}
        spectra = {
            key: self._spectrum(key, "reflectance" if kinds[key] == "Spectrum" else "index", used, key == read)
            for key, value in arguments.items()
            if isinstance(value, dict)
        }
        measured = [spectra[key].wavelengths_nm for key in spectra if "constant" not in arguments[key]]
        grid = material_wavelengths(measured)
        body = next((key for key in spectra if kinds[key] == "Spectrum" and "constant" not in arguments[key]), None)
        if said.get(COLOUR) == "measured":
            if body is None:
                expected = "a reflectance from a table"
                raise InputError("no measured colour", file=self.path, field=f"{self.name}.colour", expected=expected)
            said[COLOUR_RANGE] = spectra[body].wavelengths_nm[[0, -1]]
        for key, spectrum in spectra.items():
            invented = spectrum.range_note(WORKING_WAVELENGTHS_NM)
            notes += [f"{key} {invented}"] if invented else []
            finer = finer_note(spectrum.wavelengths_nm)
            notes += [f"{key} {finer}"] if finer else []
            spectrum = spectrum.resampled(grid)
            arguments[key] = spectrum if kinds[key] == "Spectrum" else spectrum.samples
        with self._placed(self.name):
            try:
                brdf = model(**arguments)
            except TypeError as reason:
                raise InputError("parameters do not make the model", found=str(reason)) from None
            geometry = _joined(table.geometry for table in used.values())
            if isinstance(brdf, ReadBrdf) and (read_at := self._read_at(brdf.READ, used)) is not None:
                brdf, geometry = brdf.reads(getattr(brdf, brdf.READ), read_at), read_at
                notes.append(f"{brdf.READ} is the one with which the whole reads as the table does at {read_at}")
        with self._placed():
            provenance = Provenance(
                source=_joined(table.source for table in used.values()) or "made up for this catalogue",
                licence=_joined(table.licence for table in used.values()) or "that of the description",
                kind=str(self.values.get("kind", "")),
                geometry=geometry,
                notes=_joined(notes),
            )
        parameters = {"wavelengths_nm": grid, **brdf.parameters()}
        material_id = f"{self.family}/{self.name}"
        return MaterialSource(material_id, self.family, model.NAME, parameters, provenance, self.path, said)

    def _said(self) -> dict[str, Any]:
        """Read the title of the material and the standing of its colour from the description."""
        said: dict[str, Any] = {}
        if (colour := self.values.get("colour")) is not None:
            if colour not in STANDINGS:
                raise UnknownNameError("colour", str(colour), STANDINGS, file=self.path, field=f"{self.name}.colour")
            said[COLOUR] = colour
        if (title := self.values.get("title")) is not None:
            if not isinstance(title, str) or not title.strip():
                expected = "words for people"
                raise InputError(
                    "no title", file=self.path, field=f"{self.name}.title", found=repr(title), expected=expected
                )
            title = title.replace("{column}", self.label).strip()
            said[TITLE] = title[0].upper() + title[1:]
        return said

    def _spectrum(self, key: str, quantity: Kind, used: dict[str, FamilyTable], read: bool) -> Spectrum:
        """Return the spectrum of { constant } or { table, column }; its table is recorded in `used`."""
        value, field = self.values[key], f"{self.name}.{key}"
        if set(value) == {"constant"}:
            with self._placed(field):
                return constant_spectrum(value["constant"], quantity)
        _expect_keys(value, ("table", "column", *(("geometry",) if read else ())), self.path, field)
        table = _table(value.get("table"), self.tables, self.path, field)
        if table.quantity != quantity:
            raise InputError(
                "a table of another quantity", file=self.path, field=field, found=table.quantity, expected=quantity
            )
        used[table.name] = table
        return table.spectrum(str(value.get("column")).replace("{column}", self.column))

    def _read_at(self, key: str, used: Mapping[str, FamilyTable]) -> str | None:
        """Return the geometry at which a table's spectrum was read of the whole; None if it is of the body alone."""
        value = self.values.get(key)
        if not isinstance(value, dict) or "table" not in value:
            return None
        geometry = str(value.get("geometry", used[str(value["table"])].geometry))
        return None if geometry == _OF_THE_BODY else geometry

    @contextmanager
    def _placed(self, *within: str) -> Iterator[None]:
        """Add the file and the place in it to the errors of a value's own check."""
        try:
            yield
        except InputError as reason:
            field = ".".join((*within, *([reason.field] if reason.field else [])))
            raise reason.at(file=self.path, field=field) from None


def _table(name: Any, tables: Mapping[str, FamilyTable], path: Path, field: str) -> FamilyTable:
    if name not in tables:
        raise UnknownNameError("table", str(name), tables, file=path, field=field)
    return tables[name]


def _name(name: Any, path: Path, field: str) -> str:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        expected = "lower-case letters, digits and single hyphens"
        raise InputError("unusable name", file=path, field=field, found=repr(name), expected=expected)
    return name


def _expect_keys(found: Mapping[str, Any], known: tuple[str, ...], path: Path, field: str) -> None:
    for key in found:
        if key not in known:
            raise UnknownNameError("key", key, known, file=path, field=f"{field}.{key}" if field else key)


def _joined(texts: Iterable[str]) -> str:
    return " + ".join(dict.fromkeys(text for text in texts if text))
