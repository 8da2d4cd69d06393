"""Spectra of lights named in scenes: an illuminant, a file of spectra, or an emission of the catalogue."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...spectral.formats.import_options import ImportOptions
from ...spectral.formats.registry import SpectralEntry, read_spectra, readers
from ...spectral.illuminants import illuminant, illuminant_names, light_source_names
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

# File suffix, with or without "#ENTRY"; names of illuminants have none.
_FILE = re.compile(r"\.[A-Za-z]\w*(#.*)?$")
# Relative spectra suffice for lamps, so that units and percentages of the peak do not matter.
_A_LAMP = ImportOptions("emission")


def lamp(
    named: str, entry: str | int | None, folder: Path, catalogue: Any = None
) -> tuple[Spectrum, str, tuple[str, ...]]:
    """Return the relative spectral power of a lamp, its name for reports, and notes on assumptions and conversions.

    A file that does not state its quantity is accepted as a lamp; one that states another quantity is refused.

    Parameters
    ----------
    named : an illuminant; else a file, relative to `folder`, in any format of measured spectra; else an id in the
        `catalogue`, an object with `ids()` and `load(id)`, or None.
    entry : spectrum of a file with several, by name or number from 1.

    Raises
    ------
    InputError, UnknownNameError
        An unknown or ambiguous name; a file that cannot be read or holds no lamp, or several without a valid `entry`.
    """
    known = {name.casefold() for name in (*illuminant_names(), *light_source_names())}
    file = folder / named
    stored = catalogue is not None and named in catalogue.ids()
    if file.is_file() and stored:
        raise InputError(
            "a file and a material of the catalogue are called so",
            found=named,
            expected="one of the two",
            hint=f"write ./{named} for the file",
        )
    if file.is_file() and named.casefold() not in known:
        return _from_file(file, named, entry)
    if entry is not None:
        problem = "only a file has columns or entries to choose from"
        raise InputError(problem, field="entry", found=named, expected="a file of spectra")
    if stored:
        return _from_catalogue(named, catalogue)
    if file.suffix.lower() in {suffix for reader in readers() for suffix in reader.SUFFIXES}:
        raise InputError("no such file", file=file, hint="paths in a scene file are relative to it")
    try:
        return illuminant(named), named, ()
    except UnknownNameError as reason:
        if catalogue is None or "/" not in named:
            raise
        lamps = [one for one in catalogue.ids() if catalogue.summary(one).quantity == "emission"]
        raise UnknownNameError("file, illuminant or emission of the catalogue", named, lamps) from reason


def lamp_of_file(named: str | Path) -> tuple[Spectrum, str, tuple[str, ...]] | None:
    """Return `lamp` for FILE or FILE#ENTRY, the entry by name or number; None if `named` is no file name.

    A lamp's name is its entry, or else the file's stem.

    Raises
    ------
    InputError : see `lamp`; a missing file.
    """
    path, _, entry = str(named).rpartition("#")
    file = str(named) if Path(named).is_file() else path
    if not file or not Path(file).is_file():
        if isinstance(named, Path) or _FILE.search(named):
            existing_file(named)
        return None
    chosen = None if file == str(named) else int(entry) if entry.isdigit() else entry
    try:
        spectrum, called, notes = lamp(file, chosen, Path())
    except InputError as reason:
        raise reason.at(hint=f'name one, as in "{file}#1"') if reason.field == "entry" else reason from None
    return spectrum, Path(file).stem if called == file else called, notes


def _from_file(file: Path, named: str, entry: str | int | None) -> tuple[Spectrum, str, tuple[str, ...]]:
    try:
        found = read_spectra(file, _A_LAMP)
    except InputError:
        if said := _quantities(file):
            raise InputError(
                "not the spectrum of a light",
                file=file,
                found=f"{said}, as the file says itself",
                expected="emission",
                hint="name a file of a lamp, or an illuminant (`metamer names` lists them)",
            ) from None
        raise
    chosen = _chosen(list(found.entries), entry, file)
    called = (chosen.name.strip() or named) if len(found.entries) > 1 else named
    notes = [f"{named}: {note}" for note in found.notes]
    return chosen.spectrum, called, (*notes, *_held(chosen.spectrum, named))


def _held(spectrum: Spectrum, named: str) -> tuple[str, ...]:
    """Return notes on the extrapolation of a lamp beyond its measured range."""
    note = spectrum.range_note(WORKING_WAVELENGTHS_NM)
    return (f"{named} is {note}",) if note else ()


def _quantities(file: Path) -> str:
    """Return the quantities that a file states; "" if it states none, or holds a lamp after all."""
    try:
        said = {one.spectrum.quantity for one in read_spectra(file).entries}
    except InputError:
        return ""
    return "" if "emission" in said else ", ".join(sorted(said))


def _chosen(lamps: list[SpectralEntry], entry: str | int | None, file: Path) -> SpectralEntry:
    """Return the spectrum selected by `entry`, or the only one."""
    names = [lamp.name.strip() for lamp in lamps]
    numbered = [f"{number} ({name})" if name else str(number) for number, name in enumerate(names, 1)]
    several = f"{len(lamps)}: {', '.join(numbered[:_SHOWN])}{' ...' if len(lamps) > _SHOWN else ''}"
    if entry is None:
        if len(lamps) == 1:
            return lamps[0]
        raise InputError(
            "which spectrum of the file?",
            file=file,
            field="entry",
            found=several,
            expected="one of them, by its name or number",
            hint=f'entry = "{names[0]}"' if names[0] and names.count(names[0]) == 1 else "entry = 1",
        )
    if isinstance(entry, int):
        if entry > len(lamps):
            raise InputError("no such spectrum in the file", file=file, field="entry", found=entry, expected=several)
        return lamps[entry - 1]
    if entry not in names:
        raise UnknownNameError("spectrum", entry, names, file=file, field="entry")
    if names.count(entry) > 1:
        raise InputError(
            "several spectra of the file are called so", file=file, field="entry", found=entry, expected="a number",
            hint=f"entry = {names.index(entry) + 1}",
        )  # fmt: skip
    return lamps[names.index(entry)]


# Largest number of spectra listed in a message.
_SHOWN = 6


def _from_catalogue(named: str, catalogue: Any) -> tuple[Spectrum, str, tuple[str, ...]]:
    record = catalogue.load(named)
    spectrum = record.measured_spectrum()
    if record.quantity != "emission" or spectrum is None:
        raise InputError(
            "not the spectrum of a light",
            found=f"{named}, which is a {record.quantity}",
            expected="an emission",
            hint="metamer catalogue list --quantity emission shows those that there are",
        )
    return spectrum, named, _held(spectrum, named)
