"""While shadows of light from all around are worked out, rays at few pixels show them; what nobody sees breaks off."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.visibility import precompute, refinement
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.runtime.errors import MetamerError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.viewer.gl.side import CanvasSide
from metamer.viewer.gl.tile import read
from metamer.viewer.render import light_cache
from metamer.viewer.render.light_cache import LightCache
from metamer.viewer.window.canvas_renderer import Quality
from metamer.viewer.window.choices import opened
from metamer.viewer.window.first_picture import MOST_PIXELS, SAMPLES, first_pictures, first_size
from metamer.viewer.window.frame import Frame
from metamer.viewer.window.sides import SessionObjects
from metamer.viewer.window.state import Other, Subject
from metamer.viewer.window.view_error import Tracers
from metamer.viewer.window.viewpoint import Viewpoint, orbited
from patience import patient

from .test_frame import SIZE, Shelf, assert_as_headless

BOX = SoftboxLight(np.array([1.5, 3.0, 2.0]), np.zeros(3), 1.5, 1.0, illuminant("D65"), illuminance_lux=1000.0)


@pytest.fixture(autouse=True)
def nothing_kept(tmp_path, monkeypatch):
    """Other tests keep the visibility of the same meshes on disk."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.fixture
def scene(scenes):
    return replace(scenes.two_balls(), lights=(BOX,))


@pytest.fixture
def side(scene, scenes):
    return CanvasSide(scene, {name: scenes.SURFACES[name] for name in scene.material_ids})


@pytest.fixture
def session(scene):
    return opened(scene, Subject(path="balls.toml"), part="part0")


class SlowVisibility:
    """Visibility that says how far it is until it may end: then nothing hides anything, unless it is `real`."""

    def __init__(self):
        self.may_end, self.begun, self.broken_off = threading.Event(), 0, 0
        self.real = False

    def __call__(self, scene, folder, jobs, progress, say, before, seen, on_seen):
        self.begun += 1
        found = computed_visibility(scene, 1, progress, before, seen, on_seen) if self.real else None
        end = time.monotonic() + patient(50.0)
        try:
            while not self.may_end.wait(0.002):
                assert time.monotonic() < end
                progress(1, 4, "visibility")
        except MetamerError:
            self.broken_off += 1
            raise
        return found


@pytest.fixture
def slow(monkeypatch):
    made = SlowVisibility()
    monkeypatch.setattr(light_cache, "scene_visibility", made)
    # Fewer vertices of the floor, and fewer sites for the axes, than pictures have.
    monkeypatch.setattr(refinement, "MOST_VERTICES", 300)
    monkeypatch.setattr(precompute, "_TRAINING", 400)
    monkeypatch.setattr(light_cache, "SOON_SECONDS", 0.0)
    yield made
    made.may_end.set()


@pytest.fixture
def frame(gl, scene, scenes):
    made = Frame(gl, SessionObjects(scene, Shelf(scenes.SURFACES)))
    yield made
    made.release()


def steps(frame, until, seconds=40.0):
    """Work until something holds; the qualities on the way, each once."""
    seen, end = [frame.quality], time.monotonic() + patient(seconds)
    while not until():
        assert time.monotonic() < end
        frame.step(0.01)
        if frame.quality != seen[-1]:
            seen.append(frame.quality)
    return seen


@pytest.mark.parametrize("size", [(1200, 900), (333, 1000), (16000, 1), (1, 1)])
def test_a_first_picture_has_few_pixels_and_the_shape_of_the_view(size):
    width, height = first_size(*size)
    assert 1 <= width * height <= 1.02 * MOST_PIXELS + max(size)
    assert abs(width / height - size[0] / size[1]) < 0.02 * size[0] / size[1] or 1 in size


def test_it_is_the_reference_but_for_its_noise(side, monkeypatch):
    monkeypatch.setattr(light_cache, "SOON_SECONDS", 0.0)
    view = Viewpoint.of(side.scene.camera())
    dim = replace(side, dimming=0.25)
    one, other = first_pictures([side, dim], view, SIZE, Tracers(), LightCache())
    camera = view.camera(*SIZE, SAMPLES)
    truth = reference_images(side.scene, camera, side.surfaces)
    np.testing.assert_array_equal(one.coverage, truth.coverage.astype(np.float32))
    seen = truth.coverage == 1.0
    off = delta_e_xyz(truth.xyz[0][seen], one.xyz[seen].astype(float), side.white)
    assert 0.0 < off.mean() < 2.0 * (one.noise + max(truth.noise.mean))
    assert one.noise < 1.0
    # Drawn with other random numbers.
    assert other.xyz.sum() == pytest.approx(0.25 * one.xyz.sum(), rel=0.02)


def test_there_is_none_where_shadows_are_soon_worked_out(side, scenes, monkeypatch):
    def pictures(one):
        return first_pictures([one], Viewpoint.of(one.scene.camera()), SIZE, Tracers(), LightCache())

    monkeypatch.setattr(light_cache, "SOON_SECONDS", 1e6)
    assert pictures(side) == []
    monkeypatch.setattr(light_cache, "SOON_SECONDS", 0.0)
    assert len(pictures(side)) == 1
    # Nothing hides anything from a ball alone.
    ball = replace(scenes.sphere_scene(), lights=(BOX,))
    assert pictures(CanvasSide(ball, {"gloss": scenes.SURFACES["gloss"]})) == []
    monkeypatch.setattr(light_cache, "is_kept", lambda scene, folder, before: True)
    assert pictures(side) == []


def test_rays_come_first_and_the_exact_picture_last(gl, frame, session, slow):
    frame.show(session, SIZE)
    assert frame.quality == Quality.NONE
    assert steps(frame, lambda: slow.begun) == [Quality.NONE, Quality.FIRST]
    assert 0.0 < frame.noise < 1.0
    steps(frame, lambda: frame.shadowed)
    assert frame.shadowed == 0.25
    found = read(frame.canvases[0])
    assert found[..., 3].max() == pytest.approx(1.0) and found[..., 1].max() > 0.1
    slow.may_end.set()
    assert steps(frame, lambda: frame.quality == Quality.EXACT) == [Quality.FIRST, Quality.STILL, Quality.EXACT]
    assert_as_headless(gl, frame)


@pytest.mark.slow
def test_what_the_camera_sees_is_drawn_before_the_rest_is_worked_out(gl, frame, scene, session, slow):
    slow.real = True
    frame.show(session, SIZE)
    assert steps(frame, lambda: frame.quality == Quality.STILL) == [Quality.NONE, Quality.FIRST, Quality.STILL]
    found = read(frame.canvases[0])
    assert not slow.may_end.is_set()
    # Another material, light or observer is drawn with the same shadows.
    frame.show(replace(session, observer="1964_10"), SIZE)
    assert Quality.FIRST not in steps(frame, lambda: frame.quality == Quality.STILL)
    frame.show(session, SIZE)
    steps(frame, lambda: frame.quality == Quality.STILL)
    np.testing.assert_array_equal(read(frame.canvases[0]), found)
    # Another view may show what is not known yet: rays again, and nothing that is dark for that.
    light, other = scene.spread_lights[0], replace(session, view=orbited(session.view, 80.0, 0.0))
    assert frame._lights.seen_shadows(light, scene) is not None
    frame.show(other, SIZE, moving=True)
    assert frame._lights.seen_shadows(light, scene) is None
    frame.show(other, SIZE)
    steps(frame, lambda: frame.quality == Quality.FIRST)
    frame.show(session, SIZE)
    slow.may_end.set()
    frame.settle()
    assert frame.quality == Quality.EXACT
    assert_as_headless(gl, frame)
    exact = read(frame.canvases[0])
    both = (found[..., 3] == 1.0) & (exact[..., 3] == 1.0)
    off = delta_e_xyz(exact[both][:, :3].astype(float), found[both][:, :3].astype(float), frame.whites[0])
    # One sample a pixel beside nine.
    assert both.sum() > 400 and np.median(off) < 0.3 and np.percentile(off, 90) < 2.0


def test_lights_may_be_asked_for_while_shadows_are_worked_out(frame, scene, session, slow):
    """A moving camera does not wait for shadows."""
    sky = EnvironmentLight(np.ones((1, 8, 16)), (illuminant("D65"),), illuminance_lux=1000.0)
    under = replace(scene, lights=(sky,))
    frame.turn_to(SessionObjects(under, frame._sources.catalogue), session, SIZE)
    steps(frame, lambda: slow.begun)
    done = []
    asking = threading.Thread(target=lambda: done.append(frame._lights.gathered(sky, under)), daemon=True)
    asking.start()
    asking.join(20.0)
    assert done and not slow.may_end.is_set()


def test_both_sides_and_every_view_have_a_first_picture(frame, session, slow):
    session = replace(session, other=Other(material="matt"))
    frame.show(session, SIZE)
    steps(frame, lambda: slow.begun)
    first, second = (read(one) for one in frame.canvases)
    assert np.abs(first - second).max() > 0.05
    frame.show(replace(session, view=orbited(session.view, 40.0, 0.0)), SIZE, moving=True)
    assert frame.quality == Quality.MOVING
    turned = replace(session, view=orbited(session.view, 80.0, 0.0))
    frame.show(turned, SIZE)
    steps(frame, lambda: frame.quality == Quality.FIRST)
    assert np.abs(read(frame.canvases[0]) - first).max() > 0.05
    assert slow.begun == 1


def test_work_on_what_is_not_shown_any_more_breaks_off(frame, scene, scenes, session, slow):
    frame.show(session, SIZE)
    steps(frame, lambda: slow.begun)
    # The camera and the light may change: shadows are those of the meshes.
    frame.show(replace(session, view=orbited(session.view, 40.0, 0.0)), SIZE)
    steps(frame, lambda: frame.quality == Quality.FIRST)
    assert not slow.broken_off
    other = replace(scenes.sphere_scene(), parts=(*scenes.sphere_scene().parts, scene.parts[2]), lights=(BOX,))
    assert frame.turn_to(SessionObjects(other, Shelf(scenes.SURFACES)), opened(other, Subject(path="ball.toml")), SIZE)
    steps(frame, lambda: slow.begun == 2)
    assert slow.broken_off == 1 and frame.problem is None
    frame.release()
    assert slow.broken_off == 2
