"""Cost of spectra and error of few coefficients: beside 81 samples, and beside three numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ...lighting.environment.environment import EnvironmentLight
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ..papers.site_relighting.relighting import Relighting
from ..timing import timed
from .ours import TracedGeometry
from .pixels import figures_of
from .scenes import TransferScene, scenes

#: Name for `--case`.
NAME = "spectrum"
#: Lights, and bounces, so that all take as many. Rays of each site. Times that each way is timed, by turns.
LIGHTS, BOUNCES, RAYS, TIMES = ("D65", "A", "FL11"), 4, 256, 5
_RGB = 3


def coefficient_rows(progress: Callable[[str], None], names: tuple[str, ...] = ("table", "box")) -> list[dict]:
    """Return a row for each scene and light: `delta_e94` and its `max` beside 81 samples, at all sites that are seen;
    and `rgb_surcharge`, milliseconds of all of a relighting beside those with three coefficients, in the same run.
    """
    return [
        row for case in scenes(full=True) if case.name in names and case.light == "sky" for row in _of(case, progress)
    ]


def _of(case: TransferScene, progress: Callable[[str], None]) -> Iterator[dict]:
    geometry = TracedGeometry.of(case, RAYS, case.longest_edge, progress)
    eye, light = np.asarray(case.scene.camera().position, dtype=float), case.scene.lights[0]
    assert isinstance(light, EnvironmentLight)
    start = Relighting.of(case.scene, case.materials, geometry.prepared, bounces=BOUNCES)
    for name in LIGHTS:
        progress(f"{case.name}: {name} in {start.basis.size} coefficients and in 81 samples")
        lamp = light.with_spectrum(illuminant(name), name)
        few = start.with_lights(lamp)
        exact = few.with_lights(lamp, basis=SpectralBasis.sampled(few.basis.wavelengths_nm)).exits(eye)
        found = few.exits(eye)
        seen = exact[:, 1] > 0.0
        off = delta_e_xyz(exact[seen], np.maximum(found[seen], 0.0), case.scene.observer.white(lamp.spectrum))
        spectral, rgb = _by_turns(few, replace(few, basis=few.basis.truncated(_RGB)), lamp, eye)
        yield {
            "scene": case.name,
            "vertices": len(geometry.prepared.hits.sites),
            "regions": len(case.scene.parts),
            "method": "ours",
            "at": "wavelengths",
            "rays": RAYS,
            "coefficients": few.basis.size,
            "bounces": BOUNCES,
            "precompute_cpu_seconds": geometry.cpu_seconds,
            "bytes": geometry.prepared.hits.nbytes,
            "relight_ms": {"all": spectral},
            "rgb_surcharge": spectral / rgb,
            "light": name,
            "delta_e94": figures_of(off) | {"max": float(off.max())},
            "reference_noise": 0.0,
        }


def _by_turns(one: Relighting, other: Relighting, lamp: EnvironmentLight, eye: np.ndarray) -> tuple[float, float]:
    """Return the least milliseconds of each, with another light and view: no view is seen twice, since weights are
    kept.
    """
    best = [np.inf, np.inf]
    for step in range(1, TIMES + 1):
        turned = replace(lamp, rotation_deg=lamp.rotation_deg + step)
        for number, state in enumerate((one, other)):
            moved = eye + 0.01 * step + 0.005 * number
            relit = partial(_relit, state, turned, moved)
            best[number] = min(best[number], 1000.0 * timed(relit)[1])
    return best[0], best[1]


def _relit(state: Relighting, light: EnvironmentLight, eye: np.ndarray) -> np.ndarray:
    return state.with_lights(light, basis=state.basis).exits(eye)
