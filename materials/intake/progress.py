"""Progress of an import in words and shares, and what of it is expected to take how long."""

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
# Shares of a fit's time that tables and the growth of packs take, about, where it does not end with tables; the rest
# brings packs within the bounds of shading. Where the budget is met, little of that is left.
_OF_TABLES, _OF_GROWTH, _MET = 0.1, 0.6, 0.9
# Terms of a fit, at most: as `fitting` has them, which first words do not wait for; a test holds them together.
MOST_TERMS = 96
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


def fit_seconds(model: str) -> float:
    """Return the seconds that a fit of a material of a model is expected to take, beside those of other models."""
    return _FIRST_GUESS_S.get(model, _FORMULA_S)
