"""Viewpoints that pictures are taken from: the same views as the headless ones, and no way into a view that is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metamer.lighting.scene_file.files import load_scene, shipped_scene
from metamer.runtime.errors import InputError
from metamer.viewer.sheets.turntable import turntable_cameras as turned
from metamer.viewer.window.viewpoint import Viewpoint, framed, orbited, panned, zoomed
from window_sessions import viewpoints

FLAT = Viewpoint("flat", (0.0, 0.0, 4.0), projection="orthographic", extent=2.0)


def test_a_scene_s_camera_comes_back_from_its_viewpoint():
    camera = load_scene(shipped_scene("speed_shape")).camera()
    again = Viewpoint.of(camera).camera(camera.width, camera.height_px, camera.samples)
    np.testing.assert_array_equal(again.view_from_world(), camera.view_from_world())
    assert again.half_extent == camera.half_extent


def test_an_orbit_goes_round_as_the_turntable_does():
    camera = load_scene(shipped_scene("speed_shape")).camera()
    view = Viewpoint.of(camera)
    for number, wanted in enumerate(turned(camera, 12)):
        np.testing.assert_allclose(orbited(view, 30.0 * number).position, wanted.position, atol=1e-12)


@given(view=viewpoints(), right=st.floats(-1e4, 1e4), up=st.floats(-1e4, 1e4))
@settings(deadline=None)
def test_an_orbit_keeps_its_distance_and_never_reaches_the_pole(view, right, up):
    gone = orbited(view, right, up)
    assert gone.distance == pytest.approx(view.distance, rel=1e-9)
    gone.camera(4, 3)


def test_an_orbit_upwards_ends_short_of_the_pole_and_comes_back():
    top = orbited(Viewpoint(), 0.0, 1000.0)
    assert top.position[1] == pytest.approx(4.0, rel=1e-3) and abs(top.position[2]) > 0.0
    assert orbited(top, 0.0, -89.5).position == pytest.approx(Viewpoint().position, abs=1e-9)


@pytest.mark.parametrize("view", [Viewpoint(), FLAT], ids=lambda one: one.projection)
@pytest.mark.parametrize("aspect", [0.3, 1.0, 3.0])
def test_a_frame_has_every_corner_in_it_and_little_beside(view, aspect):
    low, high = (-3.0, 0.0, 1.0), (1.0, 2.0, 9.0)
    view = framed(orbited(view, 33.0, 21.0), low, high, aspect)
    corners = np.array([[x, y, z, 1.0] for x in (-3.0, 1.0) for y in (0.0, 2.0) for z in (1.0, 9.0)])
    clip = corners @ view.camera(round(300 * aspect), 300).clip_from_world().T
    reach = np.abs(clip[:, :2] / clip[:, 3:]).max()
    assert 0.5 < reach <= 1.0
    np.testing.assert_allclose(view.target, (-1.0, 1.0, 5.0))


@pytest.mark.parametrize("view", [Viewpoint(), FLAT], ids=lambda one: one.projection)
def test_a_zoom_makes_what_is_at_the_target_larger(view):
    assert zoomed(view, 2.0).height_at_target == pytest.approx(view.height_at_target / 2.0)
    assert zoomed(zoomed(view, 2.0), 0.5).height_at_target == pytest.approx(view.height_at_target)


def test_zooming_on_and_on_ends_with_a_camera_all_the_same():
    for factor in (10.0, 0.1):
        view = Viewpoint()
        for _ in range(40):
            view = zoomed(view, factor)
        view.camera(8, 8)


def test_what_is_panned_goes_across_the_picture_by_as_much():
    view = orbited(Viewpoint(), 30.0, 20.0)
    clip = panned(view, 0.25, 0.0).camera(100, 100).clip_from_world() @ [*view.target, 1.0]
    assert clip[0] / clip[3] == pytest.approx(-0.5) and clip[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("wrong", [{"up": (0.0, 0.0, 1.0)}, {"extent": 0.0}, {"position": (0.0, 0.0, 0.0)}])
def test_a_view_that_is_none_is_refused(wrong):
    with pytest.raises(InputError):
        Viewpoint(**wrong)
