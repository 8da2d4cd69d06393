"""Worth of mip-mapped factors: small glossy balls with few samples a pixel, against very many."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..calibration.report.statistics import delta_e_map, delta_e_statistics
from ..lighting.camera import Camera
from ..lighting.lights import DirectionalLight
from ..lighting.mesh import shapes
from ..lighting.mesh.mesh import Mesh
from ..lighting.scene import Part, Scene
from ..materials.analytic import AshikhminShirley
from ..materials.factored.pack import FactoredBrdf
from ..materials.fitting.fit import fit
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..viewer.render.scene_layers import Filtering
from ..viewer.render.session import RenderSession

#: Samples along a side of a pixel, and how factors are filtered.
CONFIGURATIONS: tuple[tuple[int, Filtering], ...] = (
    (1, "linear"),
    (1, "mipmapped"),
    (2, "linear"),
    (2, "mipmapped"),
    (4, "linear"),
)
#: Along a side, of the picture that the others are judged by.
REFERENCE_SAMPLES = 8
#: Ashikhmin and Shirley's exponents along and across: a coat over grey.
SURFACES = {"ashikhmin-shirley-500": (500.0, 500.0), "ashikhmin-shirley-20-500": (20.0, 500.0)}
#: Terms of a lobe: filtering is judged against the same packs, not against the surface.
RANK = 8
WORDS = (
    f"balls of 3 to 14 pixels' radius; ΔE94 against {REFERENCE_SAMPLES}x{REFERENCE_SAMPLES} samples a pixel, over "
    "pixels that they cover wholly; geometry kept, the median of five pictures"
)


def filtering_points(
    renderer: RenderSession, progress: Callable[[str], None] = lambda line: None, balls: int = 8
) -> list[dict]:
    """Milliseconds a megapixel and ΔE94 of each of `CONFIGURATIONS`, for two surfaces.

    `balls` stand along a side of the picture, at 32 pixels each. The error is that of filtering alone: the picture that
    it is counted against shows the same packs.

    Returns
    -------
    dicts for JSON: `kind` "filtering", `case`, `configuration`, `ms_per_megapixel`, `geometry_ms_per_megapixel` (of a
    picture from a new point of view, angles and shadows included) and `delta_e94` with mean, p95, p99 and max.
    """
    scene = _scene(balls)
    camera = scene.camera()
    white = scene.adopted_white()
    before, points = renderer.settings.filtering, []
    try:
        for case, packs in _surfaces():
            renderer.configure(filtering="linear")
            reference, whole = renderer.render(scene, replace(camera, samples=REFERENCE_SAMPLES), packs)
            for samples, filtering in CONFIGURATIONS:
                renderer.configure(filtering=filtering)
                view = replace(camera, samples=samples)
                (sample, coverage), anew, kept = _timed(renderer, scene, view, packs)
                difference = delta_e_map(reference, sample, white, np.minimum(whole, coverage))
                found = delta_e_statistics(difference)
                name = f"{samples}x{samples} samples, {filtering}"
                points.append(
                    {
                        "kind": "filtering",
                        "case": case,
                        "configuration": name,
                        "ms_per_megapixel": kept,
                        "geometry_ms_per_megapixel": anew,
                        "delta_e94": {"mean": found.mean, "p95": found.p95, "p99": found.p99, "max": found.max},
                    }
                )
                progress(f"    {case}: {name}: ΔE94 p99 {found.p99:.2f}, {kept:.0f} ms a megapixel")
    finally:
        renderer.configure(filtering=before)
    return points


def _timed(renderer: RenderSession, scene: Scene, camera: Camera, packs: dict[str, FactoredBrdf]):
    """The picture, and milliseconds a megapixel with the geometry made anew and with it kept."""
    megapixels = camera.width * camera.height_px / 1e6
    # Programs are compiled and tables of weights made before the clock runs.
    picture = renderer.render(scene, camera, packs)
    renderer.release()
    taken = []
    for _ in range(6):
        start = time.perf_counter()
        renderer.render(scene, camera, packs)
        taken.append(1e3 * (time.perf_counter() - start) / megapixels)
    return picture, taken[0], float(np.median(taken[1:]))


def _surfaces() -> list[tuple[str, dict[str, FactoredBrdf]]]:
    grey, coat = (
        Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(WORKING_WAVELENGTHS_NM.size, value), "reflectance")
        for value in (0.2, 0.05)
    )
    return [
        (case, {"gloss": fit(AshikhminShirley(grey, coat, *exponents), budget=1.0, ranks=(RANK,)).fast})
        for case, exponents in SURFACES.items()
    ]


def _scene(balls: int) -> Scene:
    """Balls of growing radius in rows, each a little beside the middle of its square, as one mesh."""
    ball = shapes.sphere(3)
    rng = np.random.default_rng(0)
    radii = np.linspace(0.2, 0.9, balls * balls)
    row, column = np.divmod(np.arange(balls * balls), balls)
    centres = np.stack([2.0 * column - balls + 1.0, 2.0 * row - balls + 1.0, np.zeros(balls * balls)], axis=1)
    centres[:, :2] += rng.uniform(-0.06, 0.06, (balls * balls, 2))
    mesh = Mesh(
        (radii[:, None, None] * ball.vertices + centres[:, None]).reshape(-1, 3),
        np.tile(ball.normals, (balls * balls, 1)),
        (ball.faces + len(ball.vertices) * np.arange(balls * balls)[:, None, None]).reshape(-1, 3),
        name="balls",
    )
    size = 32 * balls
    camera = Camera(
        "front", (0, 0, 20), (0, 0, 0), (0, 1, 0), "orthographic", height=2.0 * balls, width=size, height_px=size
    )
    light = DirectionalLight(np.array([0.4, 0.7, 0.6]), illuminant("D65"), 1000.0)
    return Scene((Part("balls", mesh, "gloss"),), (light,), (camera,), observer("1931_2"))
