"""Cost of edits while somebody looks: another roughness, colour or map, a light that is turned or of another
spectrum, each drawn again by a renderer that keeps what the edit does not touch, beside one that keeps nothing.

The visibility of the scene is worked out before, and never again: it is of meshes alone.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..calibration.report.text_tables import TextTable, text_tables
from ..lighting.camera import Camera
from ..lighting.environment import latlong
from ..lighting.environment.environment import EnvironmentLight
from ..lighting.mesh import shapes
from ..lighting.scene import Part, Scene
from ..materials.core.fast import Fast
from ..materials.svbrdf.maps import MappedSurface
from ..materials.svbrdf.texel_map import TexelMap
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..viewer.gl.backend import gl_session
from ..viewer.gl.context import NoGL
from ..viewer.render.session import RenderSession
from ..viewer.software.backend import software_session

ROUGHNESS, COLOUR, MAP = "another roughness", "another base colour", "another normal map"
ROTATION, SPECTRUM = "the light turned", "another spectrum"
#: Work caused by each edit, in words.
REDONE = {
    ROUGHNESS: "the form of the maps, its terms",
    COLOUR: "the form of the maps, its terms",
    MAP: "the form of the maps, its terms",
    ROTATION: "terms: look-ups elsewhere",
    SPECTRUM: "a fold of kept terms",
}
# Texels along a side of the maps; spectra that take turns; degrees that the light is turned by.
_SIDE, _SPECTRA, _STEP_DEG = 64, ("A", "FL11", "D50", "LED-B3"), 17.0
# Relative difference between two pictures counts beside this share of the brightest pixel.
_FLOOR = 1e-2


@dataclass(frozen=True)
class _Edited:
    """A scene under one light, the surface that its body has, and the spectrum in the light's place."""

    light: EnvironmentLight
    roughness: float = 0.45
    red: float = 0.8
    waves: int = 4
    spectrum: Spectrum | None = None

    def surface(self) -> MappedSurface:
        """Return the maps as they are edited."""
        y, x = np.mgrid[0:_SIDE, 0:_SIDE] * (2.0 * np.pi * self.waves / _SIDE)
        base = np.stack([self.red * (0.6 + 0.4 * np.sin(x)), 0.3 + 0.1 * np.cos(y), np.full_like(x, 0.15)], axis=-1)
        normal = np.stack([0.2 * np.sin(x), 0.2 * np.cos(y), np.ones_like(x)], axis=-1)
        rough = self.roughness * (0.85 + 0.15 * np.sin(x + y))[..., None]
        base, normal, rough = (TexelMap(one.astype(np.float32)) for one in (base, normal, rough))
        nothing = TexelMap.constant(0.0)
        return MappedSurface(WORKING_WAVELENGTHS_NM, base, rough, "mallett-yuksel", metallic=nothing, normal=normal)


def run(width: int = 240, height: int = 135, subdivisions: int = 5, repeats: int = 3, light_rows: int = 128) -> dict:
    """Draw a body with maps on a floor under an environment, edited again and again, one sample a pixel.

    Returns
    -------
    dict for JSON: `pixels`, `vertices`, `first_ms` by renderer (all but the visibility made), and by renderer and edit
    `form_ms` (the form that is drawn, made of the maps) and `draw_ms`, both medians; `anew_ms`, of the last picture by
    a renderer that has kept nothing but programs; and `apart`, the 99.9th percentile of the relative difference between
    the two pictures.
    """
    body = shapes.speed_shape(subdivisions, uv=True)
    parts = (Part("shape", body, "maps"), Part("floor", shapes.plane(6.0, 6.0), "maps"))
    camera = Camera(
        "view", (1.6, 1.6, 3.4), (0, 0.3, 0), vertical_fov_deg=36.0, width=width, height_px=height, samples=1
    )
    light = _sky(light_rows)
    scene = Scene(parts, (light,), (camera,), observer("1931_2"))
    found: dict = {"pixels": [width, height], "vertices": sum(len(part.mesh.vertices) for part in parts)}
    found["first_ms"], found["edits"] = {}, {}
    for renderer, anew in _renderers():
        with renderer, anew:
            draw(anew, scene, _Edited(light), _Edited(light).surface().own_form())
            begun = time.perf_counter()
            draw(renderer, scene, _Edited(light), _Edited(light).surface().own_form())
            found["first_ms"][renderer.name] = 1e3 * (time.perf_counter() - begun)
            found["edits"][renderer.name] = {
                name: _row(renderer, anew, scene, [_edited(light, name, turn) for turn in range(1, repeats + 1)])
                for name in REDONE
            }
    return found


def draw(renderer: RenderSession, scene: Scene, edited: _Edited, form: Fast) -> Float[np.ndarray, "H W 3"]:
    """XYZ of the scene as it is edited."""
    now = replace(scene, lights=(edited.light,))
    return renderer.render_many(now, None, {"maps": form}, (edited.spectrum,))[0][0]


def _edited(light: EnvironmentLight, name: str, turn: int) -> _Edited:
    before = _Edited(light)
    return {
        ROUGHNESS: lambda: replace(before, roughness=0.45 + 0.04 * turn),
        COLOUR: lambda: replace(before, red=0.8 - 0.1 * turn),
        MAP: lambda: replace(before, waves=4 + turn),
        ROTATION: lambda: replace(before, light=replace(light, rotation_deg=_STEP_DEG * turn)),
        SPECTRUM: lambda: replace(before, spectrum=illuminant(_SPECTRA[turn % len(_SPECTRA)])),
    }[name]()


def _row(renderer: RenderSession, anew: RenderSession, scene: Scene, turns: Sequence[_Edited]) -> dict[str, float]:
    """One edit after the other: its time, that of a renderer that keeps nothing, and how far the pictures are apart."""
    before = _Edited(scene.spread_lights[0])  # pyright: ignore[reportArgumentType]
    form = before.surface().own_form()
    draw(renderer, scene, before, form)
    times, picture, edited = [], np.empty(0), before
    for edited in turns:
        begun = time.perf_counter()
        # A light that is turned leaves the form alone.
        if replace(edited, light=before.light, spectrum=None) != before:
            form = edited.surface().own_form()
        made = time.perf_counter()
        picture = draw(renderer, scene, edited, form)
        times.append((made - begun, time.perf_counter() - made))
    form_ms, draw_ms = (1e3 * np.median(np.array(times), axis=0)).tolist()
    begun = time.perf_counter()
    anew.release()
    other = draw(anew, scene, edited, form)
    anew_ms = 1e3 * (time.perf_counter() - begun)
    relative = np.abs(picture - other) / np.maximum(np.abs(other), _FLOOR * float(other.max()))
    apart = float(np.percentile(relative, 99.9))
    return {"form_ms": form_ms, "draw_ms": draw_ms, "anew_ms": anew_ms, "apart": apart}


def _renderers() -> list[tuple[RenderSession, RenderSession]]:
    """Return each kind that there is: one that keeps terms, and one to be released before each picture."""
    found: list[tuple[RenderSession, RenderSession]] = []
    with suppress(NoGL):
        found.append((gl_session(keeps_terms=True), gl_session()))
    return [*found, (software_session(keeps_terms=True), software_session())]


def _sky(rows: int) -> EnvironmentLight:
    """Clouds, a small sun and less from below."""
    to = latlong.texel_directions(rows, 2 * rows)
    sun = 200.0 * np.exp(300.0 * (to @ np.array([0.48, 0.64, 0.6]) - 1.0))
    clouds = 1.0 + 0.4 * np.sin(5.0 * to[..., 0]) * np.cos(4.0 * to[..., 2])
    return EnvironmentLight((clouds * np.where(to[..., 1] > 0.0, 1.0, 0.2) + sun)[None], (illuminant("D65"),))


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people, one table a renderer."""
    width, height = measured["pixels"]
    header = ["", "what is redone", "ms, form", "ms, drawn", "ms, nothing kept", "times faster", "apart"]
    found = []
    for name, edits in measured["edits"].items():
        title = (
            f"edits under an environment with shadows, {width} x {height} pixels, {measured['vertices']:,} vertices, "
            f"{name}; the first picture took {measured['first_ms'][name]:.0f} ms"
        )
        rows = [
            [
                edit,
                REDONE[edit],
                f"{row['form_ms']:.0f}",
                f"{row['draw_ms']:.0f}",
                f"{row['anew_ms']:.0f}",
                f"{row['anew_ms'] / row['draw_ms']:.1f}",
                f"{row['apart']:.0e}",
            ]
            for edit, row in edits.items()
        ]
        found.append((title, header, rows))
    return found


def report(measured: dict) -> str:
    """Return the result of `run` as plain text."""
    return text_tables(tables(measured))
