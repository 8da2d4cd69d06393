"""Percent or fractions: what the values of a reflectance, transmittance or radiance factor are divided by.

A stated scale is followed, unless the numbers cannot be on it. Where none is stated, the person's answer is, within the
same bounds. Where there is neither, a heading that says "reflectance" means fractions unless the values can only be
percent; numbers that nothing calls anything must not fit both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ..answer import Scale

# No surface is darker than this anywhere, as a fraction: coatings of carbon nanotubes reflect a few ten-thousandths.
_BLACKEST = 1e-4
# A black in percent may read less, and a white more: that one table has both below one per cent does not happen.
_DARK_PERCENT, _BRIGHT = 0.02, 0.3
# Percent above this is a light, or a unit that nobody stated.
_MOST_PERCENT = 200.0
_HINT = "say it: --scale percent or --scale fraction"


class Divisor(NamedTuple):
    """What to divide by, the scale in a word, where it was told, and a sentence where something was assumed."""

    by: float
    scale: Scale
    words: str
    note: str | None = None


class Values(NamedTuple):
    """The range of the visible samples of all spectra that share a scale, and what they are.

    surface : True for a reflectance or radiance factor, which no surface takes below a ten-thousandth.
    worded : True where the file says in words what was measured.
    """

    lowest: float
    highest: float
    surface: bool
    worded: bool

    @classmethod
    def of(cls, samples: np.ndarray, quantity: str, worded: bool) -> Values:
        """The range of finite samples (N), 0 to 0 where there are none."""
        lowest, highest = (float(samples.min()), float(samples.max())) if samples.size else (0.0, 0.0)
        return cls(lowest, highest, quantity != "transmittance", worded)

    @property
    def said(self) -> str:
        """The range, for a message."""
        return f"{self.lowest:.4g} to {self.highest:.4g}"

    @property
    def only_fractions(self) -> bool:
        """Whether they would be blacker than black in percent, and bright enough as fractions."""
        return self.surface and 0.0 < self.lowest < _DARK_PERCENT and _BRIGHT <= self.highest <= 2.0

    @property
    def only_percent(self) -> bool:
        """Whether they are above what any fraction is."""
        return self.lowest > 1.5 or self.highest > 10.0


def divisor_of(values: Values, stated: Scale | None, words: str, answer: Scale | None) -> Divisor:
    """What to divide values by to have fractions of 1.

    Parameters
    ----------
    stated, words : the scale that the file states and where, None and "" where it states none.
    answer : the scale that a person says.

    Raises
    ------
    InputError
        The file or the person says one scale and the values can only be on the other, or the two say different things;
        or nobody says anything, and the values fit both or neither.
    """
    impossible: dict[Scale, bool] = {"percent": values.only_fractions, "fraction": values.only_percent}
    if stated is not None:
        if answer not in (None, stated) and not (impossible[stated] or (stated == "percent" and values.highest <= 1)):
            raise _refusal(
                "the file states one scale, and --scale another",
                f"{stated}, by {words}; --scale {answer}",
                "an answer only where the file leaves the question open",
                "import this file without --scale; where its words are wrong, correct them in the file",
            )
        if answer in (None, stated) and impossible[stated] and stated == "percent":
            raise _refusal(
                "the file states percent, and the numbers say fractions",
                f"{values.said} below {words}: in percent, that is blacker than any surface",
                "numbers on the scale that the file states",
                f"{_HINT}, whichever is right",
            )
        chosen = answer or stated
        words = words if chosen == stated else f"--scale, against {words}"
        return _divisor(chosen, values, words)
    if answer is not None:
        if impossible[answer]:
            raise _refusal(
                "the numbers are on another scale than --scale says",
                f"{values.said}; --scale {answer}",
                "fractions from 0 to 1, radiance factors up to 10" if answer == "fraction" else "percent of a surface",
                "import this file without --scale, or with the other one",
            )
        return _divisor(answer, values, "--scale")
    if values.surface and values.highest < _BLACKEST:
        raise _refusal(
            "too dark for a surface, and no unit",
            f"{values.said}; the blackest coatings reflect {_BLACKEST:g}",
            "fractions from 0 to 1, or percent",
            "is it a radiance? say --as emission; else write the unit above the values",
        )
    fraction = values.highest <= 2.0 and values.lowest <= 1.5
    if fraction and (values.worded or values.only_fractions):
        return Divisor(1.0, "fraction", f"values from {values.said}")
    if values.only_percent and (values.worded or values.highest <= _MOST_PERCENT):
        sentence = f"no unit is stated; values from {values.said} can only be percent and are divided by 100"
        return Divisor(100.0, "percent", f"values from {values.said}", sentence)
    above = values.only_percent
    raise _refusal(
        "what scale is that?" if above else "percent or fractions?",
        f"{values.said}, no unit stated",
        "a unit in the header, such as % or 0..1",
        f'{_HINT}; or write "reflectance (%)" or "radiance factor" above the values',
    )


def _divisor(scale: Scale, values: Values, words: str) -> Divisor:
    if scale == "fraction":
        return Divisor(1.0, scale, words)
    doubt = "; none of them exceeds 1, which is dark for percent" if values.highest <= 1.0 else ""
    by_whom = "the import says" if words == "--scale" else "the file states"
    return Divisor(100.0, scale, words, f"{by_whom} percent: values from {values.said} are divided by 100{doubt}")


def _refusal(problem: str, found: str, expected: str, hint: str) -> InputError:
    return InputError(problem, field="values", found=found, expected=expected, hint=hint)
