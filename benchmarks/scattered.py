"""Interpolation error of measured spectral BRDFs: a tenth of the direction pairs is left out and predicted.

    python -m metamer.benchmarks.scattered [FILE.brdf ...] [--json OUT.json]

Two tests. "tenth": ten folds drawn at random; a pair, its duplicates, its mirror image and its exchange share a fold.
"incidence": every pair of one theta_i is left out, for each theta_i but the first and last, which is what a grid
between the measured angles asks of an interpolant. ΔE94 between the measured and the predicted XYZ under D65 for
the 1931 2 degree observer, XYZ = pi f_r cos(theta_i) folded (a perfect diffuser facing the light has Y = 1),
reference = measured, over the wavelengths at which the reading did not drop out.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..materials.core.directions import io_angles
from ..materials.formats.cornell import read_cornell
from ..materials.measured.scattered import ScatteredBrdf, ScatteredMeasurement
from ..spectral.difference import delta_e_xyz
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from .timing import command, write_json

LIGHT, OBSERVER = "D65", "1931_2"
# A predictor gives (K,L) at the pairs (wi, wo), and how many of them it had to take from the nearest neighbour.
Predictor = Callable[[ScatteredMeasurement, np.ndarray, np.ndarray], tuple[np.ndarray, int]]


def kriged(known: ScatteredMeasurement, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, int]:
    """Evaluate as Metamer does, and count the pairs that it could not do."""
    return ScatteredBrdf.from_measurement(known).eval_measured(wi, wo, exact=True), 0


def linear(known: ScatteredMeasurement, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, int]:
    """Linear over a Delaunay tessellation of (theta_i, theta_o, phi); nearest neighbour outside its hull."""
    from scipy.interpolate import LinearNDInterpolator

    places = np.stack(io_angles(known.wi, known.wo), axis=-1)
    values = LinearNDInterpolator(places, known.values)(np.stack(io_angles(wi, wo), axis=-1))
    outside = np.isnan(values).any(axis=1)
    values[outside] = nearest_reading(known, wi[outside], wo[outside])[0]
    return values, int(outside.sum())


def nearest_reading(known: ScatteredMeasurement, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the nearest reading in (theta_i, theta_o, phi), and the pairs that it could not do."""
    from scipy.spatial import cKDTree

    tree = cKDTree(np.stack(io_angles(known.wi, known.wo), axis=-1))
    return known.values[tree.query(np.stack(io_angles(wi, wo), axis=-1))[1]], 0


METHODS: dict[str, Predictor] = {"kriged": kriged, "linear": linear, "nearest": nearest_reading}


def random_folds(measurement: ScatteredMeasurement, count: int = 10, seed: int = 0) -> np.ndarray:
    """Fold (N,) of every pair; pairs that symmetry makes equal share one."""
    theta_i, theta_o, phi = io_angles(measurement.wi, measurement.wo)
    key = np.stack([np.minimum(theta_i, theta_o), np.maximum(theta_i, theta_o), phi], axis=-1).round(4)
    distinct, group = np.unique(key, axis=0, return_inverse=True)
    shuffled = np.random.default_rng(seed).permutation(len(distinct)) % count
    return shuffled[group.ravel()]


def incidence_folds(measurement: ScatteredMeasurement) -> np.ndarray:
    """Fold (N,) by theta_i; -1 for the smallest and the largest, which are never left out."""
    rings, fold = np.unique(np.degrees(io_angles(measurement.wi, measurement.wo)[0]).round(2), return_inverse=True)
    return np.where((fold == 0) | (fold == len(rings) - 1), -1, fold)


def reading_differences(measurement: ScatteredMeasurement, predicted: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """ΔE94 of `predicted` (K,L) against the measurement at `rows`."""
    weights = observer(OBSERVER).weights(illuminant(LIGHT), measurement.wavelengths_nm)
    seen = np.pi * measurement.wi[rows, 2:] * ~measurement.missing[rows]
    reference, sample = ((seen * values) @ weights.T for values in (measurement.values[rows], predicted))
    return delta_e_xyz(reference, sample, weights.sum(axis=1))


def left_out(measurement: ScatteredMeasurement, folds: np.ndarray, methods: dict[str, Predictor]) -> dict[str, dict]:
    """Statistics of each method over every pair with a fold >= 0 and any reading, predicted from all other folds."""
    measured = ~measurement.missing.all(axis=1)
    out = {}
    for name, predict in methods.items():
        start, found, outside = time.perf_counter(), [], 0
        for fold in np.unique(folds[folds >= 0]):
            test = (folds == fold) & measured
            known = measurement.subset(folds != fold)
            predicted, beyond = predict(known, measurement.wi[test], measurement.wo[test])
            found.append(reading_differences(measurement, predicted, test))
            outside += beyond
        error = np.concatenate(found)
        median, p95, p99 = (float(value) for value in np.percentile(error, [50, 95, 99]))
        out[name] = {
            "pairs": len(error), "mean": float(error.mean()), "median": median, "p95": p95, "p99": p99,
            "max": float(error.max()), "outside_hull": outside, "seconds": time.perf_counter() - start,
        }  # fmt: skip
    return out


def validate(
    measurement: ScatteredMeasurement, *, folds: int = 10, seed: int = 0, incidence: bool = True
) -> dict[str, dict[str, dict]]:
    """{"tenth": {method: statistics}, "incidence": {...}} of one measurement."""
    tests = {"tenth": random_folds(measurement, folds, seed)}
    if incidence:
        tests["incidence"] = incidence_folds(measurement)
    return {test: left_out(measurement, fold, METHODS) for test, fold in tests.items()}


def main(arguments: list[str] | None = None) -> int:
    """Measure and print; 0."""
    parser = command(__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    folder = os.environ.get("METAMER_DATA")
    files = chosen.files or (sorted(Path(folder, "brdf", "cornell-spectral").glob("*.brdf")) if folder else [])
    if not files:
        print("name .brdf files, or set METAMER_DATA to a folder with brdf/cornell-spectral/", file=sys.stderr)
        return 64
    report = {"light": LIGHT, "observer": OBSERVER, "formula": "CIE 1994", "seed": chosen.seed, "materials": {}}
    columns = ("mean", "median", "p95", "p99", "max")
    print(
        f"{'material':16}{'left out':11}{'method':9}" + "".join(f"{column:>9}" for column in columns) + "  outside hull"
    )
    for file in files:
        results = report["materials"][file.stem] = validate(read_cornell(file), seed=chosen.seed)
        for test, methods in results.items():
            for method, row in methods.items():
                numbers = "".join(f"{row[column]:9.3f}" for column in columns)
                print(f"{file.stem:16}{test:11}{method:9}{numbers}{row['outside_hull']:10d}", flush=True)
    write_json(chosen.json, report)
    return 0


if __name__ == "__main__":
    sys.exit(main())
