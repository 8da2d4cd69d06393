"""The page of the factorisation benchmark: pictures, maps, curves and plots, all inside one file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...calibration.report import plots
from ...calibration.report.line_plots import MARKS, SIZE, LogScale, line_plot, merged_labels
from ...calibration.report.page import html_environment

_TEMPLATES = Path(__file__).with_name("templates")
# Radius of a polar plot, SVG units.
_POLAR = 130.0
#: Kinds of configurations that points stand for, told by colour and mark; points of the last kind have no number.
KINDS = ("spectra", "ranks", "frames", "precision", "filtering", "paper")
_UNNUMBERED = "paper"


def render_factor_page(measured: dict[str, Any], scale_delta_e: float, verdict: str, title: str) -> str:
    """One self-contained HTML page.

    Parameters
    ----------
    measured : `rows`, `points`, `figures` and the words beside them, as the benchmark returns them.
    scale_delta_e : a third of the maps' scale.
    verdict : a sentence on the baseline.
    """
    environment = html_environment(_TEMPLATES)
    cards = [
        {
            **figure,
            "rows": [row for row in measured["rows"] if row["case"] == figure["case"]],
            "polars": polar_plots(figure["polar"]),
        }
        for figure in measured["figures"]
    ]
    return environment.get_template("factor.html").render(
        title=title,
        verdict=verdict,
        measured=measured,
        cards=cards,
        scatters=scatter_plots(measured["points"]),
        growths=growth_plots(measured["growth"]),
        methods=method_plots(measured["points"], measured["packs_needed"]),
        ways=list(dict.fromkeys(way for row in measured["packs_needed"] for way in row["needed"])),
        surfaces=two_surface_plot(measured["fluorescence"].get("two_surfaces", [])),
        kinds=KINDS,
        marks={kind: _mark(kind) for kind in KINDS},
        line_marks=MARKS,
        polar_radius=_POLAR,
        size=SIZE,
        scale=plots.scale_words(scale_delta_e),
    )


def polar_plots(polar: dict[str, Any]) -> list[dict[str, Any]]:
    """One half circle an incidence: paths of each curve, and where the light comes from (the right)."""
    angles = np.radians(polar["angles_deg"])
    found = []
    for number, incidence in enumerate(polar["incidence_deg"]):
        curves = {name: np.asarray(radii[number]) for name, radii in polar["radii"].items()}
        top = max(float(np.max(curves["reference"])), 1e-6)
        step = _round_step(top)
        found.append(
            {
                "incidence": incidence,
                "light": (_POLAR * math.sin(math.radians(incidence)), -_POLAR * math.cos(math.radians(incidence))),
                "paths": {name: _polar_path(angles, radii / top) for name, radii in curves.items()},
                "rings": [(_POLAR * at / top, f"{at:g}") for at in np.arange(step, top * 1.001, step)],
            }
        )
    return found


def scatter_plots(points: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Plot for every surface its configurations, numbered, and for every light ΔE94 p99 against what it costs."""
    across = (("ms_per_megapixel", "milliseconds a megapixel"), ("fit_seconds", "seconds to fit"))
    found = []
    for case in dict.fromkeys(point["case"] for point in points):
        own = [point for point in points if point["case"] == case]
        # Numbers first, so that they are those of the table.
        own.sort(key=lambda point: point["kind"] == _UNNUMBERED)
        lights = [light for light in own[0]["delta_e94"] if all(light in point["delta_e94"] for point in own)]
        costs = [cost for cost in across if all(point[cost[0]] is not None for point in own)]
        plots_of_case = [{"light": light, **_scatter(own, light, *cost)} for light in lights for cost in costs]
        numbered = [point for point in own if point["kind"] != _UNNUMBERED]
        kinds = list(dict.fromkeys(point["kind"] for point in own))
        found.append({"case": case, "lights": lights, "points": numbered, "kinds": kinds, "plots": plots_of_case})
    return found


def growth_plots(growth: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Seconds and bytes of a decomposition against nodes of its table, then against its rank."""
    found = []
    for over, key, label in (("resolution", "nodes", "nodes of the table"), ("rank", "rank", "terms")):
        rows = [row for row in growth if row["over"] == over]
        if not rows:
            continue
        seconds = {"decomposition": [(row[key], row["seconds"]) for row in rows]}
        megabytes = {
            "at most held": [(row[key], row["peak_bytes"] / 1e6) for row in rows],
            "the table": [(row[key], row["table_bytes"] / 1e6) for row in rows],
        }
        errors = {"relative error": [(row[key], row["relative_error"]) for row in rows]}
        found.append(
            {
                "over": over,
                "plots": [
                    line_plot(seconds, label, "seconds"),
                    line_plot(megabytes, label, "MB"),
                    line_plot(errors, label, "relative error"),
                ],
            }
        )
    return found


def method_plots(points: Sequence[dict[str, Any]], needed: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Plot for every surface that the paper's methods were tried on ΔE94 p99 against packs, ours beside them."""
    found = []
    for case in dict.fromkeys(row["case"] for row in needed):
        rows = [row for row in needed if row["case"] == case]
        shown = []
        for row in rows:
            series = {"here": [(row["ours"], row["p99"])]}
            for point in points:
                if point["case"] == case and point["kind"] == _UNNUMBERED:
                    line = series.setdefault(f"{point['frame']}, {point['method']}", [])
                    line.append((point["packs"], point["delta_e94"][row["light"]]["p99"]))
            shown.append({"light": row["light"], **line_plot(series, "packs of four terms", "ΔE94 p99")})
        found.append({"case": case, "plots": shown})
    return found


def two_surface_plot(rows: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """Worst ΔE94 over two surfaces against the number of coefficients; None without figures."""
    if not rows:
        return None
    names = {"max": "balanced", "max_fluorescent": "balanced, one surface fluorescent", "peercy_max": "Peercy"}
    series = {name: [(row["J"], row[key]) for row in rows] for key, name in names.items()}
    return line_plot(series, "J", "largest ΔE94")


def _scatter(points: Sequence[dict[str, Any]], light: str, key: str, label: str) -> dict[str, Any]:
    errors = [point["delta_e94"][light]["p99"] for point in points]
    x = LogScale([point[key] for point in points], SIZE[0], floor=1e-5)
    y = LogScale(errors, SIZE[1], downwards=True, floor=1e-3)
    places = [(x.at(point[key]), y.at(error)) for point, error in zip(points, errors, strict=True)]
    marks = [
        {"x": across, "y": down, "kind": point["kind"], "name": point["configuration"], "path": _mark(point["kind"])}
        for point, (across, down) in zip(points, places, strict=True)
    ]
    numbered = [place for place, point in zip(places, points, strict=True) if point["kind"] != _UNNUMBERED]
    return {
        # Numbered points are drawn last, above the others.
        "marks": marks[::-1],
        "labels": merged_labels(numbered, range(1, len(numbered) + 1)),
        "x_ticks": x.ticks(),
        "y_ticks": y.ticks(),
        "x_label": label,
    }


def _mark(kind: str) -> str:
    return MARKS[KINDS.index(kind) % len(MARKS)] if kind in KINDS else MARKS[0]


def _round_step(top: float) -> float:
    """Return a round number of which one to four fit into `top`."""
    power = 10.0 ** math.floor(math.log10(top))
    return next(power * base for base in (0.25, 0.5, 1.0, 2.0, 5.0) if top / (power * base) <= 4.0)


def _polar_path(angles: np.ndarray, radii: np.ndarray) -> str:
    """Angles from the normal, positive to the right; clipped to a little over the circle."""
    radii = np.minimum(radii, 1.15) * _POLAR
    words = [f"{r * math.sin(a):.1f} {-r * math.cos(a):.1f}" for a, r in zip(angles, radii, strict=True)]
    return "M" + "L".join(words)
