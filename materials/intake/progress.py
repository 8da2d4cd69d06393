"""Progress of an import in words and fractions, and expected durations."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...runtime.memory import gigabytes

if TYPE_CHECKING:
    from ..fitting.fit import Trial

# Seconds of one core that a fit takes by the model of its material, until some of that model are done here; formulas
# take seconds, tables of measurements a minute. Measured over the shipped materials and some measured ones.
_MEASURED_S, _FORMULA_S = 90.0, 2.0
_FIRST_GUESS_S = {
    "scattered": _MEASURED_S,
    "merl": _MEASURED_S,
    "rgl": _MEASURED_S,
    "flake_tilt": _MEASURED_S,
    "lambert": 0.1,
}
# Work of a fit: before anything is tried, and at the end; of a table, and of each of its terms; of all packs, as if
# together they had so many terms more: a step of growth, which looks for terms first, and in parts of it another
# refinement, and a round that brings them within the bounds of shading.
_PREPARING, _STORING, _TABLE, _TABLE_TERM, _BESIDE, _REFINED, _ROUND = 15.0, 12.0, 4.0, 0.75, 16.0, 0.45, 0.33
# Terms up to which tables are tried, and from which twice as many are added at a time.
_TABLE_TERMS, _MANY = 8, 32
# Terms of a fit, at most, and the end of its words while it brings them within the bounds of shading: as `fitting` has
# them, which first words do not wait for; tests hold them together.
MOST_TERMS = 96
OUT_OF_BOUNDS = "still out of the bounds of shading"
# Seconds between reports of bytes read.
_EVERY_S = 0.5


@dataclass(frozen=True)
class Doing:
    """Current step of the work on one material: in words, and the fraction done, 0 to 1."""

    phase: str
    share: float = 0.0


Hears = Callable[[Doing], None]


def in_bytes(words: str, total: int, say: Hears) -> Callable[[int], None]:
    """Return a callback for bytes read, which reports `words`, their number and the fraction of `total` at intervals.

    total : 0 if it is unknown.
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


def share_done(trials: Sequence[Trial], budget: float, phase: str = "") -> float:
    """Return the fraction of a fit that is done, 0 to 1, from the terms tried and those still expected.

    The number of terms for the budget is extrapolated from the gains so far: scores fall as a power of the terms. phase
    : description of the current work; bringing terms within the bounds of shading is the last phase.
    """
    scores = [trial.score for trial in trials]
    if not scores or not all(math.isfinite(score) and score > 0 for score in scores):
        return 0.0
    joint = [trial for trial in trials if trial.joint and trial.rank >= _TABLE_TERMS]
    done = _PREPARING + sum(_work(trial.rank, trial.joint) for trial in trials)
    alike = joint or [trial for trial in trials if trial.lobe == trials[-1].lobe and not trial.joint] or trials
    if phase.endswith(OUT_OF_BOUNDS):
        terms, places = (int(word) for word in phase.replace(":", "").split() if word.isdecimal())
        done += _work(terms, terms > trials[-1].rank)
        return done / (done + _STORING + (1.0 + math.log2(places) / 3.0) * _ROUND * (terms + _BESIDE))
    now, met = alike[-1].rank, min(trial.score for trial in alike) <= budget
    needed, left = now if met else _needed(alike, budget), _STORING
    if not joint and needed > _TABLE_TERMS:
        left, now = left + _work(_TABLE_TERMS, False) + 2.0 * _work(_TABLE_TERMS, True), _TABLE_TERMS
    while now < min(needed, MOST_TERMS):
        growing = now >= _TABLE_TERMS
        now += 1 if not growing else 8 if now < _MANY or needed - now <= 8 else 16
        left += _work(now, growing)
    # Bounds are out of reach where a budget is.
    return done / (done + left + (4.0 if needed > MOST_TERMS else 2.5) * _ROUND * (now + _BESIDE))


def _work(terms: int, joint: bool) -> float:
    """Return the work of a trial: of a table, or of all packs together, more than those that tables have tried."""
    if not joint:
        return _TABLE + _TABLE_TERM * terms
    return (1.0 if terms > _TABLE_TERMS else _REFINED) * (terms + _BESIDE)


def _needed(trials: Sequence[Trial], budget: float) -> float:
    """Extrapolate the number of terms that the budget needs from the gains so far."""
    first, best = trials[0], min(trials, key=lambda trial: trial.score)
    if best.rank <= first.rank or best.score >= first.score:
        # By the first power of the terms, as the better fits go.
        return best.rank * best.score / budget
    power = math.log(first.score / best.score) / math.log(best.rank / first.rank)
    return best.rank * (best.score / budget) ** (1.0 / power)


def fit_seconds(model: str) -> float:
    """Return the expected seconds of a fit for a model, relative to other models."""
    return _FIRST_GUESS_S.get(model, _FORMULA_S)
