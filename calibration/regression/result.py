"""Result of a comparison, row by row and in all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from ..report.history import Run
from ..report.statistics import SelfCheck
from .criteria import TIERS, Criterion, Tier
from .row import LayerKind, RowName

#: State of a row. Worse and better: its picture moved, away from its own reference or towards it.
State = Literal["added", "removed", "worse", "better", "changed", "same", "identical"]
#: In the order in which they are read.
STATES: tuple[State, ...] = ("removed", "worse", "changed", "better", "added", "same", "identical")


@dataclass(frozen=True)
class Figures:
    """ΔE94 of one layer over the compared pixels, and what rounding and noise alone may reach (`floor_*`).

    undefined : compared pixels without a number. shift : mean ΔL*, Δa*, Δb*.
    worst : row and column of the largest, with CIELAB before and after.
    """

    mean: float
    median: float
    p95: float
    p99: float
    max: float
    floor_mean: float
    floor_max: float
    pixels: int
    undefined: int
    reshaped: float
    identical: bool
    moved: bool
    shift: tuple[float, float, float]
    worst: tuple[int, int]
    before_lab: tuple[float, float, float]
    after_lab: tuple[float, float, float]


@dataclass(frozen=True)
class AskedCriteria:
    """A criterion and what it came to; `of` is the subject, `floor` what could not have been told from nothing.

    resolved : whether the files can show a difference as small as the limit to warn.
    """

    criterion: Criterion
    of: str
    value: float
    floor: float
    tier: Tier

    @property
    def resolved(self) -> bool:
        """True if the limit to warn lies above the floor."""
        return self.floor <= self.criterion.warn


@dataclass(frozen=True)
class RowResult:
    """One row: what became of it, and why.

    approximation : ΔE94 p99 of picture and reference, before and after. unasked : whether no criterion is for it.
    """

    name: RowName
    state: State
    tier: Tier
    layers: Mapping[LayerKind, Figures]
    asked: tuple[AskedCriteria, ...] = ()
    approximation: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    unasked: bool = False

    @property
    def largest(self) -> float:
        """The largest mean change of a layer, ΔE94."""
        return max((one.mean for one in self.layers.values()), default=0.0)


@dataclass(frozen=True)
class SideWords:
    """Description of a side."""

    path: Path
    kind: str
    facts: Mapping[str, str]
    chain: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """All of a comparison.

    pooled : criteria over all rows. checks : known differences that were put in. notes : what else is to be said.
    across : what was compared although it was not measured alike; it stands among the notes, too.
    """

    before: SideWords
    after: SideWords
    rows: tuple[RowResult, ...]
    pooled: tuple[AskedCriteria, ...]
    checks: tuple[SelfCheck, ...]
    criteria: tuple[Criterion, ...]
    notes: tuple[str, ...] = ()
    across: tuple[str, ...] = ()

    def count(self, state: State) -> int:
        """Count the rows of a verdict."""
        return sum(row.state == state for row in self.rows)

    @property
    def identical(self) -> bool:
        """True if both sides have the same rows with the same bytes."""
        return all(row.state == "identical" for row in self.rows)

    @property
    def valid(self) -> bool:
        """True if every difference that was put in was found."""
        return bool(self.checks) and all(check.passed for check in self.checks)

    @property
    def tier(self) -> Tier:
        """The worst of all rows and criteria; a comparison that fails its own check passes nothing."""
        found = (*self.rows, *self.pooled)
        return worst_tier(one.tier for one in found) if self.valid else "fail"

    @property
    def exit_code(self) -> int:
        """0 pass, 1 warn, 2 fail."""
        return TIERS.index(self.tier)

    def as_run(self, version: str) -> Run:
        """Return a run for the history: the largest p99 of a layer of each row, now."""
        rows = {str(row.name): max(one.p99 for one in row.layers.values()) for row in self.rows if row.layers}
        return Run(datetime.now(UTC).isoformat(timespec="seconds"), version, self.tier, rows)

    @property
    def worst_first(self) -> tuple[RowResult, ...]:
        """Rows as they are read: failures first, then by state, then by how far they moved."""
        return tuple(sorted(self.rows, key=lambda row: (-TIERS.index(row.tier), STATES.index(row.state), -row.largest)))


def worst_tier(tiers: Iterable[Tier]) -> Tier:
    """Return the worst of some tiers; of none, "pass"."""
    return TIERS[max((TIERS.index(tier) for tier in tiers), default=0)]
