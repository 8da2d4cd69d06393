"""Every case by every method: how far off, how long, beside how far off the truth itself may be."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

import numpy as np

from ...calibration.report.text_tables import columns
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import DeltaLight
from ...runtime.errors import InputError
from . import cases, measured, meshes, minified, rendering, spectrum_cost
from .catalogued import SKY, catalogued

Progress = Callable[[str], None]


def run(
    full: bool = False,
    data: Path | None = None,
    progress: Progress = lambda line: None,
    pattern: str | None = None,
    catalogue: Path | None = None,
) -> dict:
    """Measure all there is.

    Parameters
    ----------
    full : more lights, lobes and points, meshes of many triangles, fits. data : a folder with light/, meshes/, maps/
        and brdf/, or None. catalogue : the folder of one, whose materials are measured, or None.
    pattern : only cases whose names fit, `*` and `?` for anything; those of the full run too.

    Returns
    -------
    dict : `rows`, for JSON; `missing`, lights and meshes whose files are not there; `notes`, lines for people. A row
    has `case`, `method`, `light`, `lobes`, `delta_e94` (`mean`, `p95`, `p99` over the points, against the truth),
    `reference_noise` (mean ΔE94 by which that is off: a third of the difference to the truth from texels twice as
    wide; 0 where it is exact), `cpu_seconds_per_1000_vertices` and `bytes_per_vertex` (of visibility, None where the
    case needs none or it is closed) and `ms_per_megapixel` (on one core, in numpy but for `spectrum_cost`, without what
    is made once a light).

    Raises
    ------
    InputError : no case fits the pattern.
    """

    def wanted(name: str) -> bool:
        return pattern is None or fnmatchcase(name, pattern)

    long = full or pattern is not None
    chosen = [one for one in cases.svbrdf_cases(long) if wanted(one.name)]
    rows = list(rendering.method_rows(chosen, full, data, progress))
    rows += minified.minified(data, wanted, progress)
    rows += spectrum_cost.spectrum_cost(wanted, progress)
    notes: list[str] = []
    if long:
        rows += _fitted(data, wanted, progress, notes)
    if catalogue is not None:
        rows += _catalogued(catalogue, wanted, data, progress, notes)
    if not rows and not chosen:
        names = sorted({one.name for one in cases.svbrdf_cases(True)} | {*minified.NAMES, spectrum_cost.NAME})
        expected = f"{'; '.join(names)}; with data MERL ...; with a catalogue ids of its materials"
        raise InputError("no case is called so", field="--case", found=pattern, expected=expected)
    return {"missing": _missing(data), "notes": notes, "rows": rows}


def _fitted(data: Path | None, wanted: Callable[[str], bool], progress: Progress, notes: list[str]) -> Iterator[dict]:
    found = []
    for row, seconds in measured.measured_rows(data, wanted, progress):
        found.append((row["delta_e94"]["mean"], seconds))
        yield row
    if found:
        means, times = zip(*found, strict=True)
        notes.append(
            f"{len(found)} MERL fits of at most {measured.LOBES} lobes: means of ΔE94 with a median of "
            f"{np.median(means):.2f} and at most {max(means):.2f}; at most {max(times):.1f} CPU s a fit"
        )


def _catalogued(
    folder: Path, wanted: Callable[[str], bool], data: Path | None, progress: Progress, notes: list[str]
) -> Iterator[dict]:
    made, skies = cases.case_lights(data), {}
    if SKY in made:
        skies[SKY] = partial(_sky, made[SKY])
    worst: dict[str, list[float]] = {}
    for row in catalogued(folder, wanted, skies, progress):
        worst.setdefault(row["light"], []).append(row["delta_e94"]["p95"])
        yield row
    for light, each in worst.items():
        share = float(np.mean(np.array(each) <= 1.0))
        words = f"p95 of ΔE94 within 1 for {share:.0%}, at most {max(each):.2f}"
        notes.append(f"{len(each)} materials of {folder} under {light}: {words}")


def _sky(made: Callable[[], EnvironmentLight | DeltaLight]) -> EnvironmentLight:
    light = rendering.at_most_rows(made(), rendering.ROWS[0])
    if not isinstance(light, EnvironmentLight):
        raise TypeError("an environment is needed")
    return light


def _missing(data: Path | None) -> list[str]:
    """Lights and meshes whose files are not there."""
    lights, places = cases.case_lights(data), meshes.mesh_places(data)
    return [name for name in cases.FILES if name not in lights] + [name for name in meshes.FILES if name not in places]


def report(figures: dict) -> str:
    """Return the figures as a table."""
    body = [
        [
            row["case"], row["light"], row["method"], f"{row['lobes'] or '-'}",
            *(f"{row['delta_e94'][figure]:.2f}" for figure in ("mean", "p95", "p99")),
            f"{row['reference_noise']:.3f}", _or_dash(row["cpu_seconds_per_1000_vertices"], ".2f"),
            _or_dash(row["bytes_per_vertex"], ".0f"), _or_dash(row["ms_per_megapixel"], ".0f"),
        ]
        for row in figures["rows"]
    ]  # fmt: skip
    title = "ΔE94 against the truth, which is itself off by `noise`; CPU seconds for 1000 vertices and bytes a vertex"
    headings = ["case", "light", "method", "lobes", "mean", "p95", "p99", "noise", "CPU s", "bytes", "ms a megapixel"]
    text = "\n".join([title, columns(headings, body, left=3), *([""] * bool(figures["notes"])), *figures["notes"]])
    if figures["missing"]:
        text += f"\n\nwithout {', '.join(figures['missing'])}: set METAMER_DATA to a folder with light/ and meshes/"
    return text


def _or_dash(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
