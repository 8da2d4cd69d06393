"""CP factors of a dense table, fast: compress, decompose the small core, expand.

Three methods:

- "joint": all terms at once, from several starts; the best is followed to the end. - "incremental": packs of four
  terms, each fitted to the residual of those before (Schwenk 2010, section 3.3). - "refitted": between the two: packs
  of four, with all terms fitted jointly after each new one.

All work on the core of a Tucker form (`tucker`), where a sweep of alternating least squares costs next to nothing. The
basis of each mode is orthonormal, so that lengths of terms and sums of squares are those of the table itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from tensorly.cp_tensor import CPTensor, cp_to_tensor

from ...runtime.errors import InputError
from .cp import Factors, absorbed, cp_als, longest_first, random_start, term_lengths
from .tucker import Tucker, compressed

Method = Literal["joint", "incremental", "refitted"]
METHODS: tuple[Method, ...] = ("joint", "incremental", "refitted")

# Terms that share a texture of four channels.
PACK = 4
# Share of the energy that compression may lose: 3e-5 of the norm.
_LOST = 1e-9
# A sum of R terms needs no more than R columns a mode; twice as many and this many more leave the best R room to turn.
_MARGIN = 16
# Random starts that are tried for some terms; the best goes on.
_STARTS = 2
# Sweeps of alternating least squares that the best start is given, at most; each start is tried for a quarter of them.
_SWEEPS = 300
# Pull of every term towards zero: what keeps pairs from growing and cancelling, far below the errors that are reached.
_RIDGE = 1e-8


@dataclass(frozen=True, eq=False)
class Decomposition:
    """CP decomposition of a table, and its error.

    cp : one factor (n, R) per mode, longest term first; all weights are 1.
    relative_error : norm of the residual over the norm of the table, the loss by compression included.
    longest : length of the longest term over the norm of the table; far above 1 if terms cancel.
    core_shape : size of the compressed table.
    """

    cp: CPTensor
    relative_error: float
    longest: float
    core_shape: tuple[int, ...]

    @property
    def rank(self) -> int:
        """Number of terms R."""
        return self.cp.rank

    @property
    def packs(self) -> int:
        """Number of four-channel textures that the terms fill."""
        return -(-self.rank // PACK)


def decompose(
    table: Float[np.ndarray, "..."],
    rank: int,
    *,
    method: Method = "refitted",
    seed: int = 0,
    sweeps: int = _SWEEPS,
) -> Decomposition:
    """Approximate `table` by a sum of `rank` outer products of vectors, in the sense of least squares.

    Parameters
    ----------
    table : at least two modes; only read, if it is C-contiguous and float64.
    method : see the module's text.
    seed : of the random starts; the same seed gives the same bits on the same machine.
    sweeps : of the best start, at most.

    Raises
    ------
    InputError : rank below 1, an unknown method, fewer than two modes, or values that are not finite.
    """
    if rank < 1:
        raise InputError("unusable rank", field="rank", found=rank, expected="at least 1")
    if method not in METHODS:
        raise InputError("unknown method", field="method", found=method, expected=", ".join(METHODS))
    if table.ndim < 2 or table.size == 0:
        raise InputError("not a table", field="table", found=table.shape, expected="two modes or more, none empty")
    form = compressed(table, _LOST, 2 * rank + _MARGIN)
    return decompose_compressed(form, rank, method=method, seed=seed, sweeps=sweeps)


def decompose_compressed(
    form: Tucker,
    rank: int,
    *,
    method: Method = "refitted",
    seed: int = 0,
    sweeps: int = _SWEEPS,
) -> Decomposition:
    """Apply `decompose` to a compressed table: for several ranks or methods of the same table."""
    generator = np.random.default_rng(seed)
    if form.energy == 0.0:
        nothing = CPTensor((None, [np.zeros((len(basis), rank)) for basis in form.bases]))
        return Decomposition(nothing, 0.0, 0.0, form.core.shape)
    # Scale to unit length, so that neither large nor small tables overflow or underflow.
    norm = np.sqrt(form.energy)
    unit = form.core / norm
    if method == "joint":
        core = _best(unit, rank, generator, sweeps)
    else:
        core = _packs(unit, rank, generator, sweeps, refit=method == "refitted")
    left = float(np.sum((unit - cp_to_tensor(core)) ** 2)) + form.lost / form.energy
    factors = absorbed(core)
    share = norm ** (1.0 / len(factors))
    whole = form.expanded(CPTensor((None, [factor * share for factor in factors])))
    return Decomposition(whole, float(np.sqrt(left)), float(term_lengths(factors).max()), form.core.shape)


def _best(core: np.ndarray, rank: int, generator: np.random.Generator, sweeps: int) -> CPTensor:
    """Fit all terms at once: the most promising of several short runs, continued."""
    short = max(sweeps // 4, 1)
    tried = [cp_als(core, random_start(core, rank, generator), short, _RIDGE, 1e-14) for _ in range(_STARTS)]
    begun, _ = min(tried, key=lambda run: run[1])
    return cp_als(core, begun, sweeps, _RIDGE, 1e-14)[0]


def _packs(core: np.ndarray, rank: int, generator: np.random.Generator, sweeps: int, *, refit: bool) -> CPTensor:
    """Fit four terms at a time to the residual; with a joint refit after each if `refit`."""
    factors: Factors = [np.zeros((size, 0)) for size in core.shape]
    while (have := factors[0].shape[1]) < rank:
        residual = core - cp_to_tensor((None, factors)) if have else core
        if not np.any(residual):
            pack = [np.zeros((size, rank - have)) for size in core.shape]
        else:
            pack = absorbed(_best(residual, min(PACK, rank - have), generator, sweeps))
        factors = [np.hstack(pair) for pair in zip(factors, pack, strict=True)]
        if refit and have:
            factors = absorbed(cp_als(core, CPTensor((None, factors)), sweeps, _RIDGE, 1e-14)[0])
    return longest_first(factors)
