"""Surfaces under lights by every method, beside the truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...lighting.environment.convolution import half_size
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import DeltaLight
from ...spectral.difference import delta_e_xyz
from .cases import WALL, BenchCase, case_lights
from .hiding import Hiding, Wall
from .light import PreparedLight
from .meshes import mesh_places
from .methods import DELTA_METHODS, METHODS, Method, MethodTask
from .ours import by_slices
from .rows import svbrdf_row
from .surface import ShadedPoints
from .truth import true_terms

# Points across the sphere, and rows of environments, of a quick and of a full run.
ACROSS, ROWS = (26, 36), (128, 256)
# Pixels that cameras see meshes in, across.
PICTURE = (26, 40)
_REPEATS = 3


def method_rows(
    cases: Sequence[BenchCase], full: bool, data: Path | None, progress: Callable[[str], None]
) -> Iterator[dict]:
    """Rows of each case whose light and place there are, by all methods that there are for it."""
    shapes, made = mesh_places(data), case_lights(data)
    ready: dict[tuple[str, int], PreparedLight] = {}
    stood: dict[str, tuple[Hiding | None, ShadedPoints]] = {}
    for case in cases:
        in_a_scene = case.place in shapes
        if case.light_name not in made or not (in_a_scene or case.place in ("open", "wall")):
            continue
        if case.place not in stood:
            if in_a_scene:
                progress(f"visibility of {case.place}")
                stood[case.place] = shapes[case.place](PICTURE[full])
            else:
                stood[case.place] = Wall(WALL) if case.place == "wall" else None, ShadedPoints.of_sphere(ACROSS[full])
        rows = ROWS[full]
        if (case.light_name, rows) not in ready:
            ready[case.light_name, rows] = PreparedLight(at_most_rows(made[case.light_name](), rows))
        progress(f"{case.name}, {case.light_name}")
        yield from _of_case(case, *stood[case.place], ready[case.light_name, rows])


def _of_case(case: BenchCase, hiding: Hiding | None, points: ShadedPoints, light: PreparedLight) -> Iterator[dict]:
    both = true_terms(MethodTask(case.surface, points, light, hiding, 0))
    reference, coarse = (light.folded(terms, case.surface.spectra) for terms in both)
    noise = float(delta_e_xyz(reference, coarse, light.white(points)).mean()) / 3.0
    for lobes in case.lobes:
        for name, method in _methods(light, hiding).items():
            task = MethodTask(case.surface, points, light, hiding, lobes)
            terms = method(task)
            yield svbrdf_row(
                case.name,
                name,
                case.light_name,
                delta_e_xyz(reference, light.folded(terms, case.surface.spectra), light.white(points)),
                noise,
                lobes=lobes,
                cpu_seconds_per_1000_vertices=hiding.cpu_seconds_per_1000_vertices if hiding else None,
                bytes_per_vertex=hiding.bytes_per_vertex if hiding else None,
                ms_per_megapixel=1e9 / len(points) * min(_seconds(method, task) for _ in range(_REPEATS)),
            )


def _methods(light: PreparedLight, hiding: Hiding | None) -> Mapping[str, Method]:
    if not isinstance(light.light, EnvironmentLight):
        return DELTA_METHODS
    # A wall has no vertices that visibility could be kept at.
    return METHODS if isinstance(hiding, Wall) else {"ours": by_slices, **METHODS}


def at_most_rows(light: EnvironmentLight | DeltaLight, rows: int) -> EnvironmentLight | DeltaLight:
    """Return the same of at most so many rows, where halving leads there."""
    while isinstance(light, EnvironmentLight) and light.fields.shape[1] > rows:
        light = replace(light, fields=half_size(light.fields))
    return light


def _seconds(method: Method, task: MethodTask) -> float:
    start = time.process_time()
    method(task)
    return time.process_time() - start
