"""Quantity and scale of measured values: every sign that a file gives, and the decision that is made from them.

What was measured:

1. What the file states in words, a unit or its format is taken.
2. What nothing states is what the person says who imports it (`ImportOptions`).
3. Without either, it takes signs of two origins or more that agree, and none that speaks against them. Origins are the
   name of the file, the names of its spectra, its words beside the measurement, colours beside that are those of the
   spectra, the illuminant of these, what the numbers resemble, whether they stand on the scale of that publication,
   lines of a lamp, and values that only a light has.
4. Else the file is refused, with the words that settle it. Nothing is guessed.

Percent or fractions: a stated scale is followed, unless the numbers cannot be on it or no surface would be as dark or
as bright; then the person's answer counts for more. Where none is stated, the answer is followed, within the same
bounds. Where there is neither, a heading that says "reflectance" means fractions unless the values can only be percent;
numbers that nothing calls anything must not fit both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from ...spectrum import Quantity
from ..import_options import AgainstAnswerError, ImportOptions, Scale, contradiction
from .resemblance import Likeness, has_mercury_lines, is_above_noise, likenesses
from .text import shortened
from .words import meant_by

# Percent of a fluorescent white stay below it, and so does every transmittance.
_ABOVE_PERCENT = 200.0
#: Hint for a file that does not say what was measured.
SETTLED_BY = "say it: --as reflectance, transmittance, emission or radiance-factor"
#: Hint for a file of raw counts.
NO_COUNTS = "export what the instrument makes of them: irradiance, or reflectance against a white reference"
#: Hint for a file of colours without spectra.
COLOURS_ALONE = (
    "export the measurement with its spectra: a colour alone does not tell how it looks in another light; "
    "metamer match compares colours as they are"
)
#: Why a scatter is refused, and what to do.
NO_SCATTER = (
    "the scatter of readings, their limits or their uncertainty is no measurement of a colour",
    "export the readings themselves, or their mean",
)
# A surface as dark at all wavelengths, as a fraction, is a trap for light, or a radiance: black paints send back more.
_BLACKEST = 0.01
# A black in percent may read less, and a white more: that one table has both below one per cent does not happen.
_DARK_PERCENT, _BRIGHT = 0.02, 0.3
# Percent above this is a light, a surface that glitters, or a unit that nobody stated.
_MOST_PERCENT = 200.0
# Whole numbers above this are codes of a picture or counts as soon as percent: few surfaces send back more.
_MOST_WHOLE_PERCENT = 105.0
# A surface that glows sends back more than it receives in some of the visible, and less in all of it.
_BRIGHTEST_MEAN = 1.2
# Largest radiance factor, and largest reflectance: fluorescent paints send back less than three times their light.
_MOST_FACTOR, _MOST_REFLECTANCE = 10.0, 3.0
#: Beginning of notes on what the answer settled.
BY_ANSWER = "the import says"
_SETTLED_BY_SCALE = "say it: --scale percent or --scale fraction"


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
    """Quantity that was measured, the signs of it in words, and whether the file states it (rather than a person, or
    several hints).
    """

    quantity: Quantity
    words: str
    stated: bool


def decided(
    signs: Sequence[Sign],
    numbers: Sequence[Sign],
    answer: ImportOptions,
    field: str | None = None,
    data: str | None = None,
) -> Decision | None:
    """Return the decision by the rules at the head of this module, None where the file is to be refused (`undecided`).

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
        if decision.words.startswith("--as"):
            hint = f"leave --as and --scale out, or say what the numbers do: --as {numbers[0].says.replace(' ', '-')}"
        raise InputError(
            "the words say one thing, and the numbers another",
            field=data or field,
            found=f"{decision.quantity}, by {decision.words}; but {' and '.join(sign.words for sign in numbers)}",
            expected="words and numbers of one thing",
            hint=hint,
        )
    return decision


def _by_rules(signs: Sequence[Sign], answer: ImportOptions, field: str | None) -> Decision | None:
    stated = [sign for sign in signs if sign.states]
    if len({sign.says for sign in stated}) == 1:
        quantity, words = _quantity(stated[0].says), _listed(stated)
        if quantity is not None and not answer.allows(quantity):
            if answer.against == "refused":
                raise contradiction(answer, quantity, words, field=field)
            if answer.against == "overruled" and answer.quantity is not None:
                return Decision(answer.quantity, f"--as, against {words}", False)
            return Decision(quantity, words, True)
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


def taken_words(decision: Decision, scale: Divisor | None) -> str:
    """Describe the quantity that a spectrum was taken for, and the signs of it, for a plan and a record."""
    if scale is None:
        return f"{decision.quantity}, by {decision.words}"
    by = decision.words if scale.words in ("", decision.words) else f"{decision.words}; {scale.scale} by {scale.words}"
    return f"{decision.quantity} in {scale.scale}s, by {by}".replace("in percents", "in percent")


def undecided(signs: Iterable[Sign], field: str | None, count: int = 1) -> InputError:
    """Return the refusal of spectra that nothing tells: what was looked for, what was found, and what settles it."""
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
    """Return the signs in a name; `what`: what it is the name of, such as "the file name"."""
    return [Sign(origin, meaning, f"{what} {shortened(name, 40)!r}") for meaning in sorted(meant_by(name))]


def signs_beside(words: str, what: str, path: Path) -> list[Sign]:
    """Return the signs in words of the file that are not the measurement's own, such as a title; programs write the
    name of the file there, which is no further sign.
    """
    own = re.sub(re.escape(path.stem), " ", words[:4000], flags=re.I)
    return [Sign("words beside", meaning, f"{what} {shortened(words, 40)!r}") for meaning in sorted(meant_by(own))]


def signs_of_numbers(
    grid_nm: Float[np.ndarray, "L"], values: Float[np.ndarray, "L"], likeness: Likeness | None
) -> list[Sign]:
    """Return the signs in a spectrum's own numbers."""
    found: list[Sign] = []
    if likeness is not None:
        found.append(Sign("resemblance", likeness.kind, f"the numbers of {likeness.name}"))
        if likeness.published:
            found.append(Sign("published scale", likeness.kind, "their published scale"))
    there = np.isfinite(values)
    grid_nm, values = grid_nm[there], values[there]
    if not values.size:
        return found
    if has_mercury_lines(grid_nm, values[None])[0]:
        found.append(Sign("lines", "emission", "lines of mercury at 405, 436 and 546 nm"))
    if values.max() > _ABOVE_PERCENT and is_above_noise(values):
        found.append(Sign("range", "emission", f"values up to {values.max():.4g}, above any percentage"))
    return found


def signs_of_all(grid: np.ndarray, spectra: np.ndarray, field: str) -> list[Sign]:
    """Return the signs that every one of several spectra (N,L) has, where all of them are of one quantity.

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
    """Return whether a spectrum's own numbers, by two signs, are those of a light or a chart that the decision says it
    is not.

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


def colours_alone(found: str) -> InputError:
    """Return the refusal of a table that has colours and no spectra."""
    return InputError(
        "colours of CIELAB or XYZ, and no spectra",
        found=found,
        expected="reflectance, transmittance or emission at wavelengths",
        hint=COLOURS_ALONE,
    )


def scatter_alone(field: str, by: str) -> InputError:
    """Return the refusal of a table without a measurement; `by` : what says so."""
    problem, hint = NO_SCATTER
    expected = "reflectance, transmittance or emission"
    return InputError(problem, field=field, found=f"a scatter or limits, by {by}", expected=expected, hint=hint)


def power_per_frequency(field: str, found: str) -> InputError:
    """Explain why spectral power over frequencies or energies is refused."""
    return InputError(
        "spectral power over a frequency or an energy",
        field=field,
        found=found,
        expected="power per nanometre over wavelengths; reflectance and transmittance may be over either",
        hint="export over wavelength: power per frequency times c / wavelength² is power per wavelength",
    )


class Divisor(NamedTuple):
    """Divisor of values, the scale in a word, where it was told, and a sentence where something was assumed."""

    by: float
    scale: Scale
    words: str
    note: str | None = None


class ValueRange(NamedTuple):
    """The range of the visible samples of all spectra that share a scale, and what they are.

    surface : True for a reflectance or radiance factor, which no surface takes below a ten-thousandth.
    worded : True where the file says in words what was measured.
    most : the largest percentage that is taken for one without a unit: more glitters, and is called a radiance factor.
        Of whole numbers it is less.
    brightest : the largest fraction that is taken where the file states its scale.
    mean : of all samples.
    """

    lowest: float
    highest: float
    surface: bool
    worded: bool
    most: float
    brightest: float
    mean: float

    @classmethod
    def of(cls, samples: np.ndarray, quantity: str, worded: bool) -> ValueRange:
        """Return the range of finite samples (N), 0 to 0 where there are none."""
        lowest, highest = (float(samples.min()), float(samples.max())) if samples.size else (0.0, 0.0)
        most = 100.0 * _MOST_FACTOR if worded and quantity == "radiance factor" else _MOST_PERCENT
        if np.all(samples == np.round(samples)):
            most = _MOST_WHOLE_PERCENT
        brightest = _MOST_FACTOR if quantity == "radiance factor" else _MOST_REFLECTANCE
        return cls(
            lowest,
            highest,
            quantity != "transmittance",
            worded,
            most,
            brightest,
            float(samples.mean()) if samples.size else 0.0,
        )

    @property
    def said(self) -> str:
        """The range, for a message."""
        return f"{self.lowest:.4g} to {self.highest:.4g}"

    @property
    def only_fractions(self) -> bool:
        """True if they would be blacker than black in percent, and bright enough as fractions."""
        return self.surface and 0.0 < self.lowest < _DARK_PERCENT and _BRIGHT <= self.highest <= 2.0

    @property
    def dark_for_percent(self) -> bool:
        """True if none reaches one per cent, and as fractions they would be of no dark surface or filter."""
        return 0.0 < self.highest <= 1.0 and (self.surface or self.highest >= _BRIGHT)

    @property
    def dark_for_fractions(self) -> bool:
        """True if a surface would send back less than black paints do, as radiances seem to."""
        return self.surface and self.highest < _BLACKEST

    @property
    def bright_for_fractions(self) -> bool:
        """True if a surface that does not shine in a direction would send back more than it receives."""
        return self.highest > self.brightest or (self.brightest < _MOST_FACTOR and self.mean > _BRIGHTEST_MEAN)

    @property
    def only_percent(self) -> bool:
        """True if they are above any fraction."""
        return self.lowest > 1.5 or self.highest > _MOST_FACTOR


def divisor_of(values: ValueRange, stated: Scale | None, words: str, answer: ImportOptions) -> Divisor:
    """Find the divisor that makes values fractions of 1.

    Parameters
    ----------
    stated, words : the scale that the file states and where, None and "" where it states none.
    answer : the scale that a person says. A file whose numbers hardly fit what it states leaves the question open.

    Raises
    ------
    InputError
        The file or the person says one scale and the values can only be on the other, or the two say different things;
        or nobody says anything, and the values fit both or neither; or no surface would be as dark or as bright.
    """
    impossible: dict[Scale, bool] = {"percent": values.only_fractions, "fraction": values.only_percent}
    doubt = None if stated is None else _doubt(values, stated, words)
    if stated is not None and (answer.scale is None or (answer.scale == stated and impossible[stated])):
        if doubt is not None:
            raise doubt
        return _divisor(stated, values, words)
    if stated is not None and answer.scale != stated and doubt is None and answer.against != "overruled":
        if answer.against == "kept":
            return _divisor(stated, values, words)
        raise AgainstAnswerError.of(
            "scale",
            field="values",
            found=f"{stated}, by {words}; --scale {answer.scale}",
            hint="import this file without --scale; where its words are wrong, correct them in the file",
        )
    if answer.scale is not None:
        if doubt is not None and stated == "fraction" != answer.scale and values.dark_for_fractions:
            raise doubt
        if impossible[answer.scale]:
            raise _refusal(
                "the numbers are on another scale than --scale says",
                f"{values.said}; --scale {answer.scale}",
                "percent of a surface"
                if answer.scale == "percent"
                else "fractions from 0 to 1, radiance factors up to 10",
                "import this file without --scale, or with the other one",
            )
        if answer.scale == stated and doubt is None:
            return _divisor(answer.scale, values, words)
        against = stated is not None and answer.scale != stated
        return _divisor(answer.scale, values, f"--scale, against {words}" if against else "--scale")
    if values.dark_for_fractions:
        raise _too_dark(values, "no unit", "")
    fraction = values.highest <= 2.0 and values.lowest <= 1.5 and not values.bright_for_fractions
    if fraction and (values.worded or values.only_fractions):
        return Divisor(1.0, "fraction", f"values from {values.said}")
    if values.worded:
        _check_percent(values)
    if values.only_percent and values.highest <= values.most:
        sentence = f"no unit is stated; values from {values.said} can only be percent and are divided by 100"
        return Divisor(100.0, "percent", f"values from {values.said}", sentence)
    above = values.only_percent
    whole = ", in whole numbers as codes and counts are" if above and values.most == _MOST_WHOLE_PERCENT else ""
    raise _refusal(
        "what scale is that?" if above else "percent or fractions?",
        f"{values.said}{whole}, no unit stated",
        "a unit in the header, such as % or 0..1",
        f'{_SETTLED_BY_SCALE}; or write "reflectance (%)" or "radiance factor" above the values',
    )


def divisor_by_format(
    values: np.ndarray, quantity: str, name: str, answer: ImportOptions, stated: Scale | None = None
) -> Divisor | None:
    """Find the divisor of visible values (N) that their format says are fractions; None where there are no values, or
    they are an emission's.

    Parameters
    ----------
    name : of the format.
    answer : about this file alone, it may say percent against the format.
    stated : the scale that the file states instead.

    Raises
    ------
    InputError
        As of `divisor_of`.
    """
    values = values[np.isfinite(values)]
    if not values.size or "emission" in (quantity, answer.quantity):
        return None
    seen, words = ValueRange.of(values, answer.quantity or quantity, True), f"the format ({name})"
    stated, words = (stated, "the words of the file") if stated else ("fraction", words)
    if answer.against != "overruled":
        found = divisor_of(seen, stated, words, replace(answer, scale=None))
        if not answer.allows(quantity):
            return found
    return divisor_of(seen, stated, words, answer)


def check_darkness(values: np.ndarray, name: str, answer: ImportOptions) -> None:
    """Refuse reflectances (N), visible ones, that are fractions by their format and of no surface, unless the answer is
    that they are fractions; name : of the format.

    Raises
    ------
    InputError
        The brightest is darker than any black is.
    """
    values = values[np.isfinite(values)]
    seen = ValueRange.of(values, "reflectance", True)
    if values.size and seen.dark_for_fractions and answer.scale != "fraction":
        raise _too_dark(seen, "stated as fractions", f" below the format ({name})")


def _doubt(values: ValueRange, stated: Scale, words: str) -> InputError | None:
    """Explain why numbers hardly fit the scale that their file states; None where they do."""
    if stated == "fraction" and values.dark_for_fractions:
        return _too_dark(values, "stated as fractions", f" below {words}")
    if stated == "percent" and (values.only_fractions or values.dark_for_percent):
        problem, limit = "the file states percent, and the numbers say fractions", "darker than paints are"
    elif stated == "percent" and values.highest > 100.0 * values.brightest:
        return _too_bright(values, words)
    elif stated == "fraction" and (values.bright_for_fractions or values.only_percent):
        problem = f"{'reflectance' if values.surface else 'transmittance'} looks like percent"
        limit = "nothing sends back as much"
    else:
        return None
    return _refusal(
        problem,
        f"{values.said} below {words}: {limit}",
        "numbers on the scale that the file states",
        f"{_SETTLED_BY_SCALE}, whichever is right",
    )


def _too_dark(values: ValueRange, how: str, where: str) -> InputError:
    write = "" if where else ", or write the unit above"
    return _refusal(
        f"too dark for a surface, and {how}",
        f"{values.said}{where}: the brightest sample would send back {100.0 * values.highest:.2g} %",
        "fractions from 0 to 1, or percent",
        f"a radiance: import this file alone, --as emission; else say --scale fraction where that is right{write}",
    )


def _divisor(scale: Scale, values: ValueRange, words: str) -> Divisor:
    if scale == "fraction":
        return Divisor(1.0, scale, words)
    _check_percent(values)
    doubt = "; none of them exceeds 1, which is dark for percent" if values.highest <= 1.0 else ""
    by_whom = BY_ANSWER if words.startswith("--scale") else "the file states"
    return Divisor(100.0, scale, words, f"{by_whom} percent: values from {values.said} are divided by 100{doubt}")


def _check_percent(values: ValueRange) -> None:
    """Refuse a percentage that nothing sends back: what glitters reaches some hundreds towards a mirror."""
    if values.highest > 100.0 * _MOST_FACTOR:
        raise _too_bright(values._replace(brightest=_MOST_FACTOR), "")


def _too_bright(values: ValueRange, words: str) -> InputError:
    answered = ", or --scale percent where it is right" if values.highest <= 100.0 * _MOST_FACTOR else ""
    return _refusal(
        "brighter than anything that is lit",
        f"{values.said} %{words and f', by {words}'}",
        f"up to {100.0 * values.brightest:g} %",
        f"counts, or a light: export what the instrument makes of them, or import it alone, --as emission{answered}",
    )


def _refusal(problem: str, found: str, expected: str, hint: str) -> InputError:
    return InputError(problem, field="values", found=found, expected=expected, hint=hint)
