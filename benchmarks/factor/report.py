"""Results of the benchmark of factorisation, for people and for machines: text, one page, JSON."""

from __future__ import annotations

from collections.abc import Sequence

from ...calibration.report.text_tables import TextTable, text_tables
from .figures import SCALE_DELTA_E
from .fluorescence import WITHOUT
from .page import render_factor_page

_STATISTICS = ("mean", "p95", "p99", "max")


def losses(rows: Sequence[dict]) -> list[str]:
    """Rows in which the distribution-based BRDF is not worse in every statistic: there should be none."""
    return [
        f"{row['case']}, {row['light']}: {name}"
        for row in rows
        if row["baseline"]["dbrdf_delta_e94"] is not None
        for name, value in row["delta_e94"].items()
        if row["baseline"]["dbrdf_delta_e94"][name] <= value
    ]


def baseline_loses(rows: Sequence[dict]) -> str:
    """Return whether the baseline loses, as in the paper."""
    if worse := losses(rows):
        return "The D-BRDF is not worse in: " + "; ".join(worse)
    if not any(row["baseline"]["dbrdf_delta_e94"] for row in rows):
        return "No row has a D-BRDF beside it: fluorescent surfaces only."
    return "The D-BRDF is farther off in every row and by every statistic."


def report(measured: dict) -> str:
    """Return the result of `run` as plain text."""
    return f"{text_tables(tables(measured))}\n\n{baseline_loses(measured['rows'])}"


def page(measured: dict) -> str:
    """Return the result of `run` as one self-contained HTML page."""
    return render_factor_page(measured, SCALE_DELTA_E, baseline_loses(measured["rows"]), "Factored spectral BRDFs")


def result_document(measured: dict) -> dict:
    """Return the result of `run` without its pictures."""
    return {name: value for name, value in measured.items() if name != "figures"}


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people; what was not measured has no table."""
    made = (_packs, _baselines, _speed, _parts, _without, _two_surfaces, _growth, _needed, _points)
    return [table for make in made if (table := make(measured))[2]]


def _figure(value: float | int | None, form: str = ".2f") -> str:
    return "-" if value is None else format(value, form)


def _errors(found: dict | None) -> list[str]:
    return [_figure(None if found is None else found[name]) for name in _STATISTICS]


def _packs(measured: dict) -> TextTable:
    header = ["case", "light", "frames", "packs", "rank", "fit s", "table MB", "peak MB", *_STATISTICS, "ms/Mpx"]
    rows = [
        [
            *(row["case"], row["light"], "+".join(row["frames"]), str(row["packs"]), str(row["rank"])),
            *(f"{row['fit_seconds']:.1f}", f"{row['table_bytes'] / 1e6:.1f}", f"{row['peak_bytes'] / 1e6:.1f}"),
            *_errors(row["delta_e94"]),
            f"{row['ms_per_megapixel']:.0f}",
        ]
        for row in measured["rows"]
    ]
    return f"Factor packs, ΔE94; pictures by {measured['renderer']}", header, rows


def _baselines(measured: dict) -> TextTable:
    rows = [
        [row["case"], row["light"], *_errors(row["baseline"]["dbrdf_delta_e94"])]
        for row in measured["rows"]
        if row["baseline"]["dbrdf_delta_e94"] is not None
    ]
    return f"Baseline: D-BRDF ({measured['dbrdf']}), ΔE94", ["case", "light", *_STATISTICS], rows


def _speed(measured: dict) -> TextTable:
    header = ["case", "tensorly s", "its error", "ours s", "our error", "times faster", "errors, ours / its", "peak MB"]
    rows = [
        [
            *(row["case"], f"{row['tensorly_seconds']:.1f}", f"{row['tensorly_relative_error']:.2e}"),
            *(f"{row['seconds']:.2f}", f"{row['relative_error']:.2e}", f"{row['times_faster']:.0f}"),
            *(f"{row['error_ratio']:.2g}", f"{row['peak_bytes'] / 1e6:.0f}"),
        ]
        for row in measured["speed"]
    ]
    return f"The same table decomposed by tensorly ({measured['tensorly']}) and here", header, rows


def _parts(measured: dict) -> TextTable:
    header = ["case", "part", "tensorly ms", "its error", "ours ms", "our error", "times faster"]
    rows = [
        [
            *(row["case"], part["part"], f"{1e3 * part['tensorly_seconds']:.3g}"),
            *(_figure(part["tensorly_relative_error"], ".2e"), f"{1e3 * part['seconds']:.3g}"),
            *(_figure(part["relative_error"], ".2e"), f"{part['times_faster']:.1f}"),
        ]
        for row in measured["speed"]
        for part in row["parts"]
    ]
    return "Parts of that decomposition, by tensorly and here; -: the same numbers", header, rows


def _without(measured: dict) -> TextTable:
    rows = [
        [row["case"], row["light"], *(_figure(found["p99"]) for found in row["delta_e94"].values())]
        for row in measured["fluorescence"].get("without", [])
    ]
    title = f"Fluorescent surfaces drawn, ΔE94 p99 against the full matrix; {measured['fluorescence'].get('lights')}"
    return title, ["case", "light", "packs", *WITHOUT.values()], rows


def _two_surfaces(measured: dict) -> TextTable:
    rows = [
        [str(row["J"]), *(f"{row[key]:.3f}" for key in ("mean", "max", "max_fluorescent", "peercy_max"))]
        for row in measured["fluorescence"].get("two_surfaces", [])
    ]
    title = "Fluorescence over two surfaces in J coefficients of radiance (J x J matrices), ΔE94"
    return title, ["J", "mean", "max", "max with fluorescence", "Peercy, max"], rows


def _growth(measured: dict) -> TextTable:
    rows = [
        [
            *(row["over"], " x ".join(map(str, row["shape"])), str(row["rank"]), f"{row['seconds']:.2f}"),
            *(f"{row['table_bytes'] / 1e6:.1f}", f"{row['peak_bytes'] / 1e6:.1f}", f"{row['relative_error']:.1e}"),
        ]
        for row in measured["growth"]
    ]
    header = ["over", "table", "rank", "s", "table MB", "peak MB", "relative error"]
    return "Growth of a decomposition", header, rows


def _needed(measured: dict) -> TextTable:
    ways = list(dict.fromkeys(way for row in measured["packs_needed"] for way in row["needed"]))
    rows = [
        [row["case"], row["light"], f"{row['p99']:.2f}", str(row["ours"]), _figure(row["paper_2010"], "d")]
        + [_figure(row["needed"].get(way), "d") for way in ways]
        for row in measured["packs_needed"]
    ]
    title = "Packs of four terms for the same p99, by the paper's methods; -: not with as many as were tried"
    return title, ["case", "light", "p99", "ours", "2010", *ways], rows


def _points(measured: dict) -> TextTable:
    points = measured["points"]
    lights = list(dict.fromkeys(light for point in points for light in point["delta_e94"]))
    rows = [
        [point["case"], point["kind"], point["configuration"], _figure(point["fit_seconds"], ".1f")]
        + [f"{point['ms_per_megapixel']:.0f}"]
        + [_figure(point["delta_e94"][light]["p99"] if light in point["delta_e94"] else None) for light in lights]
        for point in points
    ]
    header = ["case", "kind", "configuration", "fit s", "ms/Mpx", *(f"p99 {light}" for light in lights)]
    return "Speed against error", header, rows
