"""Spectra in MATLAB files: a vector of wavelengths, and arrays that are as long one way or the other.

Wavelengths are called `wavelength`, `wave`, `wl`, `lambda` or alike, or stand as [first, step, count] in an `S_...`
beside a `sur_...` or `spd_...`, as the Psychophysics Toolbox has them. What was measured is told by the names of the
variables, their comments, and the name of the file, in this order.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..spectrum import Quantity
from .mat_variables import Variable, is_hdf5, read_variables
from .reading import SpectralFile
from .shared.gathering import MOST_SPECTRA, Gathering, reflective_divisor
from .shared.text import shortened
from .shared.words import measured, names_light, quantity_in, unit_in

NAME = "MATLAB"
SUFFIXES = (".mat",)

_AXIS = re.compile(r"(?:.*[._])?(?:wave(?:length|len)?s?|wl|wls|wvl|lambdas?|lam|nm)(?:_?nm)?", re.I)
_STEPS = re.compile(r"S_(\w+)")
_KIND = {"sur": "reflectance", "srf": "reflectance", "spd": "emission", "refl": "reflectance", "spec": None}
_NAMES = re.compile(r"(?:.*[._])?(?:names?|labels?|samples?|ids?|titles?|chips?|patch(?:es)?)", re.I)
_NOT_SPECTRA = re.compile(r"(?:T|B|basis|coeffs?|xyz|lab|rgb|srgb|mean|std|sigma)(?:_\w+)?", re.I)


def recognises(path: Path, head: bytes) -> bool:
    """The header of version 5 or 7.3, or, for version 4, which has none, the suffix and a plausible first matrix."""
    if head[:10] in (b"MATLAB 5.0", b"MATLAB 7.3"):
        return True
    if path.suffix.casefold() != ".mat" or len(head) < 20:
        return False
    kind, rows, columns, imaginary, name_length = np.frombuffer(head[:20], dtype="<i4").tolist()
    first_matrix = 0 <= kind < 5000 and 0 <= imaginary <= 1 and 0 < name_length < 256 and min(rows, columns) >= 0
    return is_hdf5(head) or first_matrix


def read(path: Path) -> SpectralFile:
    """Read every array that is as long as the wavelengths.

    Raises
    ------
    InputError
        Damaged files, no wavelengths, no array to go with them, or images; the message names the variables.
    """
    variables = read_variables(path)
    gathering = Gathering(path, NAME)
    numbers = {name: value for name, value in variables.items() if isinstance(value, np.ndarray)}
    words = {name: value for name, value in variables.items() if isinstance(value, list) and not _NAMES.fullmatch(name)}
    said = " ".join(" ".join(value) for value in words.values())[:8000]
    axis_name, grid = _axis(numbers, variables, path, gathering)
    arrays = {
        name: value
        for name, value in numbers.items()
        if name != axis_name and value.ndim == 2 and grid.size in value.shape and not _NOT_SPECTRA.fullmatch(name)
    }
    if not arrays:
        raise InputError(
            "no spectra beside the wavelengths",
            file=path,
            field=axis_name,
            found=_listed(variables),
            expected=f"an array with {grid.size} rows or columns",
            hint="save the spectra as a matrix of two dimensions; a spectral image is not a set of samples",
        )
    details = {name: shortened("; ".join(value), 400) for name, value in words.items()}
    for name, values in arrays.items():
        _gather(name, values, grid, said, variables, len(arrays) > 1, gathering, path)
    return gathering.finish(details)


def _axis(
    numbers: dict[str, np.ndarray], variables: dict[str, Variable], path: Path, gathering: Gathering
) -> tuple[str, np.ndarray]:
    """Name and values (L,) of the wavelengths."""
    for name, value in numbers.items():
        if value.size > 1 and value.size == max(value.shape) and _AXIS.fullmatch(name):
            return name, value.ravel()
    for name, value in numbers.items():
        if _STEPS.fullmatch(name) and value.size == 3:
            first, step, count = (float(number) for number in value.ravel())
            if step > 0 and 2 <= count <= 100_000 and count == int(count):
                return name, first + step * np.arange(int(count))
    for name, value in numbers.items():
        flat = value.ravel()
        if flat.size > 3 and flat.size == max(value.shape) and 150 <= flat[0] <= 2600 and (np.diff(flat) > 0).all():
            gathering.note(
                f"no variable is called wavelength; {name} ascends from {flat[0]:g} to {flat[-1]:g} and is taken"
            )
            return name, flat
    raise InputError(
        "no wavelengths in this MATLAB file",
        file=path,
        found=_listed(variables),
        expected="a vector called wavelength, wave, wl or lambda, in nm",
        hint="save the wavelengths beside the spectra",
    )


def _listed(variables: dict[str, Variable]) -> str:
    shown = [
        f"{name} ({' x '.join(map(str, value.shape))})" if isinstance(value, np.ndarray) else f"{name} (words)"
        for name, value in list(variables.items())[:12]
    ]
    return ", ".join(shown) or "no variables"


def _gather(
    name: str,
    values: np.ndarray,
    grid: np.ndarray,
    said: str,
    variables: dict[str, Variable],
    several: bool,
    gathering: Gathering,
    path: Path,
) -> None:
    if values.shape[0] == values.shape[1] == grid.size:
        gathering.note(f"{name} is square: its columns are taken as the spectra")
    spectra = values.T if values.shape[0] == grid.size else values
    if len(spectra) > MOST_SPECTRA:
        raise InputError(
            "too many spectra in one file",
            file=path,
            field=name,
            found=f"{len(spectra)}",
            expected=f"at most {MOST_SPECTRA}",
        )
    quantity, told = _quantity(name, said, path, gathering)
    divisor = 1.0
    finite = spectra[np.isfinite(spectra)]
    if quantity != "emission" and finite.size:
        unit = unit_in(name) or unit_in(said)
        divisor, note = reflective_divisor(float(finite.min()), float(finite.max()), unit, path, told=told)
        if note:
            gathering.note(note)
    labels = next(
        (value for key, value in variables.items() if isinstance(value, list) and len(value) == len(spectra) > 1), None
    )
    stem = f"{path.stem} {name}" if several else path.stem
    for index, row in enumerate(spectra):
        label = labels[index] if labels and labels[index] else f"{stem} {index + 1}" if len(spectra) > 1 else stem
        gathering.add(label, grid, row, quantity, divisor=divisor, details={"variable": name, "column": str(index + 1)})


def _quantity(name: str, said: str, path: Path, gathering: Gathering) -> tuple[Quantity, bool]:
    """What a variable holds, and whether anything says so."""
    last = name.rpartition(".")[2]
    told = _KIND.get(last.partition("_")[0].casefold()) or quantity_in(last.replace("_", " ")) or quantity_in(said)
    if told in ("absorbance", "index"):
        raise InputError(
            f"{told} is not the spectrum of a colour",
            file=path,
            field=name,
            expected="reflectance, transmittance or emission",
        )
    if quantity := measured(told):
        return quantity, True
    if names_light(path.stem) or names_light(said) or names_light(last):
        gathering.note(f"{name} is taken as emission, after its name or comment")
        return "emission", True
    gathering.note("the file does not say what was measured; taken as reflectance")
    return "reflectance", False
