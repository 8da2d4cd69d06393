"""Files of measured spectra as materials: one a spectrum, whatever the format (`spectral.formats.reading`).

A reflectance becomes a perfectly diffuse surface, and the record says so; a transmittance, an emission or a radiance
factor is kept as a spectrum without a surface. The measurement as it came (wavelengths, values, stated colours, what
else the file says) is in the record's `original`, so that nothing is lost to the working wavelengths.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from ...spectral.errors import InputError
from ...spectral.formats import csv
from ...spectral.formats.reading import HEAD, SpectralEntry, SpectralFile, format_of, readers
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..analytic.lambert import Lambert
from ..intake.sources import MaterialSource, Rejected
from ..records.material import Provenance
from .measured import sha256_of
from .naming import id_word

NAME = "measured spectra"
SUFFIXES = tuple(dict.fromkeys(suffix for reader in readers() for suffix in reader.SUFFIXES))
_DIFFUSE = "taken to be perfectly diffuse"


def recognises(path: Path, head: bytes) -> bool:
    """True where a reader of spectra knows the content."""
    return any(reader.recognises(path, head) for reader in readers())


def label(path: Path) -> str:
    """The format of the file."""
    return _reader(path).NAME


def guessed(path: Path) -> bool:
    """True where nothing but its name, or nothing but its columns of numbers, says that a file is a table of spectra.

    Any text may be called .txt, and a mesh is columns of numbers, too.
    """
    suffix = path.suffix.lower()
    if _reader(path) is not csv or suffix in (".csv", ".tsv"):
        return False
    with path.open("rb") as file:
        by_content = csv.recognises(path.with_suffix(".unknown"), file.read(HEAD))
    return not (by_content and suffix in csv.SUFFIXES)


def read_sources(path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
    """One material a spectrum, as FILE/SAMPLE; spectra need no `uplift`. Raises `InputError` as the reader does."""
    file = _reader(path).read(path)
    family, content = id_word(path.stem), sha256_of(path)
    for name, reason in file.rejected:
        yield Rejected(f"{family}/{name}", reason)
    taken: set[str] = set()
    for number, entry in enumerate(file.entries, 1):
        word = id_word(entry.name) if entry.name.strip() else f"sample-{number}"
        name = _free(word, taken)
        taken.add(name)
        notes = [f"named {entry.name!r} in the file, as another sample is"] if name != word else []
        try:
            yield _source(path, family, name, entry, file, [*notes, f"{path.name}: SHA-256 {content}"])
        except InputError as reason:
            yield Rejected(f"{family}/{name}", reason)


def _free(word: str, taken: set[str]) -> str:
    """The word, or the word with the first number from 2 that makes it a new one."""
    name, number = word, 2
    while name in taken:
        name, number = f"{word}-{number}", number + 1
    return name


def _reader(path: Path) -> ModuleType:
    by_name = (reader for reader in readers() if path.suffix.lower() in reader.SUFFIXES)
    reader = format_of(path) or next(by_name, None)
    if reader is None:
        raise InputError("not a file of spectra", file=path, expected=", ".join(known.NAME for known in readers()))
    return reader


def _source(
    path: Path, family: str, name: str, entry: SpectralEntry, file: SpectralFile, notes: list[str]
) -> MaterialSource:
    spectrum = entry.spectrum
    notes = [*file.notes, *notes]
    if spectrum.quantity == "reflectance":
        model, parameters, said = Lambert.NAME, *_diffuse(spectrum, path, entry.name)
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
    return MaterialSource(f"{family}/{name}", family, model, parameters, provenance, path, original)


def _diffuse(spectrum: Spectrum, path: Path, name: str) -> tuple[dict[str, Any], list[str]]:
    """Parameters of a diffuse surface on the working wavelengths, and what had to be assumed for them."""
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
    beyond = spectrum.range_note(grid)
    brdf = Lambert(spectrum.resampled(grid))
    return {"wavelengths_nm": grid, **brdf.parameters()}, [beyond] if beyond else []


def _original(path: Path, entry: SpectralEntry, file: SpectralFile) -> dict[str, Any]:
    """Everything that the file says of the entry, flat; `details` of the whole file under `file.`."""
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
    """The first of these details that the file gives."""
    known = {key.casefold(): value for key, value in details.items()}
    return next((known[key].strip() for key in keys if known.get(key, "").strip()), "")
