"""Files of measured spectra: what a reader gives, and which reader takes a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import wraps
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Concatenate, Literal, ParamSpec, TypeVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ..measurement import FILE_NAME
from ..spectrum import Spectrum
from .import_options import NO_ANSWER, AgainstAnswerError, ImportOptions, contradiction
from .unread_sheets import unread_sheet

#: Readers by module name, the most particular first: the first that recognises a file reads it. A reader has NAME,
#: SUFFIXES, `recognises(path, head)` and `read(path)`; one whose files may leave open what was measured has ASKS = True
#: and `read(path, answer)`. SCALED = True has that, too, where a person may say the scale against the format.
FORMATS = (
    "spectral_exr",
    "mat",
    "xlsx",
    "cxf",
    "iestm27",
    "qtx",
    "jcamp",
    "cgats",
    "instrument_text",
    "spd",
    "csv",
)

#: Bytes of a file that `recognises` is shown.
HEAD = 4096

_Options = ParamSpec("_Options")
_Read = TypeVar("_Read")


def names_its_file(read: Callable[Concatenate[Path, _Options], _Read]) -> Callable[Concatenate[Path, _Options], _Read]:
    """Return a reader whose refusals name the file that it was given: nothing below it has to carry the path about."""

    @wraps(read)
    def named(path: Path, *options: _Options.args, **further: _Options.kwargs) -> _Read:
        try:
            return read(Path(path), *options, **further)
        except InputError as reason:
            raise (reason.at(file=path) if reason.file is None else reason) from None

    return named


@dataclass(frozen=True, eq=False)
class StatedColour:
    """Tristimulus values that a file states beside a spectrum.

    Parameters
    ----------
    space : "XYZ", on the scale that gives the perfect diffuser Y = 100 (emission: in the file's unit), or "Lab".
    values : (3,).
    illuminant : name as `illuminant` knows it, else the file's own words; None where the file does not say.
    observer : short name as `observer` knows it, else the file's own words; None where the file does not say.
    """

    space: Literal["XYZ", "Lab"]
    values: Float[np.ndarray, "3"]
    illuminant: str | None = None
    observer: str | None = None


@dataclass(frozen=True, eq=False)
class SpectralEntry:
    """One measured spectrum of a file.

    Parameters
    ----------
    name : as in the file.
    spectrum : at the file's own wavelengths; percent is already divided by 100.
    stated : tristimulus values beside it.
    details : whatever else the file says of it: geometry, condition (M0 ... M3), instrument, units, ...
    taken : which quantity and scale it was taken for, and by which signs; "" where the format itself says so.
    """

    name: str
    spectrum: Spectrum
    stated: tuple[StatedColour, ...] = ()
    details: Mapping[str, str] = field(default_factory=dict)
    taken: str = ""


@dataclass(frozen=True, eq=False)
class SpectralFile:
    """Every spectrum of a file.

    Parameters
    ----------
    format : NAME of the reader.
    entries : spectra, in the order of the file.
    details : what the file says of all of them.
    notes : what was assumed, converted or left out, a sentence each.
    rejected : entries that cannot be used, by name, with the reason.
    """

    format: str
    entries: tuple[SpectralEntry, ...]
    details: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    rejected: tuple[tuple[str, InputError], ...] = ()


def details_of_readings(file: SpectralFile, path: str | Path) -> dict[str, str]:
    """Collect the details of measurement that a file states for all its readings: its format, its name, and the header
    of a text.

    CxF3 and CGATS say it reading by reading, and beside other tables.
    """
    header = {} if file.format in ("CxF3", "CGATS") else {key: str(value) for key, value in file.details.items()}
    return {**header, "format": file.format, FILE_NAME: Path(path).stem}


def readers() -> tuple[ModuleType, ...]:
    """Return the readers, in the order in which they are asked."""
    return tuple(import_module(f".{name}", __package__) for name in FORMATS)


def format_of(path: str | Path) -> ModuleType | None:
    """Return the reader that recognises a file by its content, None if there is none.

    Raises
    ------
    InputError
        There is no such file, or it cannot be opened.
    """
    path = existing_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as reason:
        raise InputError("the file cannot be read", file=path, found=reason.strerror) from None
    return next((reader for reader in readers() if reader.recognises(path, head)), None)


def read_spectra(path: str | Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read every spectrum of a file in whatever format it is.

    Parameters
    ----------
    answer : what was measured, where the file does not say it.

    Raises
    ------
    InputError
        No reader recognises the file, or the one that does cannot use it.
    """
    reader = format_of(path)
    if reader is None:
        with Path(path).open("rb") as file:
            head = file.read(HEAD)
        start = head[:16]
        if (sheet := unread_sheet(Path(path), head)) is not None:
            raise InputError(
                "a workbook that is not read",
                file=path,
                found=sheet.name,
                expected="an .xlsx workbook",
                hint=sheet.hint,
            )
        raise InputError(
            "not a file of spectra" if start else "the file is empty",
            file=path,
            found=f"first bytes {start!r}" if start else None,
            expected="one of: " + ", ".join(known.NAME for known in readers()),
            hint="export the measurement as CxF3, CGATS or a table with one wavelength a row",
        )
    return read_with(reader, Path(path), answer)


def read_filling_gaps(path: str | Path, answer: ImportOptions) -> tuple[SpectralFile, str]:
    """Read a file with an answer that is given for several: what the file states itself counts before it.

    Returns the file, and a sentence on what of the answer was left out; "" where nothing was.

    Raises
    ------
    InputError
        As of `read_spectra`.
    """
    given, left_out = answer, []
    while True:
        file = refusal = None
        try:
            file = read_spectra(path, given)
            refusals = [reason for _, reason in file.rejected]
        except InputError as reason:
            refusal, refusals = reason, [reason]
        against = {reason.part for reason in refusals if isinstance(reason, AgainstAnswerError)}
        if given.quantity is not None and "quantity" in against:
            left_out.append(f"--as {given.quantity.replace(' ', '-')}")
            given = replace(given, quantity=None)
        elif given.scale is not None and "scale" in against:
            left_out.append(f"--scale {given.scale}")
            given = replace(given, scale=None)
        elif refusal is not None:
            raise refusal
        elif file is not None:
            words = f"{Path(path).name} says itself what it holds: {' and '.join(left_out)} does not count for it."
            return file, words if left_out else ""


def read_with(reader: ModuleType, path: Path, answer: ImportOptions) -> SpectralFile:
    """Read a file by one reader; spectra whose format says another quantity than the answer are among `rejected`, or
    are taken as answered where the answer is about this file alone.

    Raises
    ------
    InputError
        As the reader does; or every spectrum of the file is of another quantity.
    """
    if getattr(reader, "ASKS", False):
        return reader.read(path, answer)
    scaled = getattr(reader, "SCALED", False)
    file = reader.read(path, answer) if scaled else reader.read(path)
    said = f"the format ({reader.NAME})"
    entries, rejected = [], list(file.rejected)
    for entry in file.entries:
        quantity = entry.spectrum.quantity
        if answer.allows(quantity) or answer.against == "kept":
            entries.append(entry if entry.taken else replace(entry, taken=f"{quantity}, by {said}"))
        elif answer.against == "overruled":
            try:
                entries.append(_overruled(entry, answer, said, scaled and entry.spectrum.quantity != "emission"))
            except InputError as reason:
                rejected.append((entry.name, reason.at(file=path, field=entry.name)))
        else:
            rejected.append((entry.name, contradiction(answer, quantity, said, file=path, field=entry.name)))
    if file.entries and not entries:
        raise rejected[len(file.rejected)][1]
    notes = file.notes
    if any(entry.stated for entry in file.entries) and not any(entry.stated for entry in entries):
        notes = (*notes, "colours beside the spectra are of another quantity than --as says, and are left out")
    return replace(file, entries=tuple(entries), rejected=tuple(rejected), notes=notes)


def _overruled(entry: SpectralEntry, answer: ImportOptions, said: str, scaled: bool) -> SpectralEntry:
    """Return the spectrum as the answer says; the colours beside it are those of what the format says, and are left
    out.

    scaled : whether its values are on the scale of the answer already.
    """
    assert answer.quantity is not None
    spectrum, percent = entry.spectrum, answer.scale == "percent"
    values = spectrum.samples / 100.0 if percent and not scaled else spectrum.samples
    scale = "" if answer.scale is None else f" in {'percent' if percent else 'fractions'}"
    return replace(
        entry,
        spectrum=Spectrum.sampled(spectrum.wavelengths_nm, values, answer.quantity),
        stated=(),
        taken=f"{answer.quantity}{scale}, by --as, against {said}",
    )
