"""Tolerances: a colour difference by a formula, and the verdict on a pair."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.axis_letters import Lab, White
from ...spectral.difference import xyz_from_lab
from ...spectral.formula import Formula, formula

Verdict = Literal["pass", "fail", "not resolved", "not judged"]
#: Verdicts as people read them, on pages, on paper and in the terminal.
VERDICT_WORDS: dict[Verdict, str] = {
    "pass": "passes",
    "fail": "fails",
    "not resolved": "too close to call",
    "not judged": "not judged",
}
# Directions that a tolerance is drawn in, and halvings of a distance: to 1e-12 of it.
_DIRECTIONS, _HALVINGS = 96, 40
# Units of CIELAB that a tolerance is looked for in.
_FAR = 512.0


@dataclass(frozen=True)
class Tolerance:
    """Tolerance of a colour difference.

    formula : of the difference. limit : the largest accepted one.
    """

    formula: Formula
    limit: float

    @classmethod
    def of(cls, text: str) -> Tolerance:
        """Read a tolerance from words such as "CMC 2:1 1.0" or "CIE 2000 0.8".

        Raises
        ------
        InputError : no text, no number above 0 at the end, or no formula before it.

        >>> Tolerance.of("CMC 2:1 1.0").limit
        1.0
        """
        match = re.fullmatch(r"\s*(.+?)[\s<=]+([0-9.]+)\s*", text) if isinstance(text, str) else None
        try:
            limit = float(match[2]) if match else 0.0
        except ValueError:
            limit = 0.0
        alone = _is_formula(text)
        if match is None or alone or not 0.0 < limit < np.inf:
            raise InputError(
                "a tolerance without its limit" if alone else "not a tolerance",
                field="tolerance",
                found=text,
                expected='a formula and a number above 0, such as "CMC 2:1 1.0" or "CIE 2000 0.8"',
                hint=f'write the largest difference that is accepted behind it, as in "{text.strip()} 1.0"'
                if alone
                else None,
            )
        return cls(formula(match[1]), limit)

    @property
    def words(self) -> str:
        """Tolerance in words, such as "CMC 2:1 ≤ 1"."""
        return f"{self.formula.name} ≤ {self.limit:g}"

    def at(self, geometry: str) -> Tolerance:
        """Return the tolerance of a pair read at an angle, such as "45as15"."""
        return replace(self, formula=self.formula.at(geometry))

    def verdict(self, delta_e: float, uncertainty: float | None) -> Verdict:
        """Return the verdict on a difference; "not resolved" if the limit is within its uncertainty."""
        if uncertainty is not None and abs(delta_e - self.limit) <= uncertainty:
            return "not resolved"
        return "pass" if delta_e <= self.limit else "fail"

    def outline(
        self, standard: Lab, white: White, across: Float[np.ndarray, "3"], up: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "n 2"]:
        """Trace the tolerance in the plane of two unit vectors of CIELAB about a standard, in units of each.

        For any formula, by bisection along each direction; a closed line, its first point repeated at the end.
        """
        turn = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS + 1)
        ways = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        first = xyz_from_lab(np.asarray(standard, dtype=np.float64), white)
        low, high = np.zeros(len(ways)), np.full(len(ways), _FAR)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            at = standard + (ways * middle[:, None]) @ np.stack([across, up])
            off = self.formula(np.broadcast_to(first, at.shape), xyz_from_lab(at, white), white)
            # Coordinates without a colour are beyond the limit.
            beyond = ~(off <= self.limit)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return ways * low[:, None]


def _is_formula(text: str) -> bool:
    """Return True if the whole text is the name of a formula, whose number is no limit."""
    try:
        formula(text)
    except InputError:
        return False
    return True
