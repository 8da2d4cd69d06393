"""References of a review, computed by several processes, since they are far more expensive than images."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...calibration.report.row import ReferenceNoise
from ...lighting.camera import Camera
from ...lighting.reference.geometry import VisibleGeometry
from ...lighting.reference.noise import ReferenceNoiseEstimate
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.core.surface import Surface
from ...runtime.worker_pool import in_order
from ...spectral.spectrum import Spectrum


@dataclass(frozen=True, eq=False)
class Reference:
    """Reference images (M,H,W,3), float64, one per spectrum, with their total seconds and noise."""

    xyz: Float[np.ndarray, "M H W 3"]
    seconds: float
    noise: ReferenceNoiseEstimate | None = None

    def noise_of(self, number: int) -> ReferenceNoise | None:
        """Return the noise of one of the images, for a row."""
        noise = self.noise
        if noise is None:
            return None
        return ReferenceNoise(noise.mean[number], noise.p99[number], noise.aimed, noise.directions, noise.limited)


# State of a worker process, set by `_start_worker`, since geometry is large and shared by all materials, and cached
# sums are found by its meshes and lights.
_worker: dict = {}


def reference_pictures(
    scenes: Sequence[Scene],
    catalogue: Catalogue,
    view: Camera,
    spectra: Sequence[Spectrum | None],
    geometry: VisibleGeometry,
    jobs: int,
    budget: float = 1.0,
    heard: Callable[[int, float], None] | None = None,
) -> Generator[Reference, None, None]:
    """Yield the references of scenes that differ in materials only, in order, each under all `spectra`, with the
    scene's number of bounces (`indirect_cache.with_counted_bounces`).

    `geometry` is the common visible geometry of `view`; `budget`: see `reference_images`. With one job or scene no
    process is started. `heard` receives (index of the scene, share done).
    """
    start = _start_worker, (catalogue.folder, scenes, view, spectra, geometry, budget)
    tasks = ((number,) for number in range(len(scenes)))
    yield from in_order(_reference, tasks, min(jobs, len(scenes)), start, heard)


def _start_worker(
    folder: Path,
    scenes: Sequence[Scene],
    view: Camera,
    spectra: Sequence[Spectrum | None],
    geometry: VisibleGeometry,
    budget: float,
) -> None:
    found = Catalogue.open(folder)
    _worker.update(catalogue=found, scenes=scenes, view=view, spectra=spectra, geometry=geometry, budget=budget)


def _reference(number: int, say: Callable[[float], None] = lambda share: None) -> Reference:
    say(0.0)
    scene = _worker["scenes"][number]
    surfaces = {name: _worker["catalogue"].load(name).surface() for name in scene.material_ids}
    seen = (_worker[name] for name in ("view", "spectra", "geometry", "budget"))
    found = reference_of(scene, surfaces, *seen, say=say)
    say(1.0)
    return found


def reference_of(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    view: Camera,
    spectra: Sequence[Spectrum | None],
    geometry: VisibleGeometry,
    budget: float,
    say: Callable[[float], None] = lambda share: None,
) -> Reference:
    """Compute the reference of one scene, as in `reference_pictures`; `say` receives the share done."""
    start = time.perf_counter()
    found = reference_images(
        scene,
        view,
        surfaces,
        spectra,
        geometry=geometry,
        budget=budget,
        bounces=int(scene.bounces),
        progress=lambda done, total, what: say(done / total),
    )
    return Reference(found.xyz, time.perf_counter() - start, found.noise)
