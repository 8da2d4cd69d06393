"""How far off factor packs are, what they cost to fit and to draw, and what the alternatives of the field cost.

One row a surface and light: packs fitted to a budget, beside the distribution-based BRDF, which was the baseline of
Schwenk 2010, and (on request) beside tensorly's decomposition of the paper's whole table. Errors are on the sphere
protocol, against the BRDF at every wavelength.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..calibration.basis_benchmark import stage
from ..calibration.factor_page import render_factor_page
from ..calibration.text_tables import TextTable, text_tables
from ..materials.brdf import Brdf
from ..materials.dbrdf import fit_distribution
from ..materials.factors import Axis, FactorPack
from ..materials.fit import Fit, fit
from ..materials.protocol import sphere_protocol
from ..materials.tabulated import tabulate
from ..spectral.basis import SpectralBasis
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from .factor_cases import chosen_cases
from .factor_figures import SCALE_DELTA_E, case_figures
from .factor_points import POINT_CASES, case_points
from .factor_sphere import brdf_xyz, pack_xyz, statistics, under
from .factor_timing import Stopwatch
from .headless import create_renderer
from .renderer import Renderer

LIGHTS = ("D65", "FL11")
# The paper's table and decomposition.
TABLE_AXES = (Axis("theta_i", 90, 0.5 * np.pi), Axis("theta_o", 90, 0.5 * np.pi), Axis("phi", 180, np.pi))
TABLE_COEFFICIENTS, TABLE_RANK, ITERATIONS = 8, 16, 25
# Terms that one texture of four channels holds: what the paper counts in.
TERMS_A_PACK = 4
Say = Callable[[str], None]


def run(
    cases: Sequence[str] | None = None,
    *,
    lights: Sequence[str] = LIGHTS,
    data: Path | None = None,
    pixels: int = 512,
    picture_pixels: int = 180,
    budget: float | None = None,
    ranks: tuple[int, ...] | None = None,
    baseline: bool = False,
    points: bool = True,
    renderer: Renderer | None = None,
    progress: Say = lambda line: None,
) -> dict:
    """Fit, judge and time every case.

    Parameters
    ----------
    cases : names from `factor_cases`; None takes all.
    data : folder of measured data; its cases join in.
    pixels : of the sphere protocol that errors are counted on.
    picture_pixels : across a sphere in the figures; 0 draws none.
    budget, ranks : in place of the case's own budget and the fit's own numbers of terms.
    baseline : also let tensorly decompose the paper's table, half a minute a case.
    points : also measure speed against error, one point a configuration.

    Returns
    -------
    dict : `rows`, `points`, `renderer`, `timing`, `protocol`, `dbrdf`, `tensorly` are ready for JSON; `figures` are
    pictures and curves for the page, by case.
    """
    chosen = chosen_cases(cases, data)
    owns = renderer is None
    renderer = create_renderer()[0] if renderer is None else renderer
    rows, figures, measured = [], [], []
    protocol = None
    try:
        stopwatch = Stopwatch(renderer)
        for number, case in enumerate(chosen, 1):
            progress(f"{number}/{len(chosen)} {case.name}: fitting")
            brdf = case.make()
            found, seconds, peak = _fitted(brdf, case.budget if budget is None else budget, ranks)
            milliseconds = stopwatch.milliseconds(found.packs)
            progress(f"{number}/{len(chosen)} {case.name}: {_words(found)} in {seconds:.1f} s; comparing")
            protocol = sphere_protocol(pixels, brdf.isotropic)
            distribution = fit_distribution(brdf)
            tensorly = _tensorly(brdf, progress, case.name) if baseline and brdf.isotropic else (None, None)
            reference, other = (brdf_xyz(it, protocol, lights) for it in (brdf, distribution))
            sample = pack_xyz(found.packs, protocol, lights)
            for index, light in enumerate(lights):
                lit = under(protocol, light)
                error = lit.compare(reference[index], sample[index])
                against = lit.compare(reference[index], other[index])
                rows.append(
                    {
                        "case": case.name,
                        "light": light,
                        "frames": [pack.frame for pack in found.packs],
                        "packs": texture_packs(found.packs),
                        "rank": found.rank,
                        "fit_seconds": seconds,
                        "table_bytes": table_bytes(found.packs),
                        "peak_bytes": peak,
                        "relative_error": found.error.relative_error,
                        "delta_e94": statistics(error),
                        "ms_per_megapixel": milliseconds,
                        "baseline": {
                            "tensorly_seconds": tensorly[0],
                            "tensorly_relative_error": tensorly[1],
                            "dbrdf_delta_e94": statistics(against),
                        },
                    }
                )
                progress(f"    {light}: ΔE94 p99 {error.p99:.2f}, D-BRDF {against.p99:.2f}")
            if picture_pixels:
                figures.append(case_figures(case, brdf, found.packs, distribution, lights, picture_pixels))
            if points and case.name in POINT_CASES:
                progress(f"{number}/{len(chosen)} {case.name}: speed against error")
                measured += case_points(case.name, brdf, (found, seconds), stopwatch, lights, progress)
    finally:
        if owns:
            renderer.close()
    return {
        "rows": rows,
        "points": measured,
        "renderer": renderer.name,
        "timing": Stopwatch.WORDS,
        "protocol": "" if protocol is None else protocol.text,
        "dbrdf": "Ashikhmin and Premoze 2007; every wavelength its own p(h) and R_0, least squares in L*",
        "tensorly": f"parafac, rank {TABLE_RANK}, {ITERATIONS} iterations, io table "
        f"{' x '.join(str(axis.size) for axis in TABLE_AXES)} x {TABLE_COEFFICIENTS}",
        "figures": figures,
    }


def losses(rows: Sequence[dict]) -> list[str]:
    """Rows in which the distribution-based BRDF is not worse in every statistic: there should be none."""
    return [
        f"{row['case']}, {row['light']}: {name}"
        for row in rows
        for name, value in row["delta_e94"].items()
        if row["baseline"]["dbrdf_delta_e94"][name] <= value
    ]


def texture_packs(packs: tuple[FactorPack, ...]) -> int:
    """Packs of four terms, as the paper counts."""
    return sum(-(-pack.rank // TERMS_A_PACK) for pack in packs)


def table_bytes(packs: tuple[FactorPack, ...]) -> int:
    """float64 bytes of the tables that were factored: nodes times the spectral dimensions that the terms span."""
    return sum(
        8 * int(np.prod([axis.size for axis in pack.axes])) * int(np.linalg.matrix_rank(pack.spectral, rtol=1e-9))
        for pack in packs
    )


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people."""
    header = ["case", "light", "frames", "packs", "rank", "fit s", "peak MB", "mean", "p95", "p99", "max", "ms/Mpx"]
    rows = []
    for row in measured["rows"]:
        error = row["delta_e94"]
        rows.append(
            [row["case"], row["light"], "+".join(row["frames"]), str(row["packs"]), str(row["rank"])]
            + [f"{row['fit_seconds']:.1f}", f"{row['peak_bytes'] / 1e6:.0f}"]
            + [f"{error[name]:.2f}" for name in ("mean", "p95", "p99", "max")]
            + [f"{row['ms_per_megapixel']:.0f}"]
        )
    found = [(f"Factor packs, ΔE94; pictures by {measured['renderer']}", header, rows)]
    rows = [
        [row["case"], row["light"]]
        + [f"{row['baseline']['dbrdf_delta_e94'][name]:.2f}" for name in ("mean", "p95", "p99", "max")]
        + ["-" if value is None else f"{value:.3g}" for value in list(row["baseline"].values())[:2]]
        for row in measured["rows"]
    ]
    header = ["case", "light", "mean", "p95", "p99", "max", "tensorly s", "its relative error"]
    found.append((f"Baselines: D-BRDF ({measured['dbrdf']}), ΔE94; tensorly ({measured['tensorly']})", header, rows))
    if measured["points"]:
        rows = [
            [point["case"], point["kind"], point["configuration"], f"{point['fit_seconds']:.1f}"]
            + [f"{point['ms_per_megapixel']:.0f}"]
            + [f"{value['p99']:.2f}" for value in point["delta_e94"].values()]
            for point in measured["points"]
        ]
        header = ["case", "kind", "configuration", "fit s", "ms/Mpx"]
        header += [f"p99 {light}" for light in measured["points"][0]["delta_e94"]]
        found.append(("Speed against error", header, rows))
    return found


def report(measured: dict) -> str:
    """The result of `run` as plain text."""
    return f"{text_tables(tables(measured))}\n\n{verdict(measured['rows'])}"


def page(measured: dict) -> str:
    """The result of `run` as one self-contained HTML page."""
    return render_factor_page(measured, SCALE_DELTA_E, verdict(measured["rows"]), "Factored spectral BRDFs")


def verdict(rows: Sequence[dict]) -> str:
    """Whether the baseline loses, as in the paper."""
    if worse := losses(rows):
        return "The D-BRDF is not worse in: " + "; ".join(worse)
    return "The D-BRDF is farther off in every row and by every statistic."


def document(measured: dict) -> dict:
    """The result of `run` without its pictures."""
    return {name: value for name, value in measured.items() if name != "figures"}


def _fitted(brdf: Brdf, budget: float, ranks: tuple[int, ...] | None) -> tuple[Fit, float, int]:
    """The fit, its seconds and the most bytes taken at one time: two runs, since counting bytes takes time."""
    options: dict[str, Any] = {} if ranks is None else {"ranks": ranks}
    tracemalloc.start()
    try:
        fit(brdf, budget=budget, **options)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    start = time.perf_counter()
    found = fit(brdf, budget=budget, **options)
    return found, time.perf_counter() - start, peak


def _tensorly(brdf: Brdf, progress: Say, name: str) -> tuple[float, float]:
    """Seconds and relative error of tensorly on the paper's table."""
    import tensorly
    from tensorly.decomposition import parafac

    progress(f"    {name}: tensorly, {ITERATIONS} iterations on the whole table")
    on = stage()
    basis = SpectralBasis.peercy(on.reflectances, on.columns, TABLE_COEFFICIENTS)
    resample = interpolation_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    table = tabulate(brdf, "io", TABLE_AXES, resample.T @ basis.analysis).values
    start = time.perf_counter()
    found = parafac(table, TABLE_RANK, n_iter_max=ITERATIONS, init="random", random_state=0, tol=0)
    seconds = time.perf_counter() - start
    left = np.linalg.norm(tensorly.cp_to_tensor(found) - table)
    return seconds, float(left / np.linalg.norm(table))


def _words(found: Fit) -> str:
    frames = " + ".join(f"{pack.rank} {pack.frame}" for pack in found.packs)
    return f"{frames} terms"
