"""The page of the factorisation benchmark: pictures, maps, curves and plots, all inside one file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import plots
from .page import html_environment

# Radius and margin of a polar plot, size of a scatter plot, SVG units.
_POLAR = 130.0
_SCATTER = (460.0, 300.0)
# Points nearer than this, across and down, share a label.
_NEAR = (26.0, 7.0)
# Shape and place in the legend say what kind a point is; colour says it again.
KINDS = ("spectra", "ranks", "frames", "precision")


def render_factor_page(measured: dict[str, Any], scale_delta_e: float, verdict: str, title: str) -> str:
    """One self-contained HTML page.

    Parameters
    ----------
    measured : `rows`, `points`, `figures` and the words beside them, as the benchmark returns them.
    scale_delta_e : a third of the maps' scale.
    verdict : a sentence on the baseline.
    """
    environment = html_environment()
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
        kinds=KINDS,
        polar_radius=_POLAR,
        scatter_size=_SCATTER,
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
    """For every surface: its configurations, numbered, and for every light ΔE94 p99 against what it costs."""
    across = (("ms_per_megapixel", "ms a megapixel"), ("fit_seconds", "seconds to fit"))
    found = []
    for case in dict.fromkeys(point["case"] for point in points):
        own = [point for point in points if point["case"] == case]
        lights = list(own[0]["delta_e94"])
        plots_of_case = [
            {"light": light, "label": label, **_scatter(own, light, key)} for light in lights for key, label in across
        ]
        found.append({"case": case, "lights": lights, "points": own, "plots": plots_of_case})
    return found


def _scatter(points: Sequence[dict[str, Any]], light: str, key: str) -> dict[str, Any]:
    width, height = _SCATTER
    x = np.log10([max(point[key], 1e-6) for point in points])
    y = np.log10([max(point["delta_e94"][light]["p99"], 1e-3) for point in points])
    x0, x1 = _below(x.min()), _above(x.max())
    y0, y1 = math.floor(y.min()), math.ceil(y.max() + 1e-9)
    places = np.stack([width * (x - x0) / (x1 - x0), height * (y1 - y) / max(y1 - y0, 1)], axis=-1)
    marks = [
        {"x": across, "y": down, "kind": point["kind"], "name": point["configuration"]}
        for point, (across, down) in zip(points, places.tolist(), strict=True)
    ]
    return {
        "marks": marks,
        "labels": _labels(places),
        "x_ticks": [(width * (tick - x0) / (x1 - x0), f"{10**tick:g}") for tick in _ticks(x0, x1)],
        "y_ticks": [(height * (y1 - tick) / max(y1 - y0, 1), f"{10.0**tick:g}") for tick in range(y0, y1 + 1)],
    }


def _labels(places: np.ndarray) -> list[dict[str, Any]]:
    """The numbers of the points, those that (nearly) coincide together: text and where it stands."""
    groups: list[list[int]] = []
    for index, place in enumerate(places):
        near = next((g for g in groups if np.all(np.abs(places[g[-1]] - place) < _NEAR)), None)
        groups.append([index]) if near is None else near.append(index)
    found = []
    for group in groups:
        across, down = places[group, 0].max(), places[group, 1].mean()
        left = across > 0.8 * _SCATTER[0]
        # Runs as "3-6": points in one place tend to be neighbours in the list.
        text = ", ".join(_runs([index + 1 for index in group]))
        where = {
            "x": places[group, 0].min() - 8.0 if left else across + 8.0,
            "y": down + 3.5,
            "anchor": "end" if left else "start",
        }
        found.append({"text": text, **where})
    return found


def _runs(numbers: list[int]) -> list[str]:
    """Ascending whole numbers with three or more in a row written as a range.

    >>> _runs([1, 2, 4, 5, 6, 9])
    ['1', '2', '4–6', '9']
    """
    words: list[str] = []
    start = 0
    for end in range(1, len(numbers) + 1):
        if end == len(numbers) or numbers[end] != numbers[end - 1] + 1:
            run = numbers[start:end]
            words += [f"{run[0]}–{run[-1]}"] if len(run) > 2 else map(str, run)
            start = end
    return words


def _ticks(low: float, high: float) -> list[float]:
    decades = [math.log10(base * 10.0**power) for power in range(-6, 7) for base in (1, 2, 5)]
    return [tick for tick in decades if low - 1e-9 <= tick <= high + 1e-9]


def _below(value: float) -> float:
    return max(tick for tick in _ticks(-6.0, 6.0) if tick <= value - 0.02)


def _above(value: float) -> float:
    return min(tick for tick in _ticks(-6.0, 6.0) if tick >= value + 0.02)


def _round_step(top: float) -> float:
    """A round number of which one to four fit into `top`."""
    power = 10.0 ** math.floor(math.log10(top))
    return next(power * base for base in (0.25, 0.5, 1.0, 2.0, 5.0) if top / (power * base) <= 4.0)


def _polar_path(angles: np.ndarray, radii: np.ndarray) -> str:
    """Angles from the normal, positive to the right; clipped to a little over the circle."""
    radii = np.minimum(radii, 1.15) * _POLAR
    words = [f"{r * math.sin(a):.1f} {-r * math.cos(a):.1f}" for a, r in zip(angles, radii, strict=True)]
    return "M" + "L".join(words)
