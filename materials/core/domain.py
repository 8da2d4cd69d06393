"""Domains of models' parameters: said once, at its field, for checks and for sliders alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Domain:
    """Finite numbers from `low` (excluded with `open_low`) to `high`; `unit` is "" for what has none."""

    low: float
    high: float = np.inf
    open_low: bool = False
    unit: str = ""

    def holds(self, number: float) -> bool:
        """Return whether the number is one of them."""
        above = number > self.low if self.open_low else number >= self.low
        return bool(np.isfinite(number) and above and number <= self.high)

    @property
    def words(self) -> str:
        """Describe the domain for a message: "a number > 0 and <= 1"."""
        upper = f" and <= {self.high:g}" if np.isfinite(self.high) else ""
        unit = f" {self.unit}" if self.unit else ""
        return f"a number {'>' if self.open_low else '>='} {self.low:g}{upper}{unit}"


def in_domain(low: float, high: float = np.inf, *, open_low: bool = False, unit: str = "") -> dict[str, Domain]:
    """Metadata of a dataclass field that is such a number."""
    return {"domain": Domain(low, high, open_low, unit)}
