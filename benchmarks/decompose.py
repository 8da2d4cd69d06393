"""How fast a dense table is decomposed, beside tensorly on the same table, and how that grows with size and rank.

    python -m benchmarks.decompose [--json OUT.json] [--growth]

Tables are those of Schwenk 2010: theta_i x phi x theta_o x 8 Peercy coefficients. Both sides run in this process, one
after the other; `peak` is what was allocated at most while decomposing (tracemalloc, in a run of its own, so that the
times are not slowed by it) plus the table itself, in units of the table's float64 size.
"""

from __future__ import annotations

import argparse
import json
import time
import tracemalloc
from pathlib import Path

import numpy as np
from metamer.calibration.basis_benchmark import stage
from metamer.materials.brdf import Brdf
from metamer.materials.factors import Axis
from metamer.materials.fitting.decompose import METHODS, Method, decompose
from metamer.materials.fitting.tabulated import tabulate
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from metamer.viewer.factor_cases import chosen_cases

SHAPE = (90, 180, 90, 8)
RANK, ITERATIONS = 16, 25
CASES = ("oren-nayar-0.52", "ashikhmin-shirley-32")


def paper_table(brdf: Brdf, shape: tuple[int, int, int, int] = SHAPE) -> np.ndarray:
    """f_r cos(theta_i) over theta_i x phi x theta_o, in Peercy's basis of as many coefficients as `shape` says."""
    on = stage()
    basis = SpectralBasis.peercy(on.reflectances, on.columns, shape[3])
    resample = interpolation_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    right = 0.5 * np.pi
    axes = (Axis("theta_i", shape[0], right), Axis("theta_o", shape[2], right), Axis("phi", shape[1], np.pi))
    return np.ascontiguousarray(np.moveaxis(tabulate(brdf, "io", axes, resample.T @ basis.analysis).values, 2, 1))


def ours(table: np.ndarray, rank: int, method: Method = "refitted") -> dict:
    """Seconds, error and peak memory of `decompose`."""
    start = time.perf_counter()
    found = decompose(table, rank, method=method)
    seconds = time.perf_counter() - start
    tracemalloc.start()
    decompose(table, rank, method=method)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return {
        "shape": list(table.shape),
        "rank": rank,
        "method": method,
        "seconds": seconds,
        "relative_error": relative_error(table, found.factors),
        "declared_error": found.relative_error,
        "longest_term": found.longest,
        "core": list(found.core_shape),
        "peak": 1.0 + peak / table.nbytes,
    }


def tensorlys(table: np.ndarray, rank: int, iterations: int = ITERATIONS) -> dict:
    """Seconds and error of tensorly's parafac from its own random start."""
    from tensorly.decomposition import parafac

    start = time.perf_counter()
    weights, factors = parafac(table, rank, n_iter_max=iterations, init="random", random_state=0, tol=0)
    seconds = time.perf_counter() - start
    return {"seconds": seconds, "relative_error": relative_error(table, (factors[0] * weights, *factors[1:]))}


def relative_error(table: np.ndarray, factors: tuple[np.ndarray, ...] | list[np.ndarray]) -> float:
    """Norm of the residual over that of the table, entry by entry, one slab of the first mode at a time."""
    first, *rest = factors
    terms = rest[0]
    for factor in rest[1:-1]:
        terms = (terms[:, None, :] * factor[None]).reshape(-1, first.shape[1])
    left = sum(
        float(np.sum(((terms * row) @ rest[-1].T - slab.reshape(-1, table.shape[-1])) ** 2))
        for row, slab in zip(first, table, strict=True)
    )
    return float(np.sqrt(left) / np.linalg.norm(table))


def run(shape: tuple[int, int, int, int] = SHAPE, rank: int = RANK, iterations: int = ITERATIONS) -> list[dict]:
    """Both sides on each case, and the ratios."""
    rows = []
    for case in chosen_cases(CASES):
        table = paper_table(case.make(), shape)
        row = {"case": case.name, **ours(table, rank), "tensorly": tensorlys(table, rank, iterations)}
        row["times_faster"] = row["tensorly"]["seconds"] / row["seconds"]
        row["methods"] = [ours(table, rank, method) for method in METHODS]
        rows.append(row)
    return rows


def growth(case: str = CASES[1], scales: tuple[float, ...] = (0.5, 1.0, 1.5), ranks: tuple[int, ...] = (4, 8, 16, 32)):
    """Rows of `ours` for finer tables at one rank, and for higher ranks on one table."""
    (chosen,) = chosen_cases((case,))
    brdf = chosen.make()
    rows = []
    for scale in scales:
        shape = tuple(int(size * scale) for size in SHAPE[:3])
        rows.append(ours(paper_table(brdf, (*shape, SHAPE[3])), RANK))
    table = paper_table(brdf)
    return rows + [ours(table, rank) for rank in ranks]


def line(row: dict) -> str:
    """One row in words."""
    size = " x ".join(str(size) for size in row["shape"])
    return (
        f"{size}, rank {row['rank']:2d}, {row['method']:11s}: {row['seconds']:.2f} s, "
        f"error {row['relative_error']:.2e}, longest term {row['longest_term']:.2f}, peak {row['peak']:.2f} tables"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="OUT")
    parser.add_argument("--growth", action="store_true", help="also other sizes and ranks")
    args = parser.parse_args()
    figures = {"rows": run(), "growth": growth() if args.growth else []}
    for row in figures["rows"]:
        other = row["tensorly"]
        print(row["case"])
        print(f"  tensorly, {ITERATIONS} iterations: {other['seconds']:.1f} s, error {other['relative_error']:.2e}")
        for method in row["methods"]:
            print(" ", line(method))
        print(f"  {row['times_faster']:.0f} times faster")
    for row in figures["growth"]:
        print(line(row))
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
