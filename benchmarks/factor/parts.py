"""The parts of a decomposition, tensorly's and ours on the same input: by how much ours win, which is why they stay.

What tensorly does as well is used as it is: `CPTensor`, `cp_to_tensor`.
"""

from __future__ import annotations

from collections.abc import Callable
from timeit import Timer
from typing import Any

import numpy as np
from tensorly.cp_tensor import CPTensor, cp_to_tensor
from tensorly.decomposition import parafac, tucker
from tensorly.tenalg import khatri_rao as tensorly_khatri_rao
from tensorly.tenalg import unfolding_dot_khatri_rao

from ...materials.fitting.cp import absorbed, cp_als, khatri_rao, mttkrp, random_start
from ...materials.fitting.tucker import compressed
from ..timing import timed

# Share of the energy that compression may lose, as `decompose` has it.
_LOST = 1e-9
# Columns that a basis has at most, beyond twice the rank; as `decompose` has it.
_MARGIN = 16
# Sweeps of alternating least squares, at most.
_SWEEPS = 300
# Pull of every term towards zero in our sweeps, as a share of the energy; as `decompose` has it.
_RIDGE = 1e-8
# Share of the energy at which our sweeps end.
_TOLERANCE = 1e-14
# A quick call is repeated until all of its repeats together take this long, seconds.
_LEAST_SECONDS = 0.02
# Number of measurements; the fastest counts.
_TIMES = 5


def part_rows(table: np.ndarray, rank: int) -> list[dict[str, Any]]:
    """One row a part, of a decomposition of `table` into `rank` terms by way of a compressed core.

    A row has `part`, `tensorly_seconds`, `seconds`, `times_faster`, and `tensorly_relative_error` and `relative_error`
    of what was decomposed (None where both give the same numbers).
    """
    most = 2 * rank + _MARGIN
    form, seconds = timed(lambda: compressed(table, _LOST, most))
    # One iteration after its start: more would not be nearer.
    tucked: tuple[Any, float] = timed(lambda: tucker(table, list(form.core.shape), n_iter_max=1, init="svd"))
    (core, _), theirs = tucked
    errors = (_lost(form.energy, it) for it in (core, form.core))
    rows = [_row("Tucker compression of the table", theirs, seconds, *errors)]
    unit = form.core / np.linalg.norm(form.core)
    start = random_start(unit, rank, np.random.default_rng(0))
    (ours, _), seconds = timed(lambda: cp_als(unit, start, _SWEEPS, _RIDGE, _TOLERANCE))
    # It changes the start that it is given, and says that this is a text; its documentation knows better.
    copied: Any = CPTensor((start.weights.copy(), [factor.copy() for factor in start.factors]))
    found, theirs = timed(lambda: parafac(unit, rank, n_iter_max=_SWEEPS, init=copied))
    errors = (_error(unit, it) for it in (found, ours))
    rows.append(_row("alternating least squares of the core", theirs, seconds, *errors))
    factors, modes = absorbed(start), range(unit.ndim)
    pairs: tuple[tuple[str, Callable[[], Any], Callable[[], Any]], ...] = (
        (
            "tensor times Khatri-Rao product, every mode",
            lambda: [unfolding_dot_khatri_rao(unit, (None, factors), mode) for mode in modes],
            lambda: [mttkrp(unit, factors, mode) for mode in modes],
        ),
        ("Khatri-Rao product", lambda: tensorly_khatri_rao(factors[1:]), lambda: khatri_rao(factors[1:])),
    )
    rows += [_row(part, _fastest(theirs), _fastest(ours), None, None) for part, theirs, ours in pairs]
    return rows


def _row(part: str, theirs: float, ours: float, their_error: float | None, our_error: float | None) -> dict[str, Any]:
    return {
        "part": part,
        "tensorly_seconds": theirs,
        "seconds": ours,
        "times_faster": theirs / ours,
        "tensorly_relative_error": their_error,
        "relative_error": our_error,
    }


def _fastest(call: Callable[[], Any]) -> float:
    """Seconds of one call, the least of several measurements."""
    repeats = 1
    while Timer(call).timeit(repeats) < _LEAST_SECONDS:
        repeats *= 2
    return min(Timer(call).repeat(_TIMES, repeats)) / repeats


def _lost(energy: float, core: np.ndarray) -> float:
    """Relative error of a Tucker form with orthonormal bases: what of the norm is not in its core."""
    return float(np.sqrt(max(1.0 - float(np.vdot(core, core)) / energy, 0.0)))


def _error(tensor: np.ndarray, cp: CPTensor) -> float:
    return float(np.linalg.norm(cp_to_tensor(cp) - tensor) / np.linalg.norm(tensor))
