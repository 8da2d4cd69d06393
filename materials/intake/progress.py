"""Progress of an import, in words and shares, and how long the rest of it will take."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...runtime.memory import gigabytes

if TYPE_CHECKING:
    from ..fitting.fit import Trial

# Seconds of one core that a fit takes by the kind of its material, until some of that kind are done here; formulas take
# seconds, tables of measurements a minute. Measured over the shipped materials and some measured ones.
_MEASURED_S, _FORMULA_S = 90.0, 2.0
_FIRST_GUESS_S = {
    "scattered": _MEASURED_S,
    "merl": _MEASURED_S,
    "rgl": _MEASURED_S,
    "flake_tilt": _MEASURED_S,
    "lambert": 0.1,
}
# Shares of a fit's time that tables and the growth of packs take, about, where it does not end with tables; the rest
# brings packs within the bounds of shading. Where the budget is met, little of that is left.
_OF_TABLES, _OF_GROWTH, _MET = 0.1, 0.6, 0.9
# Terms of a fit, at most: as `fitting` has them, which first words do not wait for; a test holds them together.
MOST_TERMS = 96
# Before this share of a fit is done, what it took so far says little of the rest.
_TELLING = 0.1
# Of bytes that are read, so often a word.
_EVERY_S = 0.5


@dataclass(frozen=True)
class Doing:
    """Step of the work on one material: in words, and the share of it that is done, 0 to 1."""

    phase: str
    share: float = 0.0


Hears = Callable[[Doing], None]


def in_bytes(words: str, total: int, say: Hears) -> Callable[[int], None]:
    """Return a callback for bytes that are read, which reports `words`, how many they are and the share of `total`, now
    and then.

    total : 0 where it is not known how many they will be.
    """
    done, told = 0, time.monotonic()

    def heard(read: int) -> None:
        nonlocal done, told
        done += read
        if time.monotonic() - told > _EVERY_S:
            told = time.monotonic()
            of = f" of {gigabytes(total)}" if total else " read"
            say(Doing(f"{words}, {gigabytes(done)}{of}", min(1.0, done / total) if total else 0.0))

    return heard


def share_done(trials: Sequence[Trial], budget: float) -> float:
    """Return the share of a fit that is done, 0 to 1.

    While there are tables alone, how far down the way from the worst trial to the budget the best of this lobe is, in
    logarithms. Once all packs are fitted together: the square of the terms, as the time goes, against those that
    the budget asks for if what more terms gained so far is a guide, and `MOST_TERMS` at most.
    """
    scores = [trial.score for trial in trials]
    if not scores or not all(math.isfinite(score) and score > 0 for score in scores):
        return 0.0
    joint = [trial for trial in trials if trial.joint]
    if not joint:
        best, worst = min(trial.score for trial in trials if trial.lobe == trials[-1].lobe), max(scores)
        return _MET if best <= budget else _OF_TABLES * math.log(worst / best) / math.log(worst / budget)
    first, now = joint[0], joint[-1]
    best = min(trial.score for trial in joint)
    if best <= budget:
        return _MET
    gained = math.log(first.score / best) / (now.rank - first.rank) if now.rank > first.rank else 0.0
    needed = now.rank + math.log(best / budget) / gained if gained > 0.0 else MOST_TERMS
    grown = (now.rank / max(now.rank, min(needed, MOST_TERMS))) ** 2
    return _OF_TABLES + _OF_GROWTH * grown


@dataclass
class Expected:
    """Seconds that are left of an import: `pending` are the kinds (models) of materials by id, in `jobs` processes.

    What fits of a kind have taken here takes the place of the first guess.
    """

    pending: dict[str, str]
    jobs: int
    now: Callable[[], float] = time.monotonic
    _taken: Mapping[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    _begun: dict[str, tuple[float, Doing]] = field(default_factory=dict)

    def at(self, material_id: str, doing: Doing) -> None:
        """A material is being worked on."""
        begun, _ = self._begun.get(material_id, (self.now(), doing))
        self._begun[material_id] = begun, doing

    def done(self, material_id: str, seconds: float) -> None:
        """A material is finished; `seconds` is 0 where it failed before its fit."""
        self._begun.pop(material_id, None)
        model = self.pending.pop(material_id, None)
        if model is not None and seconds:
            self._taken[model].append(seconds)

    @property
    def at_work(self) -> dict[str, tuple[float, Doing]]:
        """Return the work in hand: seconds since it was begun, and what it is at."""
        # A copy: who shows it may be another thread.
        return {name: (self.now() - begun, doing) for name, (begun, doing) in list(self._begun.items())}

    @property
    def seconds_left(self) -> float:
        """Estimate the seconds until all is done: those of the longest, or all shared by the processes."""
        at_work = self.at_work
        running = [self._rest(self.pending.get(name, ""), *state) for name, state in at_work.items()]
        waiting = [self._of(model) for name, model in list(self.pending.items()) if name not in at_work]
        return max([*running, *waiting, (sum(running) + sum(waiting)) / max(1, self.jobs)], default=0.0)

    def of(self, material_id: str) -> float:
        """Return the work that one material takes in all."""
        return self._of(self.pending.get(material_id, ""))

    def _of(self, model: str) -> float:
        taken = self._taken.get(model)
        return sum(taken) / len(taken) if taken else _FIRST_GUESS_S.get(model, _FORMULA_S)

    def _rest(self, model: str, elapsed: float, doing: Doing) -> float:
        if doing.share > _TELLING:
            return elapsed * (1.0 - doing.share) / doing.share
        # One that takes longer than others did may be half done.
        whole = self._of(model)
        return whole - elapsed if elapsed < 0.9 * whole else 0.1 * whole + 0.5 * (elapsed - 0.9 * whole)


def in_words(seconds: float) -> str:
    """Return a time as people say it, no more exact than an estimate is.

    >>> in_words(0.2), in_words(41.0), in_words(95.0), in_words(1300.0), in_words(8000.0)
    ('1 s', '41 s', '1 min 35 s', '22 min', '2 h 13 min')
    """
    whole = max(1, round(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 600:
        return f"{whole // 60} min {whole % 60} s" if whole % 60 else f"{whole // 60} min"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
