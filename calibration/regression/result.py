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
    """ΔE94 of one layer over the compared pixels, and the bounds of rounding and noise alone (`floor_*`).

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
    """A criterion and its figure; `of` is the subject, `floor` the smallest significant figure.

    resolved : True if the files can show a difference as small as the limit to warn.
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
    """One row: its verdict, and the reasons.

    approximation : ΔE94 p99 of picture and reference, before and after. unasked : True if no criterion applies.
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
        """Largest mean change of a layer, ΔE94."""
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
    """Result of a comparison.

    pooled : criteria over all rows. checks : injected known differences. notes : further remarks.
    across : accepted differences between measurements, also among the notes.
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
        """True if every injected difference was found."""
        return bool(self.checks) and all(check.passed for check in self.checks)

    @property
    def tier(self) -> Tier:
        """Worst tier of all rows and criteria; a comparison that fails its self-test passes nothing."""
        found = (*self.rows, *self.pooled)
        return worst_tier(one.tier for one in found) if self.valid else "fail"

    @property
    def exit_code(self) -> int:
        """0 pass, 1 warn, 2 fail."""
        return TIERS.index(self.tier)

    def as_run(self, version: str) -> Run:
        """Return a run for the history: the largest current p99 of a layer of each row."""
        rows = {str(row.name): max(one.p99 for one in row.layers.values()) for row in self.rows if row.layers}
        return Run(datetime.now(UTC).isoformat(timespec="seconds"), version, self.tier, rows)

    @property
    def worst_first(self) -> tuple[RowResult, ...]:
        """Rows in order of reading: failures first, then by state, then by the size of the change."""
        return tuple(sorted(self.rows, key=lambda row: (-TIERS.index(row.tier), STATES.index(row.state), -row.largest)))


def worst_tier(tiers: Iterable[Tier]) -> Tier:
    """Return the worst of some tiers; "pass" without any."""
    return TIERS[max((TIERS.index(tier) for tier in tiers), default=0)]
