"""Frames from session to session: no more is done than changes ask for, and what settles is the headless picture."""

import time
from dataclasses import fields, replace

import numpy as np
import pytest
from icc_profiles import DULL, old_tables
from metamer.runtime.errors import UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.gl.backend import GLBackend, gl_session
from metamer.viewer.gl.live import LiveSession
from metamer.viewer.gl.tile import read
from metamer.viewer.render import geometry
from metamer.viewer.window import canvas_renderer
from metamer.viewer.window.canvas_readback import read_codes
from metamer.viewer.window.canvas_renderer import Quality
from metamer.viewer.window.choices import opened
from metamer.viewer.window.coarseness import Coarseness
from metamer.viewer.window.display_pass import STRIPE
from metamer.viewer.window.frame import Frame
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.picture_statistics import mark_beyond
from metamer.viewer.window.queries import Asking, beyond
from metamer.viewer.window.sides import SessionObjects
from metamer.viewer.window.state import Compare, DisplaySettings, Other, Session, Subject
from metamer.viewer.window.viewpoint import orbited
from metamer.viewer.window.work import WORK_OF, Work, work
from patience import patient

SIZE = 40, 30


class Shelf:
    """A catalogue in memory."""

    def __init__(self, surfaces):
        self._surfaces = surfaces

    def surface(self, name):
        if name not in self._surfaces:
            raise UnknownNameError("material", name, self._surfaces)
        return Drawn(self._surfaces[name])

    def ids(self):
        return tuple(self._surfaces)


class Drawn:
    def __init__(self, fast):
        self._fast = fast

    def drawn(self):
        return self._fast


@pytest.fixture
def scene(scenes):
    return scenes.lamp_scene(size=40)


@pytest.fixture
def session(scene):
    return opened(scene, Subject(path="lamp.toml"), part="part0")


@pytest.fixture
def frame(gl, scene, scenes):
    made = Frame(gl, SessionObjects(scene, Shelf(scenes.SURFACES)))
    yield made
    made.release()


def counted(monkeypatch, holder, name):
    calls, real = [], getattr(holder, name)

    def counting(*args, **kwargs):
        calls.append(args)
        return real(*args, **kwargs)

    monkeypatch.setattr(holder, name, counting)
    return calls


def headless(gl, frame, number=0):
    side = frame.sides[number]
    with gl_session(gl) as once:
        return once.render_many(side.scene, frame.camera, side.surfaces, (side.illuminant,))[0]


def assert_as_headless(gl, frame, number=0):
    xyz, coverage = headless(gl, frame, number)
    found = read(frame.canvases[number])
    off = np.abs(found[..., :3] - xyz).max(axis=-1)
    assert (off > 0.002).mean() <= 1e-4, off.max()
    assert np.abs(found[..., 3] - coverage).max() <= 1.01 / frame.camera.samples**2
    assert (found[..., 3] != coverage).mean() <= 1e-2


def test_every_field_of_a_session_says_what_it_asks_for():
    assert set(WORK_OF) == {one.name for one in fields(Session)}


def test_what_a_change_asks_for():
    now = Session()
    asked = {
        Work.NOTHING: [{"cursor": (0.5, 0.5)}, {"interface": "light"}, {"turntable_deg_s": 30.0}],
        Work.SHOW: [{"compare": Compare("wipe")}, {"exposure": 1.0}, {"flicked": True}, {"surround": 20.0}],
        Work.FOLD: [{"light": LightChoice.named("A")}, {"observer": "1964_10"}, {"light": LightChoice(dimming=0.5)}],
        Work.TERMS: [{"other": Other(material="a/b")}],
        Work.VIEW: [{"view": orbited(now.view, 10.0)}, {"samples": 1}],
        Work.GEOMETRY: [
            {"light": LightChoice(rotation_deg=10.0)},
            {"other": Other(light=LightChoice(rotation_deg=1.0))},
        ],
    }
    for wanted, changes in asked.items():
        for change in changes:
            assert work(now, replace(now, **change)) == wanted, change
    assert work(None, now) == Work.GEOMETRY and work(now, now) == Work.NOTHING


def test_what_settles_is_what_the_headless_renderer_draws(gl, frame, session):
    session = replace(session.wearing("part0", "sharp"), other=Other(material="brushed", light=LightChoice.named("A")))
    assert frame.show(session, SIZE) == Work.GEOMETRY
    assert frame.quality == Quality.MOVING
    seen = [frame.quality]
    while frame.step(0.0):
        seen.append(frame.quality)
    assert seen == sorted(seen) and frame.quality == Quality.EXACT and frame.reached == 1.0
    for number in (0, 1):
        assert_as_headless(gl, frame, number)


def test_windows_that_are_done_soon_are_drawn_anew_in_larger_ones(gl, scene, scenes, session, monkeypatch):
    monkeypatch.setattr(canvas_renderer, "_SIDES", (12, 2048))
    ticks = iter(range(1_000_000))
    frame = Frame(gl, SessionObjects(scene, Shelf(scenes.SURFACES)), clock=lambda: 0.002 * next(ticks))
    try:
        frame._side = dict.fromkeys(frame._side, 12)
        drawn = counted(monkeypatch, LiveSession, "_draw_piece")
        frame.show(session, SIZE)
        frame.settle()
        still, exact = 3 * 4, 8 * 10
        assert len(drawn) < 0.5 * (still + exact) and frame._side[Quality.EXACT] > 24
        assert_as_headless(gl, frame)
        # Another light folds what the larger windows have left.
        drawn.clear()
        frame.show(replace(session, light=LightChoice.named("A")), SIZE)
        assert frame.quality == Quality.EXACT and not drawn
        assert_as_headless(gl, frame)
    finally:
        frame.release()


def test_one_window_that_the_machine_was_busy_in_makes_no_others_small():
    assert canvas_renderer._fitting_side(256, [0.04] * 9 + [1.0]) == 256
    assert canvas_renderer._fitting_side(256, [0.01]) == 512 and canvas_renderer._fitting_side(400, [0.16]) == 200


def test_every_way_to_an_exact_picture_ends_at_the_same_one(gl, frame, session):
    frame.show(session, SIZE)
    frame.settle()
    for change in (
        lambda s: replace(s, light=LightChoice.named("FL11")),
        lambda s: s.wearing("part0", "brushed"),
        lambda s: replace(s, view=orbited(s.view, 25.0)),
        lambda s: replace(s, observer="1964_10", samples=2),
        lambda s: replace(s, light=LightChoice.named("A")),
        lambda s: replace(s, other=Other(material="sharp")),
    ):
        session = change(session)
        frame.show(session, SIZE)
        frame.settle()
        assert_as_headless(gl, frame)
    assert_as_headless(gl, frame, 1)


@pytest.mark.parametrize(("most", "scenes_built"), [(10**6, 1), (300, 2)])
def test_only_the_first_of_many_cameras_builds_geometry(frame, session, monkeypatch, most, scenes_built):
    monkeypatch.setattr("metamer.viewer.window.sides.MOVING_TRIANGLES", most)
    triangles, grids = counted(monkeypatch, geometry, "_triangles"), counted(monkeypatch, geometry, "shadow_grid")
    for turn in range(6):
        session = replace(session, view=orbited(session.view, 5.0))
        frame.show(session, SIZE, moving=turn < 5)
        frame.step()
    frame.settle()
    # Grids of the scene with fewer triangles, if that is another one, and of the scene itself: for two lights each.
    assert (len(triangles), len(grids)) == (scenes_built, 2 * scenes_built)


def test_lights_and_observers_of_an_exact_picture_are_a_fold(frame, session, monkeypatch):
    session = replace(session, other=Other(material="brushed"))
    frame.show(session, SIZE)
    frame.settle()
    terms, tiles = counted(monkeypatch, GLBackend, "terms"), counted(monkeypatch, GLBackend, "tile")
    for change in ({"light": LightChoice.named("A")}, {"observer": "1964_10"}, {"light": LightChoice(dimming=0.5)}):
        session = replace(session, **change)
        assert frame.show(session, SIZE) == Work.FOLD
        assert frame.quality == Quality.EXACT and not frame.step()
    assert not terms and not tiles


def test_showing_another_way_draws_nothing(frame, session, monkeypatch):
    session = replace(session, other=Other(material="brushed"))
    frame.show(session, SIZE)
    frame.settle()
    drawn = counted(monkeypatch, LiveSession, "drawing")
    for mode in ("B", "wipe", "side by side", "checkerboard", "difference"):
        session = replace(session, compare=replace(session.compare, mode=mode))
        assert frame.show(session, SIZE) == Work.SHOW and not frame.step()
    assert not drawn


def test_what_cannot_be_shown_is_said_and_what_was_seen_stays(gl, frame, session):
    frame.show(session, SIZE)
    frame.settle()
    before = read(frame.canvases[0])
    for wrong, words in (
        (replace(session, light=LightChoice.named("D650")), "D650"),
        (session.wearing("nose", "sharp"), "nose"),
        (session.wearing("part0", "unknown"), "unknown"),
        (replace(session, shown=replace(session.shown, view="Nowhere")), "Nowhere"),
    ):
        frame.show(wrong, SIZE)
        assert words in frame.problem
        frame.settle()
        np.testing.assert_array_equal(read(frame.canvases[0]), before)
    frame.show(replace(session, light=LightChoice.named("A")), SIZE)
    assert frame.problem is None


def test_lights_turned_apart_give_each_side_its_own_shadows(gl, frame, session):
    session = replace(session, other=Other(light=LightChoice(rotation_deg=60.0)))
    frame.show(session, SIZE)
    frame.settle()
    for number in (0, 1):
        assert_as_headless(gl, frame, number)
    assert np.abs(read(frame.canvases[0]) - read(frame.canvases[1])).max() > 0.1


def test_a_moving_picture_is_near_the_exact_one(gl, scene, scenes, session, monkeypatch):
    """Of fewer triangles, at one sample a pixel and as many pixels."""
    monkeypatch.setattr("metamer.viewer.window.sides.MOVING_TRIANGLES", 4000)
    monkeypatch.setattr(Coarseness, "took", lambda self, seconds: None)
    frame = Frame(gl, SessionObjects(scene, Shelf(scenes.SURFACES)))
    frame._coarseness.pixels = 1
    try:
        frame.show(replace(session, samples=1), SIZE, moving=True)
        frame.step()
        found = read(frame.canvases[0])
        xyz, coverage = headless(gl, frame)
        both = (found[..., 3] == 1.0) & (coverage == 1.0)
        off = delta_e_xyz(xyz[both].astype(float), found[both][:, :3].astype(float), frame.whites[0])
        assert both.mean() > 0.9 * (coverage == 1.0).mean() and np.percentile(off, 75) < 1.0
    finally:
        frame.release()


@pytest.mark.slow
def test_sizes_of_one_pixel_and_others_follow_each_other(frame, session):
    for size in ((1, 1), SIZE, (7, 3), (1, 40)):
        frame.show(session, size)
        frame.settle()
        assert frame.texture.size == size and np.isfinite(read(frame.canvases[0])).all()


@pytest.mark.parametrize("mode", ["B", "wipe", "side by side", "checkerboard", "difference", "A, proofed"])
def test_pixels_that_are_sent_alone_are_those_of_the_whole_picture(frame, session, monkeypatch, mode):
    """After every window of a picture that settles."""
    monkeypatch.setattr(canvas_renderer, "_SIDES", (24, 24))
    frame._side = dict.fromkeys(frame._side, 24)
    mode, _, proofed = mode.partition(", ")
    shown = DisplaySettings(proof="Rec.1886 Rec.709 - Display", gamut_warning=True) if proofed else DisplaySettings()
    frame.show(replace(session, other=Other(material="brushed"), compare=Compare(mode), shown=shown), SIZE)
    assert frame.problem is None
    steps = 0
    while frame.step(0.0):
        steps += 1
        alone = read_codes(frame.texture)
        frame._to_show = True
        frame._show_now(frame.session)
        np.testing.assert_array_equal(read_codes(frame.texture), alone)
    assert steps > 20


def test_a_window_sends_its_own_pixels_alone(frame, session, monkeypatch):
    sent = []
    compare, real = frame._showing._compare["ONE"], frame._showing._compare["ONE"].draw
    monkeypatch.setattr(compare, "draw", lambda *words: sent.append(words[-1]) or real(*words))
    monkeypatch.setattr(canvas_renderer, "_SIDES", (24, 24))
    frame._side = dict.fromkeys(frame._side, 24)
    frame.show(session, SIZE)
    frame.step(0.0)
    first = sent.copy()
    frame.settle()
    assert first == [(0, 0, *SIZE)] and max(width * height for *_, width, height in sent[1:]) == 24**2
    # Each pixel of a still picture once, then each of the exact one.
    assert sum(width * height for *_, width, height in sent[1:]) == 2 * SIZE[0] * SIZE[1]


def test_statistics_wait_for_the_exact_picture_and_are_those_of_the_map(gl, frame, session):
    session = replace(session, other=Other(material="brushed"), compare=Compare("difference", tolerance=2.0))
    frame.show(session, SIZE)
    assert frame.statistics() == (None, 0.0)
    frame.settle()
    found, over = frame.statistics()
    first, second = (read(one)[..., :3].astype(float) for one in frame.canvases)
    coverage = read(frame.canvases[0])[..., 3]
    chosen = (coverage == 1.0) & ((first != 0.0).any(axis=-1) | (second != 0.0).any(axis=-1))
    off = delta_e_xyz(first, second, frame.whites[0])[chosen]
    assert found.pixels == chosen.sum()
    assert found.mean == pytest.approx(off.mean(), abs=1e-3) and over == pytest.approx((off > 2.0).mean(), abs=1e-3)
    frame.show(replace(session, compare=replace(session.compare, tolerance=50.0)), SIZE)
    assert frame.statistics()[1] < over


def test_whites_are_those_of_each_sides_light(frame, session):
    session = replace(session, other=Other(light=LightChoice.named("A"), observer="1964_10"))
    frame.show(session, SIZE)
    for white, light, who in zip(frame.whites, ("D65", "A"), ("1931_2", "1964_10"), strict=True):
        lit = frame.sides[0].scene.with_illuminant(illuminant(light)) if light == "A" else frame.sides[0].scene
        np.testing.assert_allclose(white, replace(lit, observer=observer(who)).adopted_white())


def test_the_display_follows_the_observer(frame, session):
    for who in ("1964_10", "1931_2", "2015_2"):
        frame.show(replace(session, observer=who), SIZE)
        assert frame.display.observer == who
    frame.step()
    assert frame.display.aimed_for == "1931_2"


def test_what_is_beyond_a_profile_is_marked_in_the_picture_that_stands_still(frame, session, tmp_path):
    (tmp_path / "dull.icc").write_bytes(old_tables(columns=DULL, name="Dull"))
    shown = DisplaySettings(display=f"icc:{tmp_path / 'dull.icc'}", gamut_warning=True)
    asking = Asking()
    try:

        def codes(now):
            frame.show(now, SIZE)
            frame.settle()
            plain = read_codes(frame.texture)
            mark_beyond(asking, frame, now, "seen")
            end = time.monotonic() + patient(30.0)
            while asking.busy():
                assert time.monotonic() < end, "what is beyond is not found"
                time.sleep(0.01)
                asking.poll()
            mark_beyond(asking, frame, now, "seen")
            frame.step()
            return plain, read_codes(frame.texture)

        # Darker by two stops, too: nothing of the picture before is marked.
        for stops in (0.0, -2.0):
            plain, marked = codes(replace(session, shown=shown, exposure=stops))
            found = beyond(read(frame.compared)[..., :3].copy(), frame.display)
            rows, columns = np.indices(found.shape)
            band = (rows + columns) // STRIPE % 4
            striped = ((found == 2) & (band == 0)) | ((found == 1) & (band == 2))
            np.testing.assert_array_equal((plain != marked).any(axis=-1), striped)
            assert striped.any()
        plain, marked = codes(replace(session, shown=replace(shown, gamut_warning=False)))
        np.testing.assert_array_equal(plain, marked)
    finally:
        asking.close()
