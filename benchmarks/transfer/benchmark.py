"""Interreflection by every method, scene and number of bounces: seconds, bytes, milliseconds and errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fnmatch import fnmatchcase
from itertools import groupby
from pathlib import Path

from ...calibration.report.text_tables import columns
from ...runtime.errors import InputError
from ..papers.transfer_tensors.brdf_tensor import BrdfTensor
from ..papers.transfer_tensors.components import Components
from . import draped_btf, growth, path_tracing, spectral
from .bars import bars
from .ours import OurMethod, TracedGeometry
from .pixels import Truths, figures_of, pixel_differences
from .scenes import TransferScene, scenes
from .tensors import TensorMethod, shared_by_all
from .whole_pictures import drawn_row

Progress = Callable[[str], None]
#: Rays of a site of the paper's way, texels of a face of its visibility, as the paper has 64, and bytes that tensors
#: may take before they are compressed: of a quick and of a full run.
QUICK, FULL = (64, 16, 5e8), (256, 64, 2e9)
#: Bounces of the paper's pictures: it stops after two.
BOUNCES = (0, 1, 2)
#: Rays of a site by our way, in a quick and in a full run, and the longest edge between sites of a quick one; bounces,
#: of which None is until nothing is left.
OUR_RAYS, QUICK_EDGE, OUR_BOUNCES = ((64,), (256, 1024)), 0.16, (0, 1, 2, None)
#: Changes, one at a time and all together.
RELIT = ("view", "material", "matt", "light", "all")
#: Figures of the paper for its own scenes: vertices, megabytes, hours before the first picture, and milliseconds of
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
    full : more scenes, lights, rays and sites, the 2004 paper's way (`draped_btf`), the price of the spectrum
    (`spectral`), growth (`growth`) and Mitsuba (`path_tracing`). data : a folder with meshes/, or None. case : only
    scenes whose names fit, `*` and `?` for anything; those of the full run too.

    Returns
    -------
    dict : `rows`, for JSON. A row has `scene`, `vertices` (that something may be seen from), `regions`, `method`
    ("paper", "ours", "paper-2004" or "mitsuba"), `at` ("pixels" or "sites"; "renderer": whole pictures, see `drawn`;
    "wavelengths" beside the same with 81 samples), `rays`, `bounces` ("all": until nothing is left),
    `precompute_cpu_seconds`, `bytes`, `relight_ms` (`view`, `material`, `light`, `all`; ours also `matt`; nothing of
    whole pictures), `light`, `delta_e94` (`mean`, `p95`, `p99`, against paths of as many
    bounces) and `reference_noise` (ΔE94); ours also `coefficients`, `delta_e94_between` (what is linear between sites
    beside what is traced there, of light that has met one surface, anywhere on it), and at sites `delta_e94_matt` and
    `delta_e94_glossy` of what receives the light. Direct light at pixels is the paper's own in its rows, and the
    paths' in ours (see `ours`).

    Raises
    ------
    InputError : no scene is called so.
    """
    there = scenes(full or case is not None, data)
    chosen = [one for one in there if case is None or fnmatchcase(one.name, case)]
    extra = [make for name, make in EXTRA.items() if (full if case is None else fnmatchcase(name, case))]
    if not chosen and not extra:
        names = ", ".join([*dict.fromkeys(s.name for s in there), *EXTRA])
        raise InputError("no scene is called so", field="--case", found=case, expected=names)
    rows: list[dict] = [row for make in extra for row in make(progress)]
    if not chosen:
        return {"rows": rows}
    progress("a family of highlights as a tensor")
    shared = shared_by_all()
    for _, same in groupby(chosen, key=lambda one: one.name):
        rows += _of_scene([*same], shared, full, progress)
    return {"rows": rows}


#: Cases beside scenes, by their name for `--case`.
EXTRA: dict[str, Callable[[Progress], list[dict]]] = {
    draped_btf.NAME: draped_btf.draped_rows,
    spectral.NAME: spectral.coefficient_rows,
    growth.NAME: growth.growth_rows,
    path_tracing.NAME: path_tracing.path_rows,
}


def _of_scene(
    lit: list[TransferScene], shared: tuple[BrdfTensor, Components], full: bool, progress: Progress
) -> Iterator[dict]:
    """One scene under each of its lights, which no precomputation knows."""
    truths = [Truths(case, progress) for case in lit]
    tensors = TensorMethod.of(lit[0], shared, *(FULL if full else QUICK), progress)
    for truth in truths:
        yield from _of_tensors(replace(tensors, case=truth.case), truth)
    for rays in OUR_RAYS[full]:
        geometry = TracedGeometry.of(lit[0], rays, lit[0].longest_edge if full else QUICK_EDGE, progress)
        for truth in truths:
            progress(f"{truth.case.name}, {truth.case.light}: {rays} rays, relit")
            yield from OurMethod.of(truth.case, geometry).rows(OUR_BOUNCES, truth)
    yield from map(drawn_row, truths)


def _of_tensors(method: TensorMethod, truths: Truths) -> Iterator[dict]:
    case, seen = method.case, method.seen
    relight, arriving = method.relight_ms(), method.arriving()
    for bounces in BOUNCES:
        truth = truths.picture(bounces)
        off = pixel_differences(case, truth, seen, seen.picture(method.xyz(arriving, bounces)))
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
            "delta_e94": figures_of(off),
            "reference_noise": None if truth.noise is None else float(max(truth.noise.mean)),
        }


def report(figures: dict) -> str:
    """Return the figures as a table, and what the paper says of its own."""
    body = []
    for one in figures["rows"]:
        relight, off, noise = one["relight_ms"], one["delta_e94"] or {}, one["reference_noise"]
        counts = [f"{one['vertices']:,}", *(str(one[name]) for name in ("regions", "rays", "bounces"))]
        body.append(
            [
                one["scene"], one["light"], one["method"], one["at"], *counts,
                f"{one['precompute_cpu_seconds']:.0f}", f"{one['bytes'] / 1e6:.0f}",
                *(f"{relight[name]:.0f}" if name in relight else "-" for name in RELIT),
                *(f"{off[name]:.2f}" if name in off else "-" for name in ("mean", "p95", "p99")),
                "-" if noise is None else f"{noise:.2f}",
            ]
        )  # fmt: skip
    headings = ["scene", "light", "method", "at", "sites", "regions", "rays", "bounces", "CPU s", "MB"]
    headings += [*RELIT[:-1], "all ms", "mean", "p95", "p99", "noise"]
    title = "ΔE94 against paths of as many bounces at every wavelength; ours at pixels with the paths' own direct light"
    of_paper = [
        [name, f"{vertices:,}", f"{megabytes}", f"{hours:g}", f"{view}", f"{material}", f"{light}"]
        for name, vertices, megabytes, hours, view, material, light in PAPER
    ]
    words = ["scene", "vertices", "MB", "hours", "view", "and material", "and light ms"]
    said = f"Sun et al. 2007, table 1 (no errors are given)\n{columns(words, of_paper, left=1)}"
    found = bars(figures["rows"])
    held = f"\n\nBars, as far as they were measured\n{columns(['bar', 'at most', 'measured', 'of'], found, left=1)}"
    return f"{title}\n{columns(headings, body, left=4)}\n\n{said}{held if found else ''}"
