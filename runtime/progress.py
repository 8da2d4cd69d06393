"""Estimated time left of work, from its progress and a cost model."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, field
from typing import Literal

# Before this share of an item is done, and before as much of the work is done or measured, its beginning, which is
# slow, says little of the rest.
_TELLING = 0.1
# From this share of what was expected, it may take half as long again as it is over that.
_LATE = 0.9

#: Place of an item: beside others in processes of their own, one by one behind the longest of these, or last.
How = Literal["beside", "behind", "last"]


@dataclass(frozen=True)
class _Stage:
    """Key of an item that follows the previous one."""

    number: int


@dataclass(eq=False)
class _Item:
    """Item of work: seconds `expected` and `taken`; while in progress, the fractions done with their times.

    how : as of `How`. evenly : its fractions are of all its time, and may fall when more work turns out to be left.
    """

    kind: str
    expected: float
    how: How
    evenly: bool = False
    heard: list[tuple[float, float]] = field(default_factory=list)
    taken: float | None = None

    def whole(self, now: float) -> float | None:
        """Estimate the total seconds; None while too little is done."""
        if self.taken is not None:
            return self.taken or None
        if not self.heard or self.heard[-1][0] < _TELLING:
            return None
        return now - self.heard[0][1] + self.rest_by_speed(now)

    def rest_by_speed(self, now: float) -> float:
        """Estimate the seconds left from the speed of the later half of the progress, or of all of it if `evenly`."""
        share, at = self.heard[-1]
        since = self.heard[:1] if self.evenly else self.heard
        before, then = next(entry for entry in reversed(since) if 2.0 * entry[0] <= share)
        return _less((at - then) / (share - before) * (1.0 - share), now - at)

    def rest(self, whole: float, now: float) -> float:
        """Estimate the seconds left; `whole` is expected until enough is done to tell."""
        if not self.heard:
            return whole
        if self.heard[-1][0] >= _TELLING:
            return self.rest_by_speed(now)
        return _less(whole, now - self.heard[0][1])


def _less(expected: float, elapsed: float) -> float:
    """Return the remainder of the expected seconds; beyond these, half of the overrun."""
    late = _LATE * expected
    if not expected:
        return 0.0
    return expected - elapsed if elapsed < late else expected - late + 0.5 * (elapsed - late)


class TimeLeft:
    """Estimate of the seconds until all items of some work are done.

    An item has a kind and a weight, the seconds expected by a cost model. Durations of recent items of its kind correct
    that or, without any, those of all others. So weights must be right relative to each other, not on every machine.

    stages : consecutive kinds of items with their expected seconds; some may be skipped. jobs : number of simultaneous
    items. now : the clock.
    """

    def __init__(
        self, stages: Iterable[tuple[str, float]] = (), jobs: int = 1, now: Callable[[], float] | None = None
    ) -> None:
        self.jobs, self._now = jobs, now or time.monotonic
        self._items: dict[Hashable, _Item] = {}
        # By kind, in the order in which they were done: what was expected of items, and what they took.
        self._taken: dict[str, list[tuple[float, float]]] = defaultdict(list)
        # The stage that is under way, how many of its steps are done, and of how many; and how many stages there are.
        self._stage: tuple[_Stage, float, float] | None = None
        self._stages = 0
        # When the last stage was heard of: the next one began then, unless it says when.
        self._ended = self._now()
        for kind, seconds in stages:
            self.expect_stage(kind, seconds)

    def expect(self, key: Hashable, kind: str, seconds: float, how: How = "beside", evenly: bool = False) -> None:
        """Add an item with its expected seconds, or change these.

        evenly : reported fractions are of its total time, and may fall again; else a slow start says little about the
        rest, and no fraction falls.
        """
        self._items[key] = _Item(kind, seconds, how, evenly)

    def expect_stage(self, kind: str, seconds: float) -> _Stage:
        """Append a stage."""
        stage = _Stage(self._stages)
        self._stages += 1
        self.expect(stage, kind, seconds)
        return stage

    def __contains__(self, key: Hashable) -> bool:
        """Return whether an item was added."""
        return key in self._items

    def at(self, key: Hashable, share: float = 0.0) -> None:
        """Record the fraction done of an item, 0 at its start, 1 at its end."""
        item, now = self._items[key], self._now()
        heard = item.heard
        if not heard:
            heard.append((0.0, self._ended if share and isinstance(key, _Stage) else now))
        if share > heard[-1][0] or (item.evenly and share != heard[-1][0]):
            heard.append((share, now))
            if share >= 1.0:
                self.done(key)

    def done(self, key: Hashable, seconds: float | None = None) -> None:
        """Record the end of an item, and its seconds; None: since it began, 0: unknown."""
        item = self._items[key]
        if item.taken is not None:
            return
        if seconds is None:
            seconds = self._now() - item.heard[0][1] if item.heard else 0.0
        item.taken = seconds
        if seconds:
            self._taken[item.kind].append((item.expected, seconds))

    def heard(self, done: float, total: float, kind: str) -> bool:
        """Record that `done` of `total` steps of a stage are done; returns whether they are the first of it.

        A restarted count is the next stage, and so is work of another kind, if expected.
        """
        key, before, of = self._stage or (None, 0.0, 0.0)
        begins = key is None or total != of or done < before
        if begins or (self._items[key].kind != kind and self._later(kind) is not None):
            key, begins = self._begun(kind), True
        self.at(key, done / total if total else 1.0)
        self._stage, self._ended = (key, done, total), self._now()
        return begins

    @property
    def seconds(self) -> float | None:
        """Estimate the seconds left; None while too little is done."""
        now, items = self._now(), list(self._items.values())
        measured = [(item.expected, whole) for item in items if (whole := item.whole(now)) is not None]
        expected = sum(weight for weight, _ in measured)
        if not measured or expected < _TELLING * sum(item.expected for item in items):
            return None
        scale = sum(whole for weight, whole in measured if weight) / expected if expected else 1.0
        rests: dict[How, list[float]] = {"beside": [0.0], "behind": [], "last": []}
        for item in items:
            if item.taken is None:
                rests[item.how].append(item.rest(self._whole(item, scale), now))
        beside, behind, last = map(sum, rests.values())
        return max((beside + behind) / max(1, self.jobs), max(rests["beside"]) + behind) + last

    def _whole(self, item: _Item, scale: float) -> float:
        """Return the currently expected total seconds of an item."""
        taken = self._taken.get(item.kind, ())
        later = taken[len(taken) // 2 :]
        weight = sum(weight for weight, _ in later)
        return item.expected * (sum(seconds for _, seconds in later) / weight if weight else scale)

    def _later(self, kind: str) -> _Stage | None:
        """Find the first stage of a kind that has not begun."""
        stages = (key for key in self._items if isinstance(key, _Stage))
        return next((key for key in stages if self._items[key].kind == kind and not self._items[key].heard), None)

    def _begun(self, kind: str) -> _Stage:
        """Begin a stage: the previous one is done, and skipped ones are dropped."""
        if self._stage is not None:
            self.done(self._stage[0])
        stage = self._later(kind)
        if stage is None:
            return self.expect_stage(kind, 0.0)
        for other in list(self._items):
            if isinstance(other, _Stage) and other.number < stage.number and not self._items[other].heard:
                del self._items[other]
        return stage
