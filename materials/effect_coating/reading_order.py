"""Check of the order of readings against their angles: by lightness, and by fits of other orders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, groupby, permutations

import numpy as np

from ...spectral.measurement import ALIKE_DEGREES, Geometry
from .coated_pair import aspecular
from .fit import AngleReadings, evidence

# On 19 measured paints, exchanging the angles on both sides of the mirror, or turning the list round, leaves twice to
# two hundred times as much to be corrected.
_FAR_BETTER = 0.5
# L* by which an angle may be lighter than one that is nearer to the mirror direction, or than the same beyond it; of
# seven measured coatings the first is 0.4 at most, and the second never.
_RISE = 2.0


def doubtful_order(readings: AngleReadings, geometries: Sequence[Geometry], interference: float) -> str:
    """Describe why readings hardly belong to their stated angles; "" if there is no evidence of that.

    geometries : (n) of the readings. interference : q of the BRDF that was fitted to them as they are.
    """
    for near, far in _falling(geometries, aspecular(readings.wi, readings.wo)):
        first, second = readings.lab[[near, far], 0]
        if second > first + _RISE:
            rise = f"from {first:.1f} at {geometries[near].notation} to {second:.1f} at {geometries[far].notation}"
            return f"L* rises {rise}, where paints get darker: check the order of the angles, and their signs"
    found = [
        (evidence(replace(readings, values=readings.values[order]), interference), words)
        for order, words in _orders(geometries)
    ]
    best, words = min(found, default=(np.inf, ""))
    if best < _FAR_BETTER * evidence(readings, interference):
        return f"the readings fit far better {words}: check which reading is of which angle"
    return ""


def _falling(geometries: Sequence[Geometry], away: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield pairs of readings whose second should not be the lighter one."""
    order = np.argsort(away, kind="stable")
    yield int(order[0]), int(order[-1])
    angles = [one.second or 0.0 for one in geometries]
    for near, far in permutations(range(len(geometries)), 2):
        one, two = geometries[near], geometries[far]
        in_turn = 0.0 < angles[near] < angles[far]
        across = angles[near] < 0.0 and abs(angles[near] + angles[far]) <= ALIKE_DEGREES
        if (one.first, one.azimuth) == (two.first, two.azimuth) and (in_turn or across):
            yield near, far


def _orders(geometries: Sequence[Geometry]) -> Iterator[tuple[list[int], str]]:
    """Yield common mistaken orders of geometries, with descriptions."""
    for one, two in combinations(range(len(geometries)), 2):
        first, second = geometries[one], geometries[two]
        if first._replace(second=-(first.second or 0.0)).matches(second) and abs(first.second or 0.0) > ALIKE_DEGREES:
            order = list(range(len(geometries)))
            order[one], order[two] = two, one
            yield order, f"with {first.notation} and {second.notation} exchanged"

    def light(at: int) -> tuple[float, float]:
        return geometries[at].first or 0.0, geometries[at].azimuth

    def away(at: int) -> float:
        return geometries[at].second or 0.0

    for _, group in groupby(sorted(range(len(geometries)), key=light), light):
        ascending = sorted(group, key=away)
        for turned in (ascending, [at for at in ascending if away(at) > 0.0]):
            if len(turned) > 1:
                order = list(range(len(geometries)))
                for at, other in zip(turned, reversed(turned), strict=True):
                    order[at] = other
                names = ", ".join(geometries[at].notation for at in turned)
                yield order, f"with {names} in reverse"
