"""Appearance offsets in words, "warmer, glossier": directions and amounts in a space of colour and gloss."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError

#: Distance of a stop of gloss in units of CIELAB. A choice: matt and black glass then differ by 27, black and white by
#: 100. No experiment that weighs one against the other is known to us.
STOP = 5.0
#: Colours were called warm by cos(hue - 50 degrees), most at large chroma: Ou, Luo, Woodcock and Wright, "A study of
#: colour emotion and colour preference", Color Research and Application 29(3), 2004, part I.
WARM_HUE_DEG = 50.0
# Chroma below which hue is noise.
_LEAST_CHROMA = 2.0


@dataclass(frozen=True)
class Appearance:
    """Appearance of a material: CIELAB at 45:0 under D65 for the 1931 2 degree observer, and its gloss.

    gloss : in stops, see `gloss`. gloss_units : of the same, at 60 degrees; of a wish, None.
    """

    lab: tuple[float, float, float]
    gloss: float
    gloss_units: float | None = None

    @property
    def point(self) -> Float[np.ndarray, "4"]:
        """L*, a*, b* and gloss."""
        return np.array([*self.lab, self.gloss])

    @property
    def chroma(self) -> float:
        """C*."""
        return float(np.hypot(self.lab[1], self.lab[2]))


def _hue(degrees: float) -> tuple[float, float, float, float]:
    angle = np.radians(degrees)
    return (0.0, float(np.cos(angle)), float(np.sin(angle)), 0.0)


#: Each word with its opposite and the direction of the first in L*, a*, b*, gloss; None: along the material's own hue.
PAIRS: tuple[tuple[str, str, tuple[float, float, float, float] | None], ...] = (
    ("lighter", "darker", (1.0, 0.0, 0.0, 0.0)),
    ("redder", "greener", _hue(0.0)),
    ("yellower", "bluer", _hue(90.0)),
    ("stronger", "greyer", None),
    ("warmer", "cooler", _hue(WARM_HUE_DEG)),
    ("glossier", "duller", (0.0, 0.0, 0.0, 1.0)),
)
WORDS = tuple(word for first, second, _ in PAIRS for word in (first, second))


@dataclass(frozen=True, eq=False)
class Wish:
    """Target relative to the appearance of a material.

    start : its appearance. amounts : along each word, in CIELAB, of gloss in stops. to : the target.
    directions : (K,4) of each word, of unit length.
    """

    start: Appearance
    amounts: Mapping[str, float]
    to: Appearance
    directions: Float[np.ndarray, "K 4"]

    def got(self, look: Appearance) -> dict[str, float]:
        """Measure another appearance along each word, in its own unit; negative in the opposite direction."""
        moved = self.directions @ (look.point - self.start.point)
        return {word: float(length) for word, length in zip(self.amounts, moved, strict=True)}

    def besides(self, look: Appearance) -> dict[str, float]:
        """Describe the other changes: the part outside the span of the wish's directions, as lengths above 0."""
        moved = look.point - self.start.point
        if len(self.directions):
            moved = moved - self.directions.T @ np.linalg.lstsq(self.directions.T, moved, rcond=None)[0]
        plain = (PAIRS[0], PAIRS[1], PAIRS[2], PAIRS[-1])
        return {
            (more if length > 0 else less): abs(float(length))
            for (more, less, _), length in zip(plain, moved, strict=True)
            if abs(length) > 1e-9
        }


def wished(start: Appearance, amounts: Mapping[str, float | int]) -> Wish:
    """Compute the target of a wish from `start`: {"warmer": 10, "glossier": 1}; without amounts it is `start`.

    Raises
    ------
    UnknownNameError : a word that is not one of `WORDS`.
    InputError : an invalid amount, a word beside its opposite, or an impossible target: below black, duller than matt,
        greyer than grey, stronger without a hue.
    """
    for word in amounts:
        if word not in WORDS:
            raise UnknownNameError("word for a wish", word, WORDS, field="wish").at(expected=", ".join(WORDS))
    amounts = {word: float(amount) for word, amount in amounts.items()}
    directions = []
    for more, less, _ in PAIRS:
        if more in amounts and less in amounts:
            found = f"{more} and {less}"
            raise InputError("a wish that contradicts itself", field="wish", found=found, expected="one of the two")
    for word, amount in amounts.items():
        if not (np.isfinite(amount) and amount > 0):
            opposite = next(less if word == more else more for more, less, _ in PAIRS if word in (more, less))
            hint = f"{opposite} is the word for the other way"
            raise InputError("not a length", field=word, found=f"{amount:g}", expected="more than 0", hint=hint)
        directions.append(_direction(word, amount, start))
    rows = np.array(directions).reshape(-1, 4)
    end = start.point + np.array(list(amounts.values()), dtype=float) @ rows
    for word, value, name in (("darker", end[0], "L*"), ("duller", end[3], "stops of gloss")):
        # The start itself may be below 0 by rounding: refuse only a wish in that direction.
        if word in amounts and value < 0:
            most = start.point[0] if word == "darker" else start.gloss
            found, expected = f"{amounts[word]:g} of {most:.2f} {name}", "no more than there is"
            raise InputError("no material can be so", field=word, found=found, expected=expected)
    lightness, red, yellow, gloss = map(float, end)
    return Wish(start, amounts, Appearance((lightness, red, yellow), gloss), rows)


def _direction(word: str, amount: float, start: Appearance) -> tuple[float, float, float, float]:
    more, _, direction = next(pair for pair in PAIRS if word in pair[:2])
    if direction is None:
        chroma = start.chroma
        if more == word and chroma < _LEAST_CHROMA:
            raise InputError(
                "a grey has no hue to be stronger in",
                field=word,
                found=f"a chroma of {chroma:.2f}",
                expected=f"{_LEAST_CHROMA:g} at least",
                hint="say which hue: redder, greener, yellower, bluer",
            )
        if more != word and amount > chroma:
            found = f"{amount:g} of a chroma of {chroma:.2f}"
            raise InputError("no material can be so", field=word, found=found, expected="no more than there is")
        direction = (0.0, start.lab[1] / chroma, start.lab[2] / chroma, 0.0)
    sign = 1.0 if word == more else -1.0
    return (sign * direction[0], sign * direction[1], sign * direction[2], sign * direction[3])
