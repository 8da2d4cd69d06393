"""Decompositions of whole tables: beside tensorly on the same table, and how time and memory grow with size and rank.

Tables are those of Schwenk 2010: theta_i x phi x theta_o x Peercy coefficients of f_r cos(theta_i). Everything is run
in this process, one after the other. Memory is what was allocated at most while decomposing (tracemalloc, in a run of
its own, so that the times are not slowed by it), plus the table itself.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from tensorly.cp_tensor import CPTensor, cp_to_tensor
from tensorly.decomposition import parafac

from ...materials.core.axes import Axis
from ...materials.core.brdf import Brdf
from ...materials.fitting.brdf_table import tabulate
from ...materials.fitting.decompose import METHODS, Method, decompose
from ...spectral.basis import SpectralBasis
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from ..basis import stage
from ..timing import peak_bytes, timed
from .parts import part_rows

#: The paper's table: theta_i, phi, theta_o, coefficients; and its decomposition.
PAPER_SHAPE = (90, 180, 90, 8)
PAPER_RANK, ITERATIONS = 16, 25
#: Resolutions as shares of the paper's, and ranks: at a glance, and in full.
QUICK = ((0.25, 0.35, 0.5), (4, 8, 16), 0.35)
FULL = ((0.35, 0.5, 0.7, 1.0, 1.4), (4, 8, 16, 32, 64), 1.0)

Say = Callable[[str], None]


def paper_table(brdf: Brdf, shape: tuple[int, int, int, int] = PAPER_SHAPE) -> Float[np.ndarray, "i p o J"]:
    """f_r cos(theta_i) over theta_i x phi x theta_o, in Peercy's basis of as many coefficients as `shape` says."""
    on = stage()
    basis = SpectralBasis.peercy(on.reflectances, on.columns, shape[3])
    resample = interpolation_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    right = 0.5 * np.pi
    axes = (Axis("theta_i", shape[0], right), Axis("theta_o", shape[2], right), Axis("phi", shape[1], np.pi))
    return np.ascontiguousarray(np.moveaxis(tabulate(brdf, "io", axes, resample.T @ basis.analysis).values, 2, 1))


def speed_row(
    case: str,
    brdf: Brdf,
    shape: tuple[int, int, int, int] = PAPER_SHAPE,
    rank: int = PAPER_RANK,
    iterations: int = ITERATIONS,
) -> dict:
    """Both sides on the same table: seconds, entry-by-entry relative errors, and how many times faster ours is; and
    the same of the `parts` of a decomposition (`part_rows`).
    """
    table = paper_table(brdf, shape)
    ours = {method: _decomposed(table, rank, method) for method in METHODS}
    tensorly = _parafac(table, rank, iterations)
    refitted = ours["refitted"]
    return {
        "case": case,
        "shape": list(shape),
        "rank": rank,
        "iterations": iterations,
        "table_bytes": table.nbytes,
        "tensorly_seconds": tensorly[0],
        "tensorly_relative_error": tensorly[1],
        "seconds": refitted["seconds"],
        "relative_error": refitted["relative_error"],
        "peak_bytes": refitted["peak_bytes"],
        "times_faster": tensorly[0] / refitted["seconds"],
        "error_ratio": refitted["relative_error"] / tensorly[1],
        "methods": ours,
        "parts": part_rows(table, rank),
    }


def growth(case: str, brdf: Brdf, *, full: bool, progress: Say = lambda line: None) -> list[dict]:
    """Finer tables at the paper's rank, then higher ranks on one table; `over` says which of the two a row is for.

    A row has `case`, `over`, `scale`, `shape`, `nodes`, `rank`, `seconds`, `table_bytes`, `peak_bytes` and
    `relative_error`.
    """
    scales, ranks, scale_of_ranks = FULL if full else QUICK
    asked = [("resolution", scale, PAPER_RANK) for scale in scales]
    asked += [("rank", scale_of_ranks, rank) for rank in ranks]
    rows, tables = [], {}
    for over, scale, rank in asked:
        first, second, third = (max(int(size * scale), 4) for size in PAPER_SHAPE[:3])
        shape = (first, second, third, PAPER_SHAPE[3])
        if shape not in tables:
            # One at a time: they are large.
            tables = {shape: paper_table(brdf, shape)}
        table = tables[shape]
        found = _decomposed(table, rank, "refitted")
        row = {"case": case, "over": over, "scale": scale, "shape": list(shape), "nodes": int(np.prod(shape[:3]))}
        rows.append({**row, "rank": rank, "table_bytes": table.nbytes, **found})
        progress(
            f"    growth: {' x '.join(map(str, shape))}, rank {rank}: {found['seconds']:.2f} s, "
            f"{found['peak_bytes'] / 1e6:.0f} MB, error {found['relative_error']:.1e}"
        )
    return rows


def entrywise_error(table: np.ndarray, cp: CPTensor) -> float:
    """Norm of the residual over that of the table, entry by entry, one slab of the first mode at a time."""
    weights, (first, *others) = cp
    # A slab is a decomposition itself: a row of the first factor is its weights.
    slabs = (cp_to_tensor((weights * row, others)) for row in first)
    left = sum(float(np.sum((found - slab) ** 2)) for found, slab in zip(slabs, table, strict=True))
    return float(np.sqrt(left) / np.linalg.norm(table))


def _decomposed(table: np.ndarray, rank: int, method: Method) -> dict[str, float]:
    found, seconds = timed(lambda: decompose(table, rank, method=method))
    peak = table.nbytes + peak_bytes(lambda: decompose(table, rank, method=method))
    return {"seconds": seconds, "relative_error": entrywise_error(table, found.cp), "peak_bytes": peak}


def _parafac(table: np.ndarray, rank: int, iterations: int) -> tuple[float, float]:
    """Seconds and error of tensorly's parafac from its own random start."""
    found, seconds = timed(lambda: parafac(table, rank, n_iter_max=iterations, init="random", random_state=0, tol=0))
    return seconds, entrywise_error(table, found)
