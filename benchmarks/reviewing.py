"""Cost of the review window, step by step, beside `render()` in the same run: folds, moving, settling, memory."""

from __future__ import annotations

import ctypes
import gc
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.report.statistics import delta_e_map
from ..calibration.report.text_tables import TextTable, text_tables
from ..lighting.camera import Camera
from ..lighting.environment.environment import EnvironmentLight
from ..lighting.lights import DirectionalLight, PointLight
from ..lighting.mesh import shapes
from ..lighting.scene import Part, Scene
from ..materials.analytic.ashikhmin_shirley import AshikhminShirley
from ..materials.analytic.lambert import Lambert
from ..materials.analytic.oren_nayar import OrenNayar
from ..materials.core.brdf import Brdf
from ..materials.core.fast import Fast
from ..materials.core.surface import Surface
from ..materials.fitting.fit import fit
from ..spectral.difference import delta_e_xyz
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..viewer.gl.backend import gl_session
from ..viewer.gl.context import create_context
from ..viewer.gl.tile import read
from ..viewer.render.session import RenderSession
from ..viewer.window.canvas_renderer import Quality
from ..viewer.window.choices import opened
from ..viewer.window.frame import Frame
from ..viewer.window.light_choice import LightChoice
from ..viewer.window.sides import SessionObjects
from ..viewer.window.state import Session, Subject
from ..viewer.window.view_error import AskedView
from ..viewer.window.viewpoint import orbited
from ..viewer.window.worker import ReferenceWorker
from .transfer import path_tracing

if TYPE_CHECKING:
    import moderngl

RENDER, ORBIT = "render(), nothing kept", "render() of another camera, one sample, nothing kept"
FOLD, MOVING, SETTLING = "another light or observer", "a moving frame", "a step while it settles"
REFERENCE = "a fold while the reference runs"
LIGHTS, OBSERVERS = ("A", "FL11", "D50", "LED-B3"), ("1931_2", "1964_10")
#: ΔE94, p95, that a path tracer is let run to.
AIMED_DELTA_E = 1.0
# Pixels of its pictures.
_TRACED = 120, 84
_STEP_DEG = 3.0
# Readings of memory of which the least counts.
_READINGS = 4
_PATIENCE_S = 60.0
# Seconds of the clock, and processor seconds of all threads, GL in software among them.
Took = tuple[float, float]


class Shelf:
    """Two materials as a catalogue has them, in memory."""

    def __init__(self, fast: Mapping[str, Fast]) -> None:
        self._fast = fast

    def ids(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self._fast)

    def surface(self, name: str) -> Shelf:
        """One of them."""
        return Shelf({name: self._fast[name]})

    def drawn(self) -> Fast:
        """Return that one."""
        (found,) = self._fast.values()
        return found


def run(
    width: int = 1200,
    height: int = 840,
    samples: int = 3,
    subdivisions: int = 6,
    repeats: int = 9,
    switches: int = 1000,
    paths: int = 1024,
) -> dict:
    """Look at a shape on a floor under two lights as a reviewer does, in one process.

    Returns
    -------
    dict for JSON: `renderer`, `pixels`, `samples`, `triangles`; `rows`, by name `p50_ms`, `p95_ms` and `max_ms`, and
    `processor_ms` and `processor_max_ms` of all threads; `cpu_ms` of a fold, of the thread that draws;
    `moving_delta_e94_p95` from the exact picture; `fold_share` and `moving_share` of the processor time of `render()`;
    `switches` with their `count` and what they have left: `memory_mb`, `gl_errors`, `nan_pixels`; `mitsuba`, None where
    it is missing: the processor's `ours_ms` of another light and `theirs_ms` of as good a picture, of so many `paths` a
    pixel, `faster`, and our own `delta_e94_p95` from theirs, whose own is `noise_p95`.

    Raises
    ------
    NoGL : there is no GL to time.
    """
    made = _materials()
    fast = {name: fit(brdf, budget=1.0, pixels=64).fast for name, brdf in made.items()}
    scene = _scene(width, height, samples, subdivisions)
    context = create_context()
    with ExitStack() as stack:
        stack.callback(context.release)
        frame = Frame(context, SessionObjects(scene, Shelf(fast)))
        stack.callback(frame.release)
        once = gl_session(context)
        stack.callback(once.close)
        session = opened(scene, Subject(path="bench.toml"))
        frame.show(session, (width, height))
        frame.settle()
        rows: dict[str, list[Took]] = {name: [] for name in (RENDER, ORBIT, FOLD, MOVING, SETTLING)}
        cpu: list[float] = []
        off = np.nan
        # In turns, so that a busy machine is busy for all of them.
        for turn in range(repeats):
            session = _folds(frame, session, (width, height), turn, rows[FOLD], cpu)
            rows[RENDER] += _anew(once, scene, scene.camera(), fast)
            frame_of = replace(scene.camera(), samples=1, position=orbited(session.view, _STEP_DEG * turn).position)
            rows[ORBIT] += _anew(once, scene, frame_of, fast)
            session = _moves(frame, session, (width, height), rows[MOVING])
            if turn == 0:
                off = _off(frame, session, (width, height))
            rows[SETTLING] += _settles(frame, context)
        rows[REFERENCE] = _beside_reference(frame, session, (width, height), made, repeats)
        left = _switched(frame, session, (min(width, 320), min(height, 240)), switches, fast)
        processor = {name: float(np.median(found, axis=0)[1]) for name, found in rows.items() if found}
        return {
            "renderer": once.name,
            "pixels": [width, height],
            "samples": samples,
            "triangles": sum(len(part.mesh.faces) for part in scene.parts),
            "rows": {name: _percentiles(found) for name, found in rows.items() if found},
            "cpu_ms": float(1e3 * np.median(cpu)),
            "moving_delta_e94_p95": off,
            "fold_share": processor[FOLD] / processor[RENDER],
            "moving_share": processor[MOVING] / processor[ORBIT],
            "switches": left,
            "mitsuba": _beside_paths(context, width, height, subdivisions, repeats, paths),
        }


def _materials() -> dict[str, Brdf]:
    nm = WORKING_WAVELENGTHS_NM
    return {"paint": OrenNayar.examples(nm)[0], "gloss": AshikhminShirley.examples(nm)[0]}


def _scene(width: int, height: int, samples: int, subdivisions: int) -> Scene:
    parts = (
        Part("shape", shapes.speed_shape(subdivisions), "gloss"),
        Part("floor", shapes.plane(6.0, 6.0).placed(translate=(0.0, -1.0, 0.0)), "paint"),
    )
    light = illuminant("D65")
    lights = (DirectionalLight((0.4, 0.8, 0.5), light, 800.0), PointLight((-1.5, 2.0, 1.5), light, 800.0))
    camera = Camera(
        "view", (0.0, 1.2, 3.2), (0, 0, 0), vertical_fov_deg=36.0, width=width, height_px=height, samples=samples
    )
    return Scene(parts, lights, (camera,), observer("1931_2"))


def _timed(work: Callable[[], object]) -> Took:
    begun, before = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - begun, time.process_time() - before


def _anew(once: RenderSession, scene: Scene, camera: Camera, fast: Mapping[str, Fast]) -> list[Took]:
    def work() -> None:
        once.release()
        once.render(scene, camera, fast)

    return [_timed(work)]


def _shown(frame: Frame, session: Session, size: tuple[int, int], moving: bool = False) -> None:
    """Show a frame to the last pixel of what the display is sent."""
    frame.show(session, size, moving)
    _sent(frame)


def _sent(frame: Frame) -> None:
    frame.step(0.0)
    assert frame.texture is not None
    frame.texture.ctx.finish()


def _folds(
    frame: Frame, session: Session, size: tuple[int, int], turn: int, seconds: list[Took], cpu: list[float]
) -> Session:
    frame.show(session, size)
    frame.settle()
    for number in range(2):
        light = LightChoice.named(LIGHTS[(2 * turn + number) % len(LIGHTS)])
        session = replace(session, light=light, observer=OBSERVERS[number])

        def fold(now: Session = session) -> None:
            mine = time.thread_time()
            frame.show(now, size)
            cpu.append(time.thread_time() - mine)
            _sent(frame)
            assert frame.quality == Quality.EXACT

        seconds.append(_timed(fold))
    return session


def _moves(frame: Frame, session: Session, size: tuple[int, int], seconds: list[Took]) -> Session:
    for _ in range(3):
        session = replace(session, view=orbited(session.view, _STEP_DEG))
        seconds.append(_timed(lambda now=session: _shown(frame, now, size, moving=True)))
    return session


def _off(frame: Frame, session: Session, size: tuple[int, int]) -> float:
    """ΔE94 p95 of the moving picture from the exact one of the same view."""
    moving = read(frame.canvases[0])
    frame.show(session, size)
    frame.settle()
    exact = read(frame.canvases[0])
    both = np.minimum(moving[..., 3], exact[..., 3])
    found = delta_e_map(exact[..., :3].astype(np.float64), moving[..., :3].astype(np.float64), frame.whites[0], both)
    _shown(frame, replace(session, view=orbited(session.view, _STEP_DEG)), size, moving=True)
    return float(np.nanpercentile(found, 95.0))


def _settles(frame: Frame, context: moderngl.Context) -> list[Took]:
    """Steps of the smallest size until the picture is exact; the session is the last that was shown."""
    assert frame.session is not None
    frame.show(frame.session, frame.size)
    found, more = [], True

    def work() -> None:
        nonlocal more
        more = frame.step(0.0)
        context.finish()

    while more:
        found.append(_timed(work))
    return found


def _beside_reference(
    frame: Frame, session: Session, size: tuple[int, int], made: Mapping[str, Surface], repeats: int
) -> list[Took]:
    """Folds while the reference of the view runs in its process."""
    frame.show(session, size)
    frame.settle()
    found: list[Took] = []
    assert frame.sides is not None
    picture = read(frame.canvases[0])
    view = AskedView(frame.sides[0].lit, frame.camera, "", picture[..., :3], picture[..., 3], made=made)
    with ReferenceWorker() as worker:
        worker.ask(view)
        begun = time.perf_counter()
        # Its process takes a second to start.
        while worker.poll() is None and time.perf_counter() - begun < _PATIENCE_S:
            time.sleep(0.05)
        for turn in range(3 * repeats):
            light = LightChoice.named(LIGHTS[turn % len(LIGHTS)])
            session = replace(session, light=light)
            found.append(_timed(lambda now=session: _shown(frame, now, size)))
    return found


def _beside_paths(
    context: moderngl.Context, width: int, height: int, subdivisions: int, repeats: int, paths: int
) -> dict[str, Any] | None:
    """Another light of a matt shape under an even sky, read back, beside Mitsuba's path tracer; None without it.

    Both know the same scene, and neither light that has met two surfaces. Mitsuba's noise is that of two small pictures
    and falls with the square root of its paths: how many it takes until the p95 of its ΔE94 is `AIMED_DELTA_E`.
    """
    mitsuba = path_tracing.found_mitsuba(print)
    if mitsuba is None:
        return None
    nm = WORKING_WAVELENGTHS_NM
    matt = {"gloss": (nm, 0.2 + 0.5 * (nm > 580.0)), "paint": (nm, np.full(len(nm), 0.5))}
    fast = {name: Lambert(Spectrum.sampled(*one)).own_form() for name, one in matt.items()}
    scene = _scene(width, height, 3, subdivisions)
    sky = EnvironmentLight(np.ones((1, 8, 16)), (illuminant("D65"),), 1000.0, spectrum_name="D65")
    scene = replace(scene, lights=(sky,))
    small = replace(scene.camera(), width=_TRACED[0], height_px=_TRACED[1])
    with gl_session(context, keeps_terms=True) as session:
        ours, covered = session.render(scene, small, fast)
        session.render(scene, None, fast)
        found = []
        for turn in range(2 * repeats):
            light = illuminant(LIGHTS[turn % len(LIGHTS)])
            found.append(_timed(lambda one=light: session.render_many(scene, None, fast, (one,))))
    halves, (_, seconds) = path_tracing.traced_twice(mitsuba, replace(scene, cameras=(small,)), matt, paths, 1)
    seen, white = covered.ravel() == 1.0, scene.adopted_white()
    halves = np.maximum(halves[:, seen], 0.0)
    noise = float(np.percentile(delta_e_xyz(halves[0], halves[1], white), 95.0)) / 2.0**0.5
    off = delta_e_xyz(halves.mean(axis=0), np.maximum(ours.reshape(-1, 3)[seen].astype(np.float64), 0.0), white)
    needed = paths * (noise / AIMED_DELTA_E) ** 2
    theirs = seconds / paths / (_TRACED[0] * _TRACED[1]) * needed * width * height
    own = float(np.median(found, axis=0)[1])
    return {
        "ours_ms": 1e3 * own,
        "theirs_ms": 1e3 * theirs,
        "faster": theirs / own,
        "paths": round(needed),
        "delta_e94_p95": float(np.percentile(off, 95.0)),
        "noise_p95": noise / 2.0**0.5,
    }


def _switched(
    frame: Frame, session: Session, size: tuple[int, int], count: int, fast: Mapping[str, Fast]
) -> dict[str, Any]:
    """Lights, observers, materials, modes and cameras, one after the other, and what they leave behind."""
    rng, errors, missing = np.random.default_rng(0), 0, 0
    before, first = 0.0, session
    frame.show(first, size)
    frame.settle()
    context = frame.texture.ctx if frame.texture is not None else None
    assert context is not None
    warm = max(1, count // 5)
    for number in range(count + warm):
        if number == warm:
            before = _resident_mb(frame, first, size)
        session = _other(session, rng, sorted(fast))
        frame.show(session, size, moving=bool(rng.random() < 0.2))
        if rng.random() < 0.25:
            frame.settle()
        else:
            frame.step(0.0)
        errors += context.error != "GL_NO_ERROR"
        if number % 20 == 0:
            missing += int(sum(np.count_nonzero(~np.isfinite(read(one))) for one in frame.canvases))
    return {
        "count": count,
        "memory_mb": _resident_mb(frame, first, size) - before,
        "gl_errors": errors,
        "nan_pixels": missing,
    }


def _other(session: Session, rng: np.random.Generator, materials: Sequence[str]) -> Session:
    kind = rng.integers(6)
    if kind == 0:
        return replace(session, light=LightChoice.named(LIGHTS[int(rng.integers(len(LIGHTS)))]))
    if kind == 1:
        return replace(session, observer=OBSERVERS[int(rng.integers(2))])
    if kind == 2:
        return session.wearing("shape", materials[int(rng.integers(len(materials)))])
    if kind == 3:
        other = replace(session.other, material=(None, *materials)[int(rng.integers(len(materials) + 1))])
        return replace(session, other=other)
    if kind == 4:
        modes = ("A", "B", "wipe", "side by side", "checkerboard", "difference")
        return replace(session, compare=replace(session.compare, mode=modes[rng.integers(len(modes))]))
    return replace(session, view=orbited(session.view, float(rng.uniform(-20.0, 20.0))))


def _resident_mb(frame: Frame, session: Session, size: tuple[int, int]) -> float:
    """Return the memory of this process while a session is shown, without what it has freed: the least of some
    readings, since a picture's windows, which are kept, are as large as the machine happens to draw in time.
    """
    # glibc keeps freed memory, tens of megabytes more or fewer at any time; other C libraries have no such call.
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    found = []
    for _ in range(_READINGS):
        for one in (replace(session, view=orbited(session.view, _STEP_DEG)), session):
            frame.show(one, size)
            frame.settle()
        gc.collect()
        if trim is not None:
            trim(0)
        found.append(int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]))
    return min(found) * 4096 / 2**20


def _percentiles(seconds: Sequence[Took]) -> dict[str, float]:
    clock, processor = 1e3 * np.array(seconds).T
    p50, p95 = np.percentile(clock, (50.0, 95.0))
    return {
        "p50_ms": float(p50),
        "p95_ms": float(p95),
        "max_ms": float(clock.max()),
        "processor_ms": float(np.median(processor)),
        "processor_max_ms": float(processor.max()),
    }


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people."""
    width, height = measured["pixels"]
    title = (
        f"{width} x {height} pixels, {measured['samples']} x {measured['samples']} samples, "
        f"{measured['triangles']:,} triangles, {measured['renderer']}"
    )
    rows = [
        [name, *(f"{found[key]:.0f}" for key in ("p50_ms", "p95_ms", "max_ms", "processor_ms", "processor_max_ms"))]
        for name, found in measured["rows"].items()
    ]
    left = measured["switches"]
    figures = [
        ["a fold, share of render()", f"{measured['fold_share']:.3f}"],
        ["a fold, ms of the thread that draws", f"{measured['cpu_ms']:.1f}"],
        ["a moving frame, share of render() of another camera", f"{measured['moving_share']:.3f}"],
        ["a moving frame, ΔE94 p95 from the exact picture", f"{measured['moving_delta_e94_p95']:.3f}"],
        [f"MB after {left['count']} switches", f"{left['memory_mb']:+.1f}"],
        ["GL errors, pixels without a number", f"{left['gl_errors']}, {left['nan_pixels']}"],
    ]
    if (beside := measured["mitsuba"]) is not None:
        words = f"another light, times faster than Mitsuba's {beside['paths']:,} paths a pixel (ΔE94 p95 1)"
        figures.append([words, f"{beside['faster']:,.0f}"])
        own = f"{beside['delta_e94_p95']:.2f} ({beside['noise_p95']:.2f} of it noise)"
        figures.append(["that light, ΔE94 p95 from Mitsuba's", own])
    return [(title, ["", "p50 ms", "p95", "max", "processor p50", "max"], rows), ("Of those", ["", ""], figures)]


def report(measured: dict) -> str:
    """Return the result of `run` as plain text."""
    return text_tables(tables(measured))
