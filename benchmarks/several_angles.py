"""Errors of BRDFs reconstructed from readings at a few angles, measured and as they are stated.

    python -m metamer.benchmarks.several_angles [FILE ...] [--json OUT.json]

Files are measured BRDFs in any format that the catalogue reads; none: those of $METAMER_DATA. Each is read as an
instrument would read it, at 3, 5, 6 and 12 angles, reconstructed, and compared: ΔE94 under D65 for the 1964 10 degree
observer, XYZ = pi f_r cos(theta_i) folded (a perfect diffuser facing the light has Y = 1), reference = measured, over
pairs of directions more than 7 degrees from the mirror and up to 80 degrees from the normal.

"lambert" is the reading at 45as45 taken for a matt surface. "front" is the mean over a sphere lit at 10 and 35 degrees
from the view. "stated" is the mean that a record would state of these pairs and "bound mean" what nine tenths are said
to lie below, "below" the share that does; "covered" the share below the bound of its own pair of directions, "rank"
Spearman's correlation of expected and true errors. Spectra that were made up from
RGB tell of no interference: it is left out there.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.stats import spearmanr

from ..materials.core.brdf import Brdf
from ..materials.core.directions import spherical
from ..materials.core.protocol import sphere_protocol
from ..materials.effect_coating.coated_pair import aspecular
from ..materials.effect_coating.fit import AngleReadings, body_albedo, reconstructed
from ..materials.effect_coating.off_specular import light_and_detector
from ..materials.effect_coating.stated_error import FLARE, expected_errors
from ..materials.intake.sources import read_sources
from ..materials.measured.scattered import ScatteredBrdf
from ..materials.records.models import rebuild
from ..materials.records.source import MaterialSource
from ..spectral.difference import delta_e_xyz
from ..spectral.illuminants import illuminant
from ..spectral.measurement import Geometry, geometry_in
from ..spectral.observers import observer
from .timing import command, write_json

LIGHT, OBSERVER = "D65", "1964_10"
_PLANE = ("45as-15", "45as15", "45as25", "45as45", "45as75", "45as110")
#: Angles of usual instruments, by their number.
ANGLES = {
    3: ("45as15", "45as45", "45as110"),
    5: _PLANE[1:],
    6: _PLANE,
    12: (*_PLANE, "15as-45", "15as-30", "15as-15", "15as15", "15as45", "15as80"),
}
_STEEPEST = np.radians(80.5)
_FRONT = (10.0, 35.0)
# A sphere and a grid of pairs, for what was not measured at pairs of its own.
_PIXELS = 48
_POLAR, _AZIMUTH = np.arange(10.0, 81.0, 10.0), np.arange(0.0, 181.0, 10.0)


def truth(path: Path) -> tuple[Brdf, bool]:
    """Return the BRDF of a file, and whether its spectra were measured and not made up."""
    source = next(one for one in read_sources(path) if isinstance(one, MaterialSource))
    brdf = rebuild(source.model, source.parameters)
    if not isinstance(brdf, Brdf):
        raise TypeError(f"{path}: {source.model} is no BRDF")
    return brdf, source.provenance.standing == "measured"


def read_at(brdf: Brdf, notations: tuple[str, ...]) -> AngleReadings:
    """Read a BRDF as an instrument does.

    Of scattered pairs, which have rings at 40 and at 50 degrees, 45as-15 is the mean of both: a single odd pair beyond
    the mirror would be carried over to it.
    """
    wi, wo = light_and_detector([_angle(one) for one in notations])
    values = np.array(brdf.eval(wi, wo))
    if isinstance(brdf, ScatteredBrdf) and "45as-15" in notations:
        rings = brdf.eval(*light_and_detector([_angle("40as-15"), _angle("50as-15")]))
        values[notations.index("45as-15")] = np.exp(np.log(np.maximum(rings, 1e-6)).mean(axis=0))
    return AngleReadings(brdf.wavelengths_nm, wi, wo, values)


def _angle(notation: str) -> Geometry:
    geometry = geometry_in(notation)
    assert geometry is not None
    return geometry


def pairs(brdf: Brdf) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Choose pairs to compare at: those that were measured, else a grid."""
    if isinstance(brdf, ScatteredBrdf):
        wi, wo = np.array(brdf.measurement.wi), np.array(brdf.measurement.wo)
    else:
        theta_i, theta_o, phi = (np.radians(one).ravel() for one in np.meshgrid(_POLAR, _POLAR, _AZIMUTH))
        wi, wo = spherical(theta_i, np.zeros_like(theta_i)), spherical(theta_o, phi)
    seen = _seen(wi, wo)
    return wi[seen], wo[seen]


def _seen(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    least = np.cos(_STEEPEST)
    return (aspecular(wi, wo) > np.radians(FLARE)) & (wi[:, 2] > least) & (wo[:, 2] > least)


def brdf_differences(brdf: Brdf, reference: np.ndarray, sample: np.ndarray, wi: np.ndarray) -> Float[np.ndarray, " N"]:
    """Measure ΔE94 of f_r (N,L)."""
    weights = observer(OBSERVER).weights(illuminant(LIGHT), brdf.wavelengths_nm).T
    seen = np.pi * wi[:, 2:]
    return delta_e_xyz(seen * reference @ weights, seen * sample @ weights, weights.sum(axis=0))


def measure(path: Path) -> dict[int, dict[str, Any]]:
    """Measure one file: figures by the number of angles, and `errors`, `expected` and `bound` of every pair."""
    brdf, spectral = truth(path)
    wi, wo = pairs(brdf)
    true = np.array(brdf.eval(wi, wo))
    sphere = sphere_protocol(_PIXELS, True, _FRONT)
    front = _seen(sphere.wi, sphere.wo)
    front_i, front_o = sphere.wi[front], sphere.wo[front]
    front_true = np.array(brdf.eval(front_i, front_o))
    out = {}
    for count, notations in ANGLES.items():
        readings = read_at(brdf, notations)
        start = time.process_time()
        found = reconstructed(readings, interference=None if spectral else 0.0)
        seconds = time.process_time() - start
        face = readings.values[notations.index("45as45")]
        errors = brdf_differences(brdf, true, found.eval(wi, wo), wi)
        mean, bound = (one[0] for one in expected_errors(readings, found, wi, wo, (LIGHT,)))
        again = brdf_differences(
            brdf, readings.values, found.eval(readings.wi, readings.wo), np.array([[0.0, 0.0, 1.0]])
        )
        forth, back = found.eval(wi, wo), found.eval(wo, wi)
        out[count] = {
            "lambert": float(brdf_differences(brdf, true, np.broadcast_to(face, true.shape), wi).mean()),
            "mean": float(errors.mean()),
            "p90": float(np.percentile(errors, 90)),
            "p95": float(np.percentile(errors, 95)),
            "p99": float(np.percentile(errors, 99)),
            "front": float(brdf_differences(brdf, front_true, found.eval(front_i, front_o), front_i).mean()),
            "reread mean": float(again.mean()),
            "reread max": float(again.max()),
            "q": found.interference,
            "albedo": float(found.scale * body_albedo(found).max()),
            "stated": float(mean.mean()),
            "bound mean": float(bound.mean()),
            "below": float((errors <= bound.mean()).mean()),
            "covered": float((errors <= bound).mean()),
            "rank": float(spearmanr(errors, mean).statistic),
            "least": float(forth.min()),
            "reciprocity": float(np.abs(forth - back).max() / forth.max()),
            "seconds": seconds,
            "errors": errors,
            "expected": mean,
            "bound": bound,
        }
    return out


def pooled(found: Mapping[str, Mapping[int, Mapping[str, Any]]], count: int) -> dict[str, float]:
    """Pool pairs of all files: the share below their bound, and the rank correlation of expected and true errors."""
    errors, expected, bound = (
        np.concatenate([one[count][name] for one in found.values()]) for name in ("errors", "expected", "bound")
    )
    return {"covered": float((errors <= bound).mean()), "rank": float(spearmanr(errors, expected).statistic)}


def data_files(folder: Path) -> list[Path]:
    """List the measured coatings below a folder of shared data."""
    return sorted([*(folder / "brdf" / "cornell-spectral").glob("*.brdf"), *(folder / "brdf" / "rgl").glob("*.bsdf")])


def main(arguments: list[str] | None = None) -> int:
    """Measure and print; 0."""
    parser = command(__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    chosen = parser.parse_args(arguments)
    folder = os.environ.get("METAMER_DATA")
    files = chosen.files or (data_files(Path(folder)) if folder else [])
    if not files:
        print("name files of measured BRDFs, or set METAMER_DATA to a folder with brdf/", file=sys.stderr)
        return 64
    columns = (
        "lambert",
        "mean",
        "p95",
        "p99",
        "front",
        "reread max",
        "q",
        "stated",
        "bound mean",
        "below",
        "covered",
        "rank",
    )
    print(f"{'material':26}{'angles':>7}" + "".join(f"{name:>11}" for name in columns) + f"{'CPU s':>8}")
    found = {}
    for file in files:
        found[file.stem] = measure(file)
        for count, row in found[file.stem].items():
            numbers = "".join(f"{row[name]:11.2f}" for name in columns)
            print(f"{file.stem[:25]:26}{count:7d}{numbers}{row['seconds']:8.3f}", flush=True)
    for count in ANGLES:
        figures = pooled(found, count)
        mean = float(np.mean([one[count]["mean"] for one in found.values()]))
        print(f"all, {count} angles: mean {mean:.2f}, covered {figures['covered']:.3f}, rank {figures['rank']:.2f}")
    write_json(chosen.json, {name: {n: _plain(row) for n, row in one.items()} for name, one in found.items()})
    return 0


def _plain(row: Mapping[str, Any]) -> dict[str, float]:
    return {name: value for name, value in row.items() if not isinstance(value, np.ndarray)}


if __name__ == "__main__":
    sys.exit(main())
