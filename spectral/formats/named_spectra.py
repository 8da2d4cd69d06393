"""Spectra of a file by their names, for scripts."""

from __future__ import annotations

import warnings
from pathlib import Path

from ..spectrum import Quantity, Spectrum
from .import_options import Decimal, ImportOptions, Scale
from .registry import read_spectra as read_file
from .shared.decisions import BY_ANSWER


def read_spectra(
    file: str | Path, *, as_: Quantity | None = None, scale: Scale | None = None, decimal: Decimal | None = None
) -> dict[str, Spectrum]:
    """Read the spectra of a file, whichever format it has, in their order.

    What the file leaves open is asked for by an error; what is given here counts for more than the file's words.
    Python's warnings tell what was assumed, and what could not be used.

    Parameters
    ----------
    file : CSV, XLSX, CGATS, CxF3, QTX, JCAMP-DX, EXR and others that `metamer catalogue import` reads spectra from.
    as_ : quantity of the values, where the file does not say it, or not rightly: "reflectance", "transmittance",
        "radiance factor", "emission". scale : "fraction" or "percent". decimal : mark of numbers, "point" or "comma".

    Returns
    -------
    Names that come twice get a number: "red", "red (2)".

    Raises
    ------
    InputError : no such file, no spectra in it, or something that it leaves open.
    """
    found = read_file(file, ImportOptions(as_, scale, decimal=decimal, against="overruled"))
    for called, reason in found.rejected:
        warnings.warn(f"{called} is left out: {reason}", stacklevel=2)
    # What was asked for is no news.
    for note in (note for note in found.notes if not note.startswith(BY_ANSWER) or ";" in note):
        warnings.warn(note, stacklevel=2)
    spectra: dict[str, Spectrum] = {}
    for entry in found.entries:
        name, number = entry.name, 2
        while name in spectra:
            name, number = f"{entry.name} ({number})", number + 1
        spectra[name] = entry.spectrum
    return spectra
