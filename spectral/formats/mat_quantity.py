"""What a variable of a MATLAB file measures, and on which scale: by its name, the comment, and `shared.signs`."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..errors import InputError
from .answer import Answer
from .shared.gathering import in_visible
from .shared.scale import Divisor, Values, divisor_of
from .shared.signs import Decision, Sign, decided, signs_beside, signs_of_all, signs_of_name, undecided
from .shared.text import shortened
from .shared.words import measured, quantity_in, quantity_in_lines, unit_in

_KIND = {"sur": "reflectance", "srf": "reflectance", "spd": "emission", "refl": "reflectance", "spec": None}
# At the top of a file of the Psychophysics Toolbox: sensitivities and bases.
_TOOLBOX = re.compile(r"[TB](?:_\w+)?", re.I)
_TOOLBOX_MEANS = {"T": "sensitivities (T_...)", "B": "basis functions (B_...)"}
_RESPONSES = (
    ("colour-matching functions", r"xyz(?:\d\w*)?|cmfs?|colou?r[ -]?match\w*"),
    (
        "sensitivities of the eye",
        r"cones?|lms|fundamentals|stockman|smith[ -]?pokorny|v ?lambda|luminosity|photopic|scotopic",
    ),
    ("optical densities", r"den|densit(?:y|ies)|macular"),
    ("sensitivities of a camera", r"sensitivit(?:y|ies)|responsivit(?:y|ies)|quantum efficiency|qe"),
)
_ILLUM = re.compile(r"(?<![a-z])illum(?:s|inants?)?(?![a-z])", re.I)


def response(name: str) -> str | None:
    """What is no spectrum of a colour by the name of a variable, such as "sensitivities"; None where it may be one."""
    return _response(name) or (_TOOLBOX_MEANS[name[0].upper()] if _TOOLBOX.fullmatch(name) else None)


def _response(words: str) -> str | None:
    """What is no spectrum of a colour by these words, such as "colour-matching functions"; None where it may be one."""
    words = words.rpartition(".")[2].replace("_", " ")
    if _KIND.get(words.partition(" ")[0].casefold()) or measured(quantity_in(words)):
        return None
    return next(
        (what for what, pattern in _RESPONSES if re.search(rf"(?<![a-z])(?:{pattern})(?![a-z])", words, re.I)), None
    )


def no_colour(what: str, field: str) -> InputError:
    """The refusal of a variable that is called what is no colour."""
    return InputError(
        "not the spectrum of a colour",
        field=field,
        found=f"{what}, by its name or comment",
        expected="reflectance, transmittance or emission",
        hint="where it is one, call the variable reflectance, transmittance or spd",
    )


def decision_of(name: str, said: str, grid: np.ndarray, spectra: np.ndarray, answer: Answer, path: Path) -> Decision:
    """What a variable holds: by its own name, the comment, the person, or signs that agree.

    Raises
    ------
    InputError
        It is no spectrum of a colour, or nothing tells.
    """
    numbers = signs_of_all(grid, spectra, name)
    variable, comment = f"the variable {shortened(name, 40)!r}", f"the comment {shortened(said, 60)!r}"
    by_name, by_comment = _told(name), quantity_in_lines(said)[0]
    told = by_name or by_comment
    if told in ("absorbance", "index"):
        raise InputError(
            f"{told} is not the spectrum of a colour", field=name, expected="reflectance, transmittance or emission"
        )
    if quantity := measured(told):
        signs = [Sign("words", quantity, variable if by_name else comment, True)]
    else:
        for words in (said, path.stem):
            if what := _response(words):
                raise no_colour(what, name)
        signs = signs_of_name("file name", path.stem, "the file name") + signs_of_name("names", name, "the variable")
        if _ILLUM.search(name.replace(".", " ").replace("_", " ")):
            signs = [Sign("words", "emission", variable, True)]
        signs += signs_beside(said, "the comment", path)
        signs += numbers
    decision = decided(signs, numbers, answer, name)
    if decision is None:
        raise undecided(signs, name, len(spectra))
    return decision


def scale_of(
    name: str, said: str, grid: np.ndarray, spectra: np.ndarray, decision: Decision, answer: Answer
) -> Divisor | None:
    """What the values of a variable are divided by; None for an emission, and where there are no values."""
    visible = spectra[:, in_visible(grid)] if in_visible(grid).any() else spectra
    finite = visible[np.isfinite(visible)]
    if decision.quantity == "emission" or not finite.size:
        return None
    unit = unit_in(name) or unit_in(said)
    words = f"the variable {name!r}" if unit_in(name) else f"the comment {shortened(said, 60)!r}"
    values = Values.of(finite, decision.quantity, decision.stated)
    return divisor_of(values, unit, words if unit else "", answer.scale)


def _told(name: str) -> str | None:
    """What the name of a variable says, its own before that of the struct that it is in."""
    for part in reversed(name.split(".")):
        if told := _KIND.get(part.partition("_")[0].casefold()) or quantity_in(part.replace("_", " ")):
            return told
    return None
