"""Tucker compression of a dense table: orthonormal bases of every mode and a small core, in little memory.

Sequentially truncated higher-order SVD (Vannieuwenhoven, Vandebril and Meerbergen 2012): each mode's basis is computed
from the core of the modes before it. Bases come from the eigenvectors of mode Gram matrices. The last and the first
mode of the table, which go first, are unfolded by views; the others only once the core is smaller.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from tensorly.cp_tensor import CPTensor

from ...runtime.errors import InputError

Bases = tuple[Float[np.ndarray, "_ _"], ...]


@dataclass(frozen=True, eq=False)
class Tucker:
    """core (k_1 .. k_m) times one orthonormal basis (n, k) a mode; `energy` and `lost` are sums of squares."""

    core: Float[np.ndarray, "..."]
    bases: Bases
    energy: float
    lost: float

    def expanded(self, core: CPTensor) -> CPTensor:
        """Return a CP decomposition of the core as one of the table; lengths and errors do not change."""
        weights, factors = core
        return CPTensor((weights, [basis @ factor for basis, factor in zip(self.bases, factors, strict=True)]))


def compressed(table: Float[np.ndarray, "..."], lost: float = 1e-10, most: int | None = None) -> Tucker:
    """Compute a Tucker form of `table` that loses at most the share `lost` of its energy, over all modes together.

    `most`: columns of a basis at most, whatever the loss, which bounds the core of a noisy table.

    A C-contiguous table of float64 is only read; beyond it no more is allocated than one copy truncated in its first
    compressed mode. The last mode goes first: it is the spectrum, whose rank is low.

    Raises
    ------
    InputError : the table holds NaN, infinity, or numbers whose squares overflow.
    """
    core = np.ascontiguousarray(table, dtype=float)
    with np.errstate(invalid="ignore", over="ignore"):
        energy = float(np.vdot(core, core))
    if not np.isfinite(energy):
        raise InputError("the table is not finite", field="table", found="NaN or infinity", expected="numbers")
    bases: dict[int, np.ndarray] = {}
    order = [core.ndim - 1, *range(core.ndim - 1)]
    allowed = lost * energy / core.ndim
    for mode in order:
        values, vectors = np.linalg.eigh(mode_gram(core, mode))
        kept = max(1, int(np.sum(np.cumsum(np.maximum(values, 0.0)) > allowed))) if energy > 0 else 1
        kept = kept if most is None else min(kept, most)
        bases[mode] = np.ascontiguousarray(vectors[:, ::-1][:, :kept])
        if kept < core.shape[mode]:
            core = projected(core, bases[mode], mode)
        else:
            bases[mode] = np.eye(kept)
    gone = max(energy - float(np.vdot(core, core)), 0.0)
    return Tucker(core, tuple(bases[mode] for mode in range(core.ndim)), energy, gone)


def mode_gram(tensor: Float[np.ndarray, "..."], mode: int) -> Float[np.ndarray, "n n"]:
    """X X^T of the unfolding of a C-contiguous tensor along `mode`.

    >>> mode_gram(np.arange(6.0).reshape(1, 2, 3), 1)
    array([[ 5., 14.],
           [14., 50.]])
    """
    size = tensor.shape[mode]
    if mode == tensor.ndim - 1:
        rows = tensor.reshape(-1, size)
        return rows.T @ rows
    # One large product: many small ones stall where threads share few cores. A view for the first mode.
    columns = np.moveaxis(tensor, mode, 0).reshape(size, -1)
    return columns @ columns.T


def projected(tensor: Float[np.ndarray, "..."], basis: Float[np.ndarray, "n k"], mode: int) -> Float[np.ndarray, "..."]:
    """Return the tensor with `mode` expressed in the columns of `basis`: a contiguous array of size k along it."""
    # tensorly's `mode_dot` copies the table before it is smaller than it was: here the last mode is a view.
    if mode == tensor.ndim - 1:
        return (tensor.reshape(-1, tensor.shape[mode]) @ basis).reshape(*tensor.shape[:-1], basis.shape[1])
    columns = np.moveaxis(tensor, mode, 0)
    found = (basis.T @ columns.reshape(len(columns), -1)).reshape(-1, *columns.shape[1:])
    return np.ascontiguousarray(np.moveaxis(found, 0, mode))
