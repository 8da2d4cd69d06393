"""What was measured: every sign that a file gives, and the one decision that is made from them.

1. What the file states in words, a unit or its format is taken.
2. What nothing states is what the person says who imports it (`Answer`).
3. Without either, it takes signs of two origins or more that agree, and none that speaks against them. Origins are the
   name of the file, the names of its spectra, its words beside the measurement, colours beside that are those of the
   spectra, the illuminant of these, what the numbers resemble, whether they stand on the scale of that publication,
   lines of a lamp, and values that only a light has.
4. Else the file is refused, with the words that settle it. Nothing is guessed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
from jaxtyping import Float

from ...errors import InputError
from ...spectrum import Quantity
from ..answer import Answer, contradiction
from .resemblance import Likeness, has_mercury_lines, likenesses
from .scale import Divisor
from .text import shortened
from .words import meant_by

# Percent of a fluorescent white stay below it, and so does every transmittance.
_ABOVE_PERCENT = 200.0
#: What to say at an import, or to write into a file, where it does not say what was measured.
SETTLED_BY = "say it: --as reflectance, transmittance, emission or radiance-factor"


class Sign(NamedTuple):
    """One sign of what was measured.

    Parameters
    ----------
    origin : where it comes from; two signs of one origin count once.
    says : a quantity, or "sensitivity".
    words : what it is, for a person: 'the heading "Reflectance (%)"'.
    states : True where no other sign is needed.
    """

    origin: str
    says: str
    words: str
    states: bool = False


class Decision(NamedTuple):
    """What was measured, the signs that say so in words, and whether the file states it (rather than a person, or
    several hints).
    """

    quantity: Quantity
    words: str
    stated: bool


def decided(
    signs: Sequence[Sign], numbers: Sequence[Sign], answer: Answer, field: str | None = None, data: str | None = None
) -> Decision | None:
    """The decision by the rules at the head of this module, None where the file is to be refused (`undecided`).

    Parameters
    ----------
    numbers : signs in the spectrum's own numbers, which may belie a decision.
    field : what is decided; `data` : where its numbers stand, where that is another place.

    Raises
    ------
    InputError
        The file states one thing, and the answer is another, or the numbers are.
    """
    decision = _by_rules(signs, answer, field)
    if decision is not None and _speaks_against(decision, numbers):
        hint = "correct the heading, or say what it is at the import of this file alone"
        if decision.words == "--as":
            hint = f"leave --as and --scale out, or say what the numbers do: --as {numbers[0].says.replace(' ', '-')}"
        raise InputError(
            "the words say one thing, and the numbers another",
            field=data or field,
            found=f"{decision.quantity}, by {decision.words}; but {' and '.join(sign.words for sign in numbers)}",
            expected="words and numbers of one thing",
            hint=hint,
        )
    return decision


def _by_rules(signs: Sequence[Sign], answer: Answer, field: str | None) -> Decision | None:
    stated = [sign for sign in signs if sign.states]
    if len({sign.says for sign in stated}) == 1:
        quantity, words = _quantity(stated[0].says), _listed(stated)
        if quantity is not None and not answer.allows(quantity):
            raise contradiction(answer, quantity, words, field=field)
        return quantity and Decision(answer.quantity or quantity, words, True)
    if answer.quantity is not None:
        return Decision(answer.quantity, "--as", False)
    says, origins = {sign.says for sign in signs}, {sign.origin for sign in signs}
    quantity = _quantity(next(iter(says))) if len(says) == 1 else None
    return Decision(quantity, _listed(signs), False) if quantity and not stated and len(origins) > 1 else None


def _quantity(says: str) -> Quantity | None:
    return {name: name for name in get_args(Quantity)}.get(says)


def _listed(signs: Iterable[Sign]) -> str:
    return " and ".join(dict.fromkeys(sign.words for sign in signs))


def taken_as(decision: Decision, scale: Divisor | None) -> str:
    """What a spectrum was taken for, and by which signs, for a plan and a record."""
    if scale is None:
        return f"{decision.quantity}, by {decision.words}"
    by = decision.words if scale.words in ("", decision.words) else f"{decision.words}; {scale.scale} by {scale.words}"
    return f"{decision.quantity} in {scale.scale}s, by {by}".replace("in percents", "in percent")


def undecided(signs: Iterable[Sign], field: str | None, count: int = 1) -> InputError:
    """The refusal of spectra that nothing tells: what was looked for, what was found, and what settles it."""
    hints: dict[str, list[str]] = {}
    for sign in signs:
        hints.setdefault(sign.says, []).append(sign.words)
    found = "; ".join(f"{says}, hints {' and '.join(dict.fromkeys(words))}" for says, words in hints.items())
    many = f"of {count} spectra, " if count > 1 else ""
    return InputError(
        "what was measured?",
        field=field,
        found=f"{many}{shortened(found, 400) if found else 'no word and no unit that says it'}",
        expected='a heading such as "reflectance (%)" or "irradiance (W/m2/nm)", or two hints that agree',
        hint=f"{SETTLED_BY}; and --scale percent or fraction where it is no emission",
    )


def signs_of_name(origin: str, name: str, what: str) -> list[Sign]:
    """The signs in a name; `what`: what it is the name of, such as "the file name"."""
    return [Sign(origin, meaning, f"{what} {shortened(name, 40)!r}") for meaning in sorted(meant_by(name))]


def signs_beside(words: str, what: str, path: Path) -> list[Sign]:
    """The signs in words of the file that are not the measurement's own, such as a title; programs write the name of
    the file there, which is no further sign.
    """
    own = re.sub(re.escape(path.stem), " ", words[:4000], flags=re.I)
    return [Sign("words beside", meaning, f"{what} {shortened(words, 40)!r}") for meaning in sorted(meant_by(own))]


def signs_of_numbers(
    grid_nm: Float[np.ndarray, "L"], values: Float[np.ndarray, "L"], likeness: Likeness | None
) -> list[Sign]:
    """The signs in a spectrum's own numbers."""
    found: list[Sign] = []
    if likeness is not None:
        found.append(Sign("resemblance", likeness.kind, f"the numbers of {likeness.name}"))
        if likeness.published:
            found.append(Sign("published scale", likeness.kind, "their published scale"))
    there = np.isfinite(values)
    grid_nm, values = grid_nm[there], values[there]
    if not values.size:
        return found
    if has_mercury_lines(grid_nm, values):
        found.append(Sign("lines", "emission", "lines of mercury at 436 and 546 nm"))
    if values.max() > _ABOVE_PERCENT:
        found.append(Sign("range", "emission", f"values up to {values.max():.4g}, above any percentage"))
    return found


def signs_of_all(grid: np.ndarray, spectra: np.ndarray, field: str) -> list[Sign]:
    """The signs that every one of several spectra (N,L) has, where all of them are of one quantity.

    Raises
    ------
    InputError
        One of them is an observer's or a camera's own function.
    """
    alike = likenesses(grid, spectra)
    refuse_sensitivity(alike, field)
    of_each = [signs_of_numbers(grid, row, likeness) for row, likeness in zip(spectra, alike, strict=True)]
    first, *others = of_each or [[]]
    return [one for one in first if all((one.origin, one.says) in {sign[:2] for sign in signs} for signs in others)]


def _speaks_against(decision: Decision, numbers: Sequence[Sign]) -> bool:
    """Whether a spectrum's own numbers, by two signs, are those of a light or a chart that the decision says it is not.

    What a file states as light may be what a chart sent back.
    """
    says = {sign.says for sign in numbers}
    resembles = any(sign.origin == "resemblance" for sign in numbers)
    if len(says) != 1 or len(numbers) < 2 or not resembles or decision.quantity in says:
        return False
    if says == {"reflectance"}:
        return not decision.stated and decision.quantity != "radiance factor"
    return says == {"emission"}


def refuse_sensitivity(alike: Iterable[Likeness | None], field: str) -> None:
    """Refuse numbers that are those of an observer or a camera, whatever anybody calls them."""
    for likeness in alike:
        if likeness is not None and likeness.kind == "sensitivity":
            raise InputError(
                "a sensitivity is not the spectrum of a colour",
                field=field,
                found=f"the numbers of {likeness.name}",
                expected="reflectance, transmittance or emission",
                hint="colour-matching functions, cone fundamentals and responses of sensors are not imported",
            )
