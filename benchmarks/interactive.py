"""Cost of another light or camera in a renderer that caches the rest, beside one that does not."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..calibration.report.text_tables import TextTable, text_tables
from ..lighting.camera import Camera
from ..lighting.lights import DirectionalLight, PointLight
from ..lighting.mesh import shapes
from ..lighting.scene import Part, Scene
from ..materials.analytic.oren_nayar import OrenNayar
from ..materials.fitting.fit import fit
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..viewer.gl.backend import gl_session
from ..viewer.render.session import RenderSession

LIGHT, CAMERA = "another light", "another camera"
# The lights that take turns, and the steps of the camera, radians.
_LIGHTS, _STEP = ("A", "FL11", "D50", "LED-B3"), 0.1


def run(width: int = 960, height: int = 540, samples: int = 3, subdivisions: int = 6, repeats: int = 5) -> dict:
    """Draw a shape on a floor under two lights, again and again.

    Another light: `samples` x `samples` samples a pixel, terms kept, beside tiles alone kept where they fit. Another
    camera: one sample a pixel, geometry kept, beside nothing kept. The two take turns in one run.

    Returns
    -------
    dict for JSON: `renderer`, `triangles`, `pixels`, `samples`, and for each of the two `kept_ms` and `else_ms`
    (medians), and `faster`, the median of the ratios within a turn.

    Raises
    ------
    NoGL : there is no GL to time.
    """
    packs = {"paint": fit(OrenNayar.examples(WORKING_WAVELENGTHS_NM)[0], budget=1.0, pixels=64).fast}
    body = shapes.speed_shape(subdivisions)
    parts = (Part("shape", body, "paint"), Part("floor", shapes.plane(6.0, 6.0), "paint"))
    light = illuminant("D65")
    lights = (
        DirectionalLight((0.4, 0.8, 0.5), light, 800.0),
        PointLight((-1.5, 2.0, 1.5), light, 800.0),
    )

    def scene_of(angle: float, side: int) -> Scene:
        place = (3.2 * np.sin(angle), 1.2, 3.2 * np.cos(angle))
        camera = Camera("view", place, (0, 0, 0), vertical_fov_deg=36.0, width=width, height_px=height, samples=side)
        return Scene(parts, lights, (camera,), observer("1931_2"))

    with gl_session(keeps_terms=True) as kept, gl_session() as other:
        still = scene_of(0.0, samples)

        def switch(renderer: RenderSession, turn: int) -> None:
            renderer.render_many(still, None, packs, (illuminant(_LIGHTS[turn % len(_LIGHTS)]),))

        def orbit(renderer: RenderSession, turn: int) -> None:
            if renderer is other:
                renderer.release()
            renderer.render(scene_of(_STEP * turn, 1), None, packs)

        found = {LIGHT: _timed(kept, other, switch, repeats), CAMERA: _timed(kept, other, orbit, repeats)}
        return {
            "renderer": kept.name,
            "triangles": sum(len(part.mesh.faces) for part in parts),
            "pixels": [width, height],
            "samples": samples,
            **found,
        }


def _timed(
    kept: RenderSession, other: RenderSession, draw: Callable[[RenderSession, int], None], repeats: int
) -> dict[str, float]:
    draw(kept, 0)
    draw(other, 0)
    turns = []
    for turn in range(1, repeats + 1):
        begun = time.perf_counter()
        draw(kept, turn)
        middle = time.perf_counter()
        draw(other, turn)
        turns.append((middle - begun, time.perf_counter() - middle))
    seconds = np.array(turns)
    return {
        "kept_ms": float(1e3 * np.median(seconds[:, 0])),
        "else_ms": float(1e3 * np.median(seconds[:, 1])),
        "faster": float(np.median(seconds[:, 1] / seconds[:, 0])),
    }


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people."""
    width, height = measured["pixels"]
    title = (
        f"{width} x {height} pixels, {measured['triangles']:,} triangles, 2 lights, {measured['renderer']}; "
        f"lights at {measured['samples']} x {measured['samples']} samples, cameras at one"
    )
    rows = [
        [
            name,
            f"{measured[name]['kept_ms']:.0f}",
            f"{measured[name]['else_ms']:.0f}",
            f"{measured[name]['faster']:.1f}",
        ]
        for name in (LIGHT, CAMERA)
    ]
    return [(title, ["", "ms, kept", "ms, else", "times faster"], rows)]


def report(measured: dict) -> str:
    """Return the result of `run` as plain text."""
    return text_tables(tables(measured))
