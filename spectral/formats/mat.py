"""Spectra in MATLAB files: a vector of wavelengths, and arrays that are as long one way or the other.

Wavelengths are called `wavelength`, `wave`, `wl`, `lambda` or alike, or stand as [first, step, count] in an `S_...`
beside a `sur_...` or `spd_...`, as the Psychophysics Toolbox has them; in a struct, they are of its own fields. What
was measured is told by the names of the variables, their comments, and the name of the file, in this order; what is no
spectrum of a colour (colour-matching functions, sensitivities, densities) is refused by these names.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from .import_options import NO_ANSWER, ImportOptions
from .mat_variables import Variable, is_hdf5, read_variables
from .registry import SpectralFile, names_its_file
from .shared.decisions import (
    Decision,
    Divisor,
    Sign,
    ValueRange,
    decided,
    divisor_of,
    signs_beside,
    signs_of_all,
    signs_of_name,
    undecided,
)
from .shared.entry_rules import MOST_SPECTRA, Gathering, in_visible
from .shared.text import shortened
from .shared.words import measured, names_scatter, quantity_in, quantity_in_lines, statistics_among, unit_in

NAME = "MATLAB"
ASKS = True
SUFFIXES = (".mat",)

_AXIS = re.compile(r"(?:.*[._])?(?:wave(?:length|len)?s?|wl|wls|wvl|lambdas?|lam|nm)(?:_?nm)?(?:_?\d)?", re.I)
_STEPS = re.compile(r"S_(\w+)")
_NAMES = re.compile(r"(?:.*[._])?(?:names?|labels?|samples?|ids?|titles?|chips?|patch(?:es)?)", re.I)
_NOT_SPECTRA = re.compile(r"(?:\w*basis|\w*coeff?s?|xyz|lab|rgb|srgb|mean|std|sigma)(?:_\w+)?", re.I)
_KIND = {"sur": "reflectance", "srf": "reflectance", "spd": "emission", "refl": "reflectance", "spec": None}
# At the top of a file of the Psychophysics Toolbox: sensitivities and bases.
_TOOLBOX = {"T": "sensitivities (T_...)", "B": "basis functions (B_...)"}
_BASIS = re.compile(
    r"basis[ _-]*(?:functions?|vectors?|spectra|set)|eigen ?(?:vectors?|functions?)|principal components?|"
    r"characteristic (?:vectors?|functions?)",
    re.I,
)
_CALLED_BASIS = re.compile(r"(?<![a-z])bas[ei]s(?![a-z])", re.I)
_RESPONSES = (
    ("colour-matching functions", r"xyz(?:\d\w*)?|cmfs?|colou?r[ -]?match\w*"),
    (
        "sensitivities of the eye",
        r"cones?|lms|fundamentals|stockman|smith[ -]?pokorny|v ?lambda|luminosity|photopic|scotopic",
    ),
    ("optical densities", r"den|densit(?:y|ies)|macular"),
    ("sensitivities of a camera", r"sensitivit(?:y|ies)|responsivit(?:y|ies)|quantum efficiency|qe"),
)
_HEADERS = (b"MATLAB 5.0", b"MATLAB 7.3")
_ILLUM = re.compile(r"(?<![a-z])illum(?:s|inants?)?(?![a-z])", re.I)


def recognises(path: Path, head: bytes) -> bool:
    """Return the header of version 5 or 7.3, or, for version 4, which has none, the suffix and a plausible first
    matrix.
    """
    if head[:10] in _HEADERS:
        return True
    if path.suffix.casefold() != ".mat" or len(head) < 20:
        return False
    return is_hdf5(head) or any(_is_first_matrix(head, order) for order in "<>")


def _is_first_matrix(head: bytes, order: str) -> bool:
    """Return whether a file of version 4 begins with a matrix, in this order of bytes; its type says the order, too."""
    kind, rows, columns, imaginary, name_length = np.frombuffer(head[:20], dtype=f"{order}i4").tolist()
    if not (0 <= imaginary <= 1 and 0 < name_length < 256 and min(rows, columns) >= 0):
        return False
    return kind // 1000 == 1 if order == ">" else 0 <= kind < 5000


def _refuse_foreign_floats(path: Path) -> None:
    """Refuse floats of a VAX or a Cray, which a file of version 4 may have, and which would be other numbers here."""
    with path.open("rb") as file:
        head = file.read(20)
    kind = int.from_bytes(head[:4], "little")
    if head[:10] not in _HEADERS and not is_hdf5(head) and 2000 <= kind < 5000:
        raise InputError(
            "floats of a machine that is not read",
            found=f"{('VAX D-float', 'VAX G-float', 'Cray')[kind // 1000 - 2]}, by the type {kind}",
            expected="IEEE floats",
            hint="save it again from MATLAB or GNU Octave of today",
        )


@names_its_file
def read(path: Path, answer: ImportOptions = NO_ANSWER) -> SpectralFile:
    """Read every array that is as long as the wavelengths.

    Raises
    ------
    InputError
        Damaged files, no wavelengths, no array to go with them, or images; the message names the variables.
    """
    _refuse_foreign_floats(path)
    variables = read_variables(path)
    gathering = Gathering(path, NAME)
    numbers = {name: value for name, value in variables.items() if isinstance(value, np.ndarray)}
    words = {name: value for name, value in variables.items() if isinstance(value, list) and not _NAMES.fullmatch(name)}
    said = "\n".join("\n".join(value) for value in words.values())[:8000]
    axes = _axes(numbers, variables, gathering)
    arrays = {name: axis for name, value in numbers.items() if (axis := _axis_of(name, value, axes)) is not None}
    responses = {name: what for name in arrays if (what := _response(name) or _of_toolbox(name, arrays))}
    left = {name: axis for name, axis in arrays.items() if name not in responses and not _is_no_spectrum(name)}
    if not left:
        if responses:
            raise _no_colour(*next((what, name) for name, what in responses.items()))
        sizes = " or ".join(str(size) for size in sorted({grid.size for grid in axes.values()}))
        raise InputError(
            "no spectra beside the wavelengths",
            field=next(iter(axes)),
            found=_listed(variables),
            expected=f"an array with {sizes} rows or columns",
            hint="save the spectra as a matrix of two dimensions; a spectral image is not a set of samples",
        )
    names = [name.rpartition(".")[2] for name in left]
    scatter = [names_scatter(name, means=True) for name in names]
    of_others = set(statistics_among(names, [[]] * len(names))) | {at for at, is_one in enumerate(scatter) if is_one}
    if len(of_others) < len(names):
        left = {name: axis for at, (name, axis) in enumerate(left.items()) if at not in of_others}
    for name in [each for each in arrays if each not in left]:
        gathering.note(f"{name} is left out: {responses.get(name, 'no spectrum, by its name')}")
    details = {name: shortened("; ".join(value), 400) for name, value in words.items()}
    for name, axis in left.items():
        stem = f"{path.stem} {name}" if len(left) > 1 else path.stem
        _gather(name, numbers[name], axes[axis], said, variables, stem, gathering, answer)
    return gathering.finish(details)


def _axis_of(name: str, value: np.ndarray, axes: dict[str, np.ndarray]) -> str | None:
    """Find the wavelengths that an array goes with: those of its own struct, else the only ones of its size."""
    vector = value.ndim == 2 and min(value.shape) == 1
    if name in axes or value.ndim != 2 or _AXIS.fullmatch(name):
        return None
    if vector and any(np.array_equal(value.ravel(), grid) for grid in axes.values()):
        return None
    fitting = [axis for axis, grid in axes.items() if grid.size in value.shape]
    own = [axis for axis in fitting if axis.rpartition(".")[0] == name.rpartition(".")[0]]
    own = [axis for axis in fitting if _STEPS.fullmatch(axis) and name.endswith(axis[1:])] or own
    chosen = own or fitting
    if any(not np.array_equal(axes[chosen[0]], axes[axis]) for axis in chosen[1:]):
        raise InputError(
            "two vectors of wavelengths",
            field=name,
            found=" and ".join(chosen[:4]),
            expected="one vector of wavelengths beside the spectra, or one in each struct",
            hint="save the spectra of each in a file of their own",
        )
    return chosen[0] if chosen else None


def _is_no_spectrum(name: str) -> bool:
    return bool(_NOT_SPECTRA.fullmatch(name.rpartition(".")[2]))


def _axes(
    numbers: dict[str, np.ndarray], variables: dict[str, Variable], gathering: Gathering
) -> dict[str, np.ndarray]:
    """Return every vector of wavelengths (L,), by name."""
    found = {
        name: value.ravel()
        for name, value in numbers.items()
        if value.size > 1 and value.size == max(value.shape) and _AXIS.fullmatch(name)
    }
    if found:
        return found
    for name, value in numbers.items():
        if _STEPS.fullmatch(name) and value.size == 3:
            first, step, count = (float(number) for number in value.ravel())
            if step > 0 and 2 <= count <= 100_000 and count == int(count):
                found[name] = first + step * np.arange(int(count))
    if found:
        return found
    for name, value in numbers.items():
        flat = value.ravel()
        if flat.size > 3 and flat.size == max(value.shape) and 150 <= flat[0] <= 2600 and (np.diff(flat) > 0).all():
            gathering.note(
                f"no variable is called wavelength; {name} ascends from {flat[0]:g} to {flat[-1]:g} and is taken"
            )
            return {name: flat}
    raise InputError(
        "no wavelengths in this MATLAB file",
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
    stem: str,
    gathering: Gathering,
    answer: ImportOptions,
) -> None:
    if values.shape[0] == values.shape[1] == grid.size:
        gathering.note(f"{name} is square: its columns are taken as the spectra")
    spectra = values.T if values.shape[0] == grid.size else values
    if len(spectra) > MOST_SPECTRA:
        raise InputError(
            "too many spectra in one file", field=name, found=f"{len(spectra)}", expected=f"at most {MOST_SPECTRA}"
        )
    try:
        decision = _decision(name, said, grid, spectra, answer, gathering.path)
        scale = _scale(name, said, grid, spectra, decision, answer)
    except InputError as reason:
        gathering.rejected.append((stem, reason))
        return
    labels = _labels(name, len(spectra), variables)
    for number, row in enumerate(spectra, 1):
        label = labels[number - 1] or (f"{stem} {number}" if len(spectra) > 1 else stem)
        gathering.take(label, grid, row, decision, scale, details={"variable": name, "column": str(number)})


def _labels(name: str, count: int, variables: dict[str, Variable]) -> list[str]:
    """Return as many words as there are spectra, of one those beside it in its struct; "" where there are none."""
    struct = name.rpartition(".")[0]
    for key, value in variables.items():
        beside = struct and key.rpartition(".")[0] == struct and _NAMES.fullmatch(key)
        if isinstance(value, list) and len(value) == count and (count > 1 or beside):
            return value
    return [""] * count


def _response(words: str) -> str | None:
    """Name what is no spectrum of a colour by these words, as "colour-matching functions"; None where it may be one."""
    words = words.rpartition(".")[2].replace("_", " ")
    if _KIND.get(words.partition(" ")[0].casefold()) or measured(quantity_in(words)):
        return None
    return next(
        (what for what, pattern in _RESPONSES if re.search(rf"(?<![a-z])(?:{pattern})(?![a-z])", words, re.I)), None
    )


def _of_toolbox(name: str, names: Collection[str]) -> str | None:
    """Name what a variable of the Psychophysics Toolbox holds that is no spectrum of a colour; None of any other, as of
    a transmittance T beside a reflectance R of the `names`.
    """
    if name == "T" and "R" in names:
        return None
    return _TOOLBOX[name[0].upper()] if re.fullmatch(r"[TB](?:_\w+)?", name, re.I) else None


def _no_colour(what: str, field: str) -> InputError:
    """Return the refusal of a variable that is called what is no colour."""
    return InputError(
        "not the spectrum of a colour",
        field=field,
        found=f"{what}, by its name or comment",
        expected="reflectance, transmittance or emission",
        hint="where it is one, call the variable reflectance, transmittance or spd",
    )


def _decision(
    name: str, said: str, grid: np.ndarray, spectra: np.ndarray, answer: ImportOptions, path: Path
) -> Decision:
    """Decide what a variable holds: by its own name, the comment, the person, or signs that agree.

    Raises
    ------
    InputError
        It is no spectrum of a colour, or nothing tells.
    """
    numbers = signs_of_all(grid, spectra, name)
    variable, comment = f"the variable {shortened(name, 40)!r}", f"the comment {shortened(said, 60)!r}"
    by_name, by_comment = _named(name), quantity_in_lines(said)[0]
    named = by_name or by_comment
    if named in ("absorbance", "index"):
        raise InputError(
            f"{named} is not the spectrum of a colour", field=name, expected="reflectance, transmittance or emission"
        )
    called = re.sub("(?<=[a-z])(?=[A-Z])", " ", path.stem).replace("_", " ")
    if not by_name and (_BASIS.search(said) or _CALLED_BASIS.search(called)):
        raise _no_colour("basis functions", name)
    if quantity := measured(named):
        signs = [Sign("words", quantity, variable if by_name else comment, True)]
    else:
        if what := _response(said) or _response(path.stem):
            raise _no_colour(what, name)
        signs = signs_of_name("file name", path.stem, "the file name") + signs_of_name("names", name, "the variable")
        if _ILLUM.search(name.replace(".", " ").replace("_", " ")):
            signs = [Sign("words", "emission", variable, True)]
        signs += signs_beside(said, "the comment", path) + numbers
    decision = decided(signs, numbers, answer, name)
    if decision is None:
        raise undecided(signs, name, len(spectra))
    return decision


def _scale(
    name: str, said: str, grid: np.ndarray, spectra: np.ndarray, decision: Decision, answer: ImportOptions
) -> Divisor | None:
    """Find the divisor of the values of a variable; None for an emission, and where there are no values."""
    visible = spectra[:, in_visible(grid)] if in_visible(grid).any() else spectra
    finite = visible[np.isfinite(visible)]
    if decision.quantity == "emission" or not finite.size:
        return None
    unit = unit_in(name) or unit_in(said)
    words = f"the variable {name!r}" if unit_in(name) else f"the comment {shortened(said, 60)!r}"
    values = ValueRange.of(finite, decision.quantity, decision.stated)
    return divisor_of(values, unit, words if unit else "", answer)


def _named(name: str) -> str | None:
    """Return the quantity that the name of a variable says, its own before that of the struct that it is in."""
    for part in reversed(name.split(".")):
        if named := _KIND.get(part.partition("_")[0].casefold()) or quantity_in(part.replace("_", " ")):
            return named
    return None
