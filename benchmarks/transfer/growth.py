"""Growth of precomputation and relighting with a scene: balls above a floor, every fourth of them glossy."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...lighting.transfer.precomputation import Precomputation
from ..papers.site_relighting.relighting import Relighting
from ..timing import best_ms
from .build_cost import balls
from .scenes import gloss, low_sun_sky, matt, ramp

#: Name for `--case`.
NAME = "growth"
#: Balls of each size: 2,000 to 62,000 vertices. Rays of each site.
BALLS, RAYS = (3, 12, 48, 96), 256
# Radii of the scene: no edge is longer.
_UNDIVIDED = 10.0
_COLOURS = (ramp(0.05, 0.05, 0.1, 0.7, 0.75), ramp(0.05, 0.3, 0.6, 0.15, 0.1), ramp(0.5, 0.55, 0.35, 0.1, 0.06))


def growth_rows(progress: Callable[[str], None], counts: tuple[int, ...] = BALLS, rays: int = RAYS) -> list[dict]:
    """Return a row for each size; `beside_first` has seconds, milliseconds and bytes a vertex beside those of the
    first: 1 is linear. No errors are measured.
    """
    found: list[dict] = []
    for count in counts:
        progress(f"growth: {count} balls")
        row = _of(count, rays)
        first = found[0] if found else row
        row["beside_first"] = {
            what: _of_vertex(row, what) / _of_vertex(first, what)
            for what in ("precompute_cpu_seconds", "bytes", *row["relight_ms"])
        }
        found.append(row)
    return found


def _of_vertex(row: dict, what: str) -> float:
    return (row["relight_ms"][what] if what in row["relight_ms"] else row[what]) / row["vertices"]


def _of(count: int, rays: int) -> dict:
    plain = balls(count)
    parts = tuple(replace(part, material=f"{number % 4}") for number, part in enumerate(plain.parts))
    scene = replace(plain, parts=parts, lights=(low_sun_sky(),))
    materials = {str(number): matt(_COLOURS[number]) for number in range(3)} | {"3": gloss(_COLOURS[0])}
    begin = time.process_time()
    prepared = Precomputation.of(scene, rays, _UNDIVIDED)
    _ = prepared.by_part, prepared.later, prepared.sky_operator, prepared.occluders
    state = Relighting.of(scene, {name: materials[name] for name in scene.material_ids}, prepared)
    _ = state.rays.sky_in_cells
    seconds = time.process_time() - begin
    eye, light, steps = np.asarray(scene.camera().position, dtype=float), low_sun_sky(), iter(range(1, 1000))
    state.exits(eye)

    def turned() -> Relighting:
        return state.with_lights(replace(light, rotation_deg=float(next(steps))))

    relight = {
        "light": best_ms(lambda: turned().exits(eye)),
        "view": best_ms(lambda: state.exits(eye + 0.01 * next(steps))),
        "all": best_ms(lambda: turned().exits(eye + 0.01 * next(steps))),
    }
    return {
        "scene": NAME,
        "vertices": len(prepared.hits.sites),
        "regions": len(parts),
        "method": "ours",
        "at": "sites",
        "rays": rays,
        "coefficients": state.basis.size,
        "bounces": "all",
        "precompute_cpu_seconds": seconds,
        "bytes": prepared.hits.nbytes,
        "relight_ms": relight,
        "light": "sky",
        "delta_e94": None,
        "reference_noise": None,
    }
