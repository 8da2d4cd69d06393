"""Spectra of a file by their names, for scripts."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import get_args

from ...runtime.errors import InputError
from ..spectrum import Quantity, Spectrum
from .import_options import Decimal, ImportOptions, Scale
from .registry import read_spectra as read_file
from .shared.decisions import BY_ANSWER

# An option of an import with its value, several values, or none.
_WORDS = "|".join(word.replace(" ", "[- ]") for kind in (Quantity, Scale, Decimal) for word in get_args(kind))
_OPTION = re.compile(rf"--(as|scale|decimal)(?![\w-])((?:(?: |, | or )(?:{_WORDS})\b)*)")
_VALUE = re.compile(rf"\b(?:{_WORDS})\b")
_IMPORT = re.compile(r"\bimport (?=this file|it )")
# Most names of left-out spectra given in full.
_FEW = 8


def read_spectra(
    file: str | Path,
    *,
    as_: Quantity | None = None,
    scale: Scale | None = None,
    decimal: Decimal | None = None,
    skip: bool = False,
) -> dict[str, Spectrum]:
    """Read the spectra of a file, whichever format it has, in their order.

    What the file leaves open is asked for by an error; what is given here counts for more than the file's words.
    Python's warnings tell what was assumed.

    Parameters
    ----------
    file : CSV, XLSX, CGATS, CxF3, QTX, JCAMP-DX, EXR and others that `metamer catalogue import` reads spectra from.
    as_ : quantity of the values, where the file does not say it, or not rightly: "reflectance", "transmittance",
        "radiance factor", "emission". scale : "fraction" or "percent". decimal : mark of numbers, "point" or "comma".
    skip : leave out spectra that cannot be used, with a warning for each, in place of an error.

    Returns
    -------
    Names that come twice get a number: "red", "red (2)".

    Raises
    ------
    InputError : no such file, no spectra in it, one that cannot be used, or something that it leaves open.
    """
    try:
        found = read_file(file, ImportOptions(as_, scale, decimal=decimal, against="overruled"))
    except InputError as reason:
        raise _as_arguments(reason) from None
    if found.rejected and not (skip and found.entries):
        raise _refusal(file, found.rejected, len(found.entries))
    for called, reason in found.rejected:
        warnings.warn(f"{called} is left out: {_as_arguments(reason)}", stacklevel=2)
    # Notes that repeat an argument are left out.
    for note in (note for note in found.notes if not note.startswith(BY_ANSWER) or ";" in note):
        warnings.warn(in_python(note), stacklevel=2)
    spectra: dict[str, Spectrum] = {}
    for entry in found.entries:
        name, number = entry.name, 2
        while name in spectra:
            name, number = f"{entry.name} ({number})", number + 1
        spectra[name] = entry.spectrum
    return spectra


def _refusal(file: str | Path, rejected: tuple[tuple[str, InputError], ...], usable: int) -> InputError:
    """Return the first reason, with how many spectra are refused, which others, and how the rest is read."""
    (called, first), *others = rejected
    reason = _as_arguments(first)
    problem = reason.problem
    if others or usable:
        problem += f" ({len(rejected)} of {len(rejected) + usable} spectra cannot be used"
        names = ", ".join(repr(name) for name, _ in others[:_FEW])
        names += f" and {len(others) - _FEW} more" if len(others) > _FEW else ""
        problem += f"; beside {called!r}, {names})" if others else ")"
    hint = "; ".join(part for part in (reason.hint, "skip=True reads the others alone" if usable else None) if part)
    return reason.at(problem=problem, file=reason.file or file, field=reason.field or called, hint=hint or None)


def _as_arguments(reason: InputError) -> InputError:
    """Return the error with the arguments of `read_spectra` where it names options of the command."""
    names = ("problem", "field", "found", "expected", "hint")
    texts = {name: getattr(reason, name) for name in names}
    return reason.at(**{name: in_python(text) for name, text in texts.items() if isinstance(text, str)})  # type: ignore[arg-type]


def in_python(text: str) -> str:
    """Write options of an import as arguments of `read_spectra`.

    >>> in_python("import this file alone, --as emission or radiance-factor, or leave --scale out")
    'read this file alone, as_="emission" or "radiance factor", or leave scale= out'
    """

    def argument(found: re.Match[str]) -> str:
        option, values = found.groups()
        written = _VALUE.sub(lambda value: f'"{value[0].replace("-", " ")}"', values).removeprefix(" ")
        return f"{'as_' if option == 'as' else option}={written}"

    return _IMPORT.sub("read ", _OPTION.sub(argument, text))
