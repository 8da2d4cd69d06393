"""Interreflection by every method, scene and number of bounces: seconds, bytes, milliseconds and errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from ...calibration.text_tables import columns
from ...spectral.errors import InputError
from . import clothed
from .ours import OurMethod
from .pixels import difference, seen_sites, truth_of
from .scenes import TransferScene, scenes
from .tensors import TensorMethod, shared_by_all

Progress = Callable[[str], None]
#: Rays of a site, texels of a face of its visibility and the longest edge between sites, in radii of the scene: of a
#: quick and of a full run. The paper has 64 texels, and some 100 to 1000 vertices a region.
QUICK, FULL = (64, 16, 0.16), (256, 64, 0.06)
#: Bounces of the paper's pictures: it stops after two.
BOUNCES = (0, 1, 2)
#: Rays of a site by our way, in a quick and in a full run; bounces, of which None is until nothing is left.
OUR_RAYS, OUR_BOUNCES = ((64,), (256, 1024)), (0, 1, 2, None)
#: What the paper says of its own scenes: vertices, megabytes, hours before the first picture, and milliseconds of
#: another view, another material too, and another light too, on a GPU of 2007.
PAPER = (
    ("Tweety", 13_000, 148, 6.6, 8, 35, 172),
    ("Airplane", 13_100, 144, 8.9, 7, 32, 169),
    ("Indoor", 35_700, 311, 19.3, 13, 80, 294),
    ("Venus", 39_700, 389, 12.3, 18, 91, 382),
    ("Chess", 53_900, 539, 24.2, 21, 122, 599),
    ("Watch", 62_100, 603, 30.0, 23, 138, 654),
)


def run(
    full: bool = False,
    data: Path | None = None,
    progress: Progress = lambda line: None,
    case: str | None = None,
) -> dict:
    """Measure all there is.

    Parameters
    ----------
    full : more scenes, lights, rays and sites, and the 2004 paper's way (`clothed`). data : a folder with meshes/, or
    None. case : only scenes whose names fit, `*` and `?` for anything; those of the full run too.

    Returns
    -------
    dict : `rows`, for JSON. A row has `scene`, `vertices` (that something may be seen from), `regions`, `method`
    ("paper", "ours" or "paper-2004"), `at` ("pixels" or "sites"), `rays`, `bounces` ("all": until nothing is left),
    `precompute_cpu_seconds`, `bytes`, `relight_ms` (`view`, `material`, `light`, `all`), `light`, `delta_e94` (`mean`,
    `p95`, `p99`, against paths of as many bounces) and `reference_noise` (ΔE94); ours also `coefficients`. Direct
    light at pixels is the paper's own in its rows, and the paths' in ours (see `ours`).

    Raises
    ------
    InputError : no scene is called so.
    """
    there = scenes(full or case is not None, data)
    chosen = [one for one in there if case is None or fnmatchcase(one.name, case)]
    with_btf = fnmatchcase(clothed.NAME, case) if case is not None else full
    if not chosen and not with_btf:
        names = ", ".join([*dict.fromkeys(s.name for s in there), clothed.NAME])
        raise InputError("no scene is called so", field="--case", found=case, expected=names)
    rows: list[dict] = clothed.rows(progress) if with_btf else []
    if not chosen:
        return {"rows": rows}
    progress("a family of highlights as a tensor")
    shared = shared_by_all()
    for one in chosen:
        rows += _of_tensors(one, TensorMethod.of(one, shared, *(FULL if full else QUICK), progress), full, progress)
        for rays in OUR_RAYS[full]:
            ours = OurMethod.of(one, rays, (FULL if full else QUICK)[2], progress)
            rows += ours.rows(OUR_BOUNCES, progress)
    return {"rows": rows}


def _of_tensors(case: TransferScene, method: TensorMethod, full: bool, progress: Progress) -> Iterator[dict]:
    seen = seen_sites(case.scene, method.hits, (FULL if full else QUICK)[2])
    relight, arriving = method.relight_ms(), method.arriving()
    for bounces in BOUNCES:
        truth = truth_of(case, bounces, progress)
        off = difference(case, truth, seen, method.xyz(arriving, bounces))
        noise = truth.noise
        yield {
            "scene": case.name,
            "vertices": len(method.hits.sites),
            "regions": len(case.scene.parts),
            "method": "paper",
            "at": "pixels",
            "rays": method.hits.rays,
            "bounces": bounces,
            "precompute_cpu_seconds": method.precompute_cpu_seconds,
            "bytes": method.transfer.nbytes,
            "relight_ms": relight,
            "light": case.light,
            "delta_e94": dict(zip(("mean", "p95", "p99"), _figures(off), strict=True)),
            "reference_noise": None if noise is None else float(max(noise.mean)),
        }


def _figures(off: np.ndarray) -> tuple[float, float, float]:
    p95, p99 = np.percentile(off, (95.0, 99.0))
    return float(off.mean()), float(p95), float(p99)


def report(figures: dict) -> str:
    """The figures as a table, and what the paper says of its own."""
    body = []
    for one in figures["rows"]:
        relight, off, noise = one["relight_ms"], one["delta_e94"], one["reference_noise"]
        counts = [f"{one['vertices']:,}", *(str(one[name]) for name in ("regions", "rays", "bounces"))]
        body.append(
            [
                one["scene"], one["light"], one["method"], one["at"], *counts,
                f"{one['precompute_cpu_seconds']:.0f}", f"{one['bytes'] / 1e6:.0f}",
                *(f"{relight[name]:.0f}" for name in ("view", "material", "light", "all")),
                *(f"{off[name]:.2f}" for name in ("mean", "p95", "p99")), "-" if noise is None else f"{noise:.2f}",
            ]
        )  # fmt: skip
    headings = ["scene", "light", "method", "at", "sites", "regions", "rays", "bounces", "CPU s", "MB"]
    headings += ["view", "material", "light"]
    headings += ["all ms", "mean", "p95", "p99", "noise"]
    title = "ΔE94 against paths of as many bounces at every wavelength; ours with the paths' own direct light"
    of_paper = [
        [name, f"{vertices:,}", f"{megabytes}", f"{hours:g}", f"{view}", f"{material}", f"{light}"]
        for name, vertices, megabytes, hours, view, material, light in PAPER
    ]
    words = ["scene", "vertices", "MB", "hours", "view", "and material", "and light ms"]
    said = f"Sun et al. 2007, table 1 (no errors are given)\n{columns(words, of_paper, left=1)}"
    return f"{title}\n{columns(headings, body, left=4)}\n\n{said}"
