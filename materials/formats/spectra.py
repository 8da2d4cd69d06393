"""Files of measured spectra as materials: one a spectrum, whatever the format (`spectral.formats.registry`).

A reflectance becomes a perfectly diffuse surface, and the record says so; readings of one coating at several angles
become one surface (`spectra_at_angles`); a transmittance, an emission or a radiance factor is kept as a spectrum
without a surface. The imported measurement (wavelengths, values, stated colours, other details) is in the record's
`original`, so that nothing is lost to the working wavelengths.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from ...runtime.errors import InputError
from ...spectral.angles import AngleReading, Thing, Unlit, things, without_light
from ...spectral.formats import csv, spectral_exr, xlsx
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.formats.registry import (
    SpectralEntry,
    SpectralFile,
    details_of_readings,
    format_of,
    read_with,
    readers,
)
from ...spectral.formats.tables.foreign import is_of_something_else
from ...spectral.measurement import Measurement
from ...spectral.projection import finer_note
from ...spectral.sample import check_range
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ...spectral.wavelengths import material_wavelengths
from ..analytic.lambert import Lambert
from ..effect_coating.flake_tilt import FlakeTilt
from ..records.material import Provenance
from ..records.source import MaterialSource, Rejected
from .measured_source import sha256_of
from .naming import id_word
from .reading_cost import ReadingCost, cost_of_bytes, cost_of_picture
from .spectra_at_angles import reconstruction, refusal_at_angles, refusal_without_light

NAME = "measured spectra"
ASKS = True
SUFFIXES = tuple(dict.fromkeys(suffix for reader in readers() for suffix in reader.SUFFIXES))
# A light that has fallen below this part of its peak where its samples end is taken to be dark beyond.
_DARK_END = 0.02
_FACTORS = ("reflectance", "radiance factor")
_DIFFUSE = "taken to be perfectly diffuse"
_AS_MATT = "read at one of several angles and taken for a matt surface, as asked: elsewhere it looks otherwise"


def recognises(path: Path, head: bytes) -> bool:
    """Return True if a reader of spectra recognises the content."""
    return any(reader.recognises(path, head) for reader in readers())


def label(path: Path) -> str:
    """Return the format of the file."""
    return _reader(path).NAME


def guessed(path: Path) -> bool:
    """Return True if only its name, or only its columns of numbers, suggest that a file is a table of spectra.

    Any text may be called .txt, and a mesh is columns of numbers, too. A .csv must plainly be something else, and a
    workbook must have no table.
    """
    suffix = path.suffix.lower()
    if _reader(path) is xlsx:
        return xlsx.has_no_table(path)
    if _reader(path) is not csv:
        return False
    if suffix in (".csv", ".tsv"):
        return is_of_something_else(path)
    by_content = csv.recognises(path.with_suffix(".unknown"), csv.opening(path))
    return not (by_content and suffix in csv.SUFFIXES)


def reading_cost(path: Path) -> ReadingCost:
    """Estimate the cost of a picture by its pixels and of a text by its words, which take most room."""
    return cost_of_picture(path) if _reader(path) is spectral_exr else cost_of_bytes(path)


def read_sources(path: Path, uplift: str, answer: ImportOptions = NO_ANSWER) -> Iterator[MaterialSource | Rejected]:
    """Yield one material per spectrum, as FILE/SAMPLE.

    Spectra need no `uplift`, and an `answer` if their quantity is not stated. Raises `InputError` as the reader does.
    """
    file = read_with(_reader(path), path, answer)
    family, content = id_word(path.stem), sha256_of(path)
    for name, reason in file.rejected:
        yield Rejected(f"{family}/{name}", reason)
    taken: set[str] = set()
    made, aspecular, unlit = _at_angles(file, path, answer)
    if unlit:
        yield Rejected(
            f"{family}/{id_word(file.entries[min(unlit)].name)}", refusal_without_light(unlit.values(), path)
        )
    for thing in made:
        name = _free(id_word(thing.name or path.stem), taken)
        taken.add(name)
        try:
            if (refusal := refusal_at_angles(thing, path)) is not None:
                raise refusal
            yield _coating(path, family, name, thing, file, [f"{path.name}: SHA-256 {content}"])
        except InputError as reason:
            yield Rejected(f"{family}/{name}", reason.at(file=reason.file or path, field=reason.field or thing.name))
    for number, entry in enumerate(file.entries, 1):
        if number - 1 in unlit or (entry.name in aspecular and aspecular[entry.name] is None):
            continue
        word = id_word(entry.name) if entry.name.strip() else f"sample-{number}"
        name = _free(word, taken)
        taken.add(name)
        notes = [f"named {entry.name!r} in the file, as another sample is"] if name != word else []
        try:
            notes = [*notes, f"{path.name}: SHA-256 {content}"]
            yield _source(path, family, name, entry, file, notes, aspecular.get(entry.name))
        except InputError as reason:
            yield Rejected(f"{family}/{name}", reason)


def _at_angles(
    file: SpectralFile, path: Path, answer: ImportOptions
) -> tuple[list[Thing[SpectralEntry]], dict[str, str | None], dict[int, str]]:
    """Coatings that were read at several angles, one a material, and what is made of each of their readings by name:
    "lambert" or "radiance factor" as the answer says, else None, and the coatings are the materials. Last, by their
    place, words of readings that seem to be at angles without that of the light, where some would be matt unasked.
    """
    beside = details_of_readings(file, path)
    readings = [
        AngleReading(
            one,
            one.name,
            one.details.get("object", ""),
            Measurement.of(one.spectrum.quantity, {**beside, **one.details}, one.name),
        )
        for one in file.entries
        if one.spectrum.quantity != "emission"
    ]
    each = "radiance factor" if answer.quantity == "radiance factor" else "lambert" if answer.angles else None
    found = [thing for thing in things(readings) if thing.angles]
    drawn: dict[str, str | None] = {one.name: each for thing in found for one in thing.readings}
    others = [at for at, one in enumerate(file.entries) if one.spectrum.quantity in _FACTORS and one.name not in drawn]
    told = [file.entries[at] for at in others]
    unlit = without_light([one.name for one in told], [{**beside, **one.details} for one in told])
    if len(told) == 1 and not unlit:
        words = _files_at_angles(path.parent, path.parent.stat().st_mtime_ns).get(path.name)
        unlit = {} if words is None else {0: Unlit(words, 0.0, True)}
    if each or not any(told[at].spectrum.quantity == "reflectance" for at in unlit):
        return ([] if each else found), drawn | ({told[at].name: each for at in unlit} if each else {}), {}
    return found, drawn, {others[at]: one.words for at, one in unlit.items()}


@lru_cache(maxsize=1)  # files of a folder are read one after the other
def _files_at_angles(folder: Path, mtime_ns: int) -> dict[str, str]:
    """Return the names of files of one thing at several aspecular angles (`without_light`), by the name of each.

    None if the folder must not be listed.
    """
    by_suffix: dict[str, list[str]] = {}
    with suppress(PermissionError):
        for one in folder.iterdir():
            by_suffix.setdefault(one.suffix, []).append(one.name)
    found: dict[str, str] = {}
    for suffix, names in by_suffix.items():
        names.sort()
        alike = [names[at] for at in without_light([name.removesuffix(suffix) for name in names], [{}] * len(names))]
        found |= dict.fromkeys(alike, ", ".join(alike))
    return found


def _coating(
    path: Path, family: str, name: str, thing: Thing[SpectralEntry], file: SpectralFile, notes: list[str]
) -> MaterialSource:
    """Make one material of readings at several angles: these, and a BRDF fitted to them."""
    for one in thing.readings:
        _check_visible(one.item.spectrum, path, one.name)
    first = thing.readings[0].item
    found = reconstruction(thing)
    ranges = [note for one in thing.readings if (note := one.item.spectrum.range_note(WORKING_WAVELENGTHS_NM))]
    said = dict.fromkeys([*found.notes, *(one.item.taken for one in thing.readings), *file.notes, *ranges, *notes])
    provenance = Provenance(
        source=f"{path.name} ({file.format}): {_text(thing.name).strip() or name}",
        licence=_stated(file.details, "licence", "license", "copyright") or "not stated in the file",
        kind=found.kind,
        geometry=found.geometry,
        notes=" + ".join(note for note in said if note),
    )
    alike = {
        key: text
        for key, text in first.details.items()
        if key != "geometry" and all(one.item.details.get(key) == text for one in thing.readings)
    }
    original = {
        "file": path.name,
        "format": file.format,
        "name": _text(thing.name),
        **found.original,
        **{f"details.{key}": _text(value) for key, value in alike.items()},
        **{f"file.{key}": _text(value) for key, value in file.details.items()},
    }
    return MaterialSource(
        f"{family}/{name}", family, FlakeTilt.NAME, found.brdf.parameters(), provenance, path, original, found.kind
    )


def _free(word: str, taken: set[str]) -> str:
    """Make a word unique by appending the first free number from 2."""
    name, number = word, 2
    while name in taken:
        name, number = f"{word}-{number}", number + 1
    return name


def _reader(path: Path) -> ModuleType:
    state = path.stat()
    return _reader_of(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=1)  # label, doubts and spectra are asked for one after the other
def _reader_of(path: Path, mtime_ns: int, size: int) -> ModuleType:
    by_name = [reader for reader in readers() if path.suffix.lower() in reader.SUFFIXES]
    # Any text may be called .txt: an unrecognised one is no table, rather than CGATS cut short.
    reader = format_of(path) or (csv if csv in by_name else next(iter(by_name), None))
    if reader is None:
        raise InputError("not a file of spectra", file=path, expected=", ".join(known.NAME for known in readers()))
    return reader


def _source(
    path: Path,
    family: str,
    name: str,
    entry: SpectralEntry,
    file: SpectralFile,
    notes: list[str],
    aspecular: str | None = None,
) -> MaterialSource:
    """Make one material; `aspecular` : what is made of a reading at one of several angles, None of any other."""
    spectrum = entry.spectrum
    if aspecular == "radiance factor":
        # A reflectance at such an angle is a radiance factor, whatever its file calls it.
        spectrum = Spectrum.sampled(spectrum.wavelengths_nm, spectrum.samples, "radiance factor")
        entry = replace(entry, spectrum=spectrum)
    elif aspecular == "lambert":
        notes = [_AS_MATT, *notes]
    _check_visible(spectrum, path, entry.name)
    notes = [entry.taken, *file.notes, *notes] if entry.taken else [*file.notes, *notes]
    if spectrum.quantity == "reflectance":
        model, parameters, said = Lambert.NAME, *_diffuse(spectrum)
        notes = [_DIFFUSE, *said, *notes]
    else:
        model, parameters = spectrum.quantity.replace(" ", "_"), {}
    provenance = Provenance(
        source=f"{path.name} ({file.format}): {_text(entry.name).strip() or name}",
        licence=_stated(file.details, "licence", "license", "copyright") or "not stated in the file",
        kind="measured",
        geometry=_stated({**file.details, **entry.details}, "geometry"),
        notes=" + ".join(notes),
    )
    original = _original(path, entry, file)
    return MaterialSource(f"{family}/{name}", family, model, parameters, provenance, path, original, _planned(entry))


def _planned(entry: SpectralEntry) -> str:
    """Describe the assumed quantity of a spectrum, and its range if that ends within the visible."""
    grid, nm = WORKING_WAVELENGTHS_NM, entry.spectrum.wavelengths_nm
    cut = nm[0] > grid[0] or nm[-1] < grid[-1]
    return f"{entry.taken}; known from {nm[0]:g} to {nm[-1]:g} nm only" if cut and entry.taken else entry.taken


def _check_visible(spectrum: Spectrum, path: Path, name: str) -> None:
    """Refuse a spectrum that covers too little of the visible for a colour.

    A light may end before the visible does, and is then dark beyond: missing counts only past an end where it still
    emits.
    """
    grid, nm = WORKING_WAVELENGTHS_NM, spectrum.wavelengths_nm
    if nm.size < 2 or nm[-1] <= grid[0] or nm[0] >= grid[-1]:
        raise InputError(
            "no spectrum of visible light",
            file=path,
            field=name,
            found=f"{nm.size} wavelengths, {nm[0]:g} to {nm[-1]:g} nm",
            expected=f"two or more, some within {grid[0]:g} to {grid[-1]:g} nm",
            hint="export the visible part of the measurement",
        )
    ends = [float(nm[0]), float(nm[-1])]
    if spectrum.quantity == "emission":
        dark = _DARK_END * float(spectrum.samples.max())
        ends = [
            min(ends[0], grid[0]) if spectrum.samples[0] <= dark else ends[0],
            max(ends[1], grid[-1]) if spectrum.samples[-1] <= dark else ends[1],
        ]
    check_range(ends[0], ends[1], path, name)


def _diffuse(spectrum: Spectrum) -> tuple[dict[str, Any], list[str]]:
    """Make the parameters of a diffuse surface (`material_wavelengths`), and note the assumptions."""
    nm = spectrum.wavelengths_nm
    brdf = Lambert(spectrum.resampled(material_wavelengths([nm])))
    said = [note for note in (spectrum.range_note(WORKING_WAVELENGTHS_NM), finer_note(nm)) if note]
    return {"wavelengths_nm": brdf.wavelengths_nm, **brdf.parameters()}, said


def _original(path: Path, entry: SpectralEntry, file: SpectralFile) -> dict[str, Any]:
    """Collect all content of the entry, flat; `details` of the whole file under `file.`."""
    found: dict[str, Any] = {
        "file": path.name,
        "format": file.format,
        "name": _text(entry.name),
        "quantity": entry.spectrum.quantity,
        "wavelengths_nm": entry.spectrum.wavelengths_nm,
        "values": entry.spectrum.samples,
    }
    for number, stated in enumerate(entry.stated):
        found |= {f"stated.{number}.space": stated.space, f"stated.{number}.values": stated.values}
        for part in ("illuminant", "observer"):
            if (said := getattr(stated, part)) is not None:
                found[f"stated.{number}.{part}"] = said
    found |= {f"details.{key}": _text(value) for key, value in entry.details.items()}
    return found | {f"file.{key}": _text(value) for key, value in file.details.items()}


def _text(value: object) -> str:
    # A NUL ends a text in HDF5, and half a character is none.
    return str(value).replace("\0", "").encode("utf-8", "replace").decode("utf-8")


def _stated(details: Mapping[str, str], *keys: str) -> str:
    """Return the first of these details that the file has."""
    known = {key.casefold(): value for key, value in details.items()}
    return next((known[key].strip() for key in keys if known.get(key, "").strip()), "")
