"""Every case by every method: how far off, how long, beside how far off the truth itself may be."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...calibration.text_tables import columns
from ...lighting.environment.convolution import halved
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import DeltaLight
from ...spectral.difference import delta_e_xyz
from .cases import FILES, WALL, cases, lights
from .hiding import Hiding, Wall, shape_on_floor
from .light import PreparedLight
from .methods import DELTA_METHODS, METHODS, Method, Task
from .ours import by_slices
from .surface import ShadedPoints
from .truth import truth

# Points across the sphere, and rows of environments, of a quick and of a full run.
_ACROSS, _ROWS = (26, 36), (128, 256)
# Points drawn on the shape and its floor, of which about half are seen from the front.
_DRAWN = (600, 1500)
_REPEATS = 3


def run(full: bool = False, data: Path | None = None, progress: Callable[[str], None] = lambda line: None) -> dict:
    """Render all there is.

    Returns
    -------
    dict for JSON: `points`, `missing` (lights whose files are not there) and `rows`. A row has `case`, `method`,
    `light`, `lobes`, `delta_e94` (`mean`, `p95`, `p99` over the points, against the truth), `reference_noise` (mean
    ΔE94 of a third of the difference to the truth from texels twice as wide), `cpu_seconds_per_1000_vertices` and
    `bytes_per_vertex` (of visibility, None where the case needs none or it is closed) and `ms_per_megapixel` (in
    numpy, on one core, without what is made once a light).
    """
    sphere = ShadedPoints.of_sphere(_ACROSS[full])
    places: dict[str, tuple[Hiding | None, ShadedPoints]] = {"open": (None, sphere), "wall": (Wall(WALL), sphere)}
    places["floor"] = shape_on_floor(_DRAWN[full])
    made = lights(data)
    ready: dict[tuple[str, int], PreparedLight] = {}
    found: list[dict] = []
    for case in cases(full):
        if case.light_name not in made:
            continue
        hiding, points = places[case.place]
        # Rays to every texel of a map of half as many rows are enough, and a quarter of them.
        rows = _ROWS[full] // (2 if case.place == "floor" else 1)
        if (case.light_name, rows) not in ready:
            ready[case.light_name, rows] = PreparedLight(_reduced(made[case.light_name](), rows))
        light = ready[case.light_name, rows]
        both = truth(Task(case.surface, points, light, hiding, 0))
        reference, coarse = (light.folded(terms, case.surface.spectra) for terms in both)
        noise = float(delta_e_xyz(reference, coarse, light.white(points)).mean()) / 3.0
        cost = {
            "cpu_seconds_per_1000_vertices": hiding.cpu_seconds_per_1000_vertices if hiding else None,
            "bytes_per_vertex": hiding.bytes_per_vertex if hiding else None,
        }
        methods = METHODS if isinstance(light.light, EnvironmentLight) else DELTA_METHODS
        if methods is METHODS and not isinstance(hiding, Wall):
            # A wall has no vertices that visibility could be kept at.
            methods = {"ours": by_slices, **METHODS}
        for lobes in case.lobes:
            for name, method in methods.items():
                task = Task(case.surface, points, light, hiding, lobes)
                terms = method(task)
                milliseconds = 1e9 / len(points) * min(_seconds(method, task) for _ in range(_REPEATS))
                apart = delta_e_xyz(reference, light.folded(terms, case.surface.spectra), light.white(points))
                p95, p99 = np.percentile(apart, [95, 99])
                found.append(
                    {
                        "case": case.name, "method": name, "light": case.light_name, "lobes": lobes,
                        "delta_e94": {"mean": float(apart.mean()), "p95": float(p95), "p99": float(p99)},
                        "reference_noise": noise, **cost,
                        "ms_per_megapixel": milliseconds,
                    }
                )  # fmt: skip
        progress(f"{case.name}, {case.light_name}")
    return {"points": len(sphere), "missing": [name for name in FILES if name not in made], "rows": found}


def _reduced(light: EnvironmentLight | DeltaLight, rows: int) -> EnvironmentLight | DeltaLight:
    """The same of at most so many rows, where halving leads there."""
    while isinstance(light, EnvironmentLight) and light.fields.shape[1] > rows:
        light = replace(light, fields=halved(light.fields))
    return light


def _seconds(method: Method, task: Task) -> float:
    start = time.process_time()
    method(task)
    return time.process_time() - start


def report(figures: dict) -> str:
    """The figures as a table."""
    body = [
        [
            row["case"], row["light"], row["method"], f"{row['lobes'] or '-'}",
            *(f"{row['delta_e94'][figure]:.2f}" for figure in ("mean", "p95", "p99")),
            f"{row['reference_noise']:.2f}", f"{row['ms_per_megapixel']:.0f}",
        ]
        for row in figures["rows"]
    ]  # fmt: skip
    title = f"{figures['points']} points of a sphere; ΔE94 against the truth, which is itself off by `noise`"
    headings = ["case", "light", "method", "lobes", "mean", "p95", "p99", "noise", "ms a megapixel"]
    text = f"{title}\n{columns(headings, body, left=3)}"
    if figures["missing"]:
        text += f"\n\nwithout {', '.join(figures['missing'])}: set METAMER_DATA to a folder that holds light/"
    return text
