"""Looking: the mouse, keys, light, observer, adaptation, and the picture that follows."""

import numpy as np
from metamer.viewer.window.canvas_renderer import Quality
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.shell.style import TEXT


def check_a_picture_comes_and_becomes_exact(it):
    it.settled()
    codes = it.picture()
    assert codes.shape == (*it.window.size[::-1], 3) and min(it.window.size) > 200
    assert codes.std() > 5


def check_a_click_changes_the_light_and_the_picture(it):
    before = it.picture().astype(int)
    it.click("Top/A##light")
    assert it.session.light == LightChoice.named("A")
    it.settled()
    assert np.abs(it.picture() - before).mean() > 0.5
    it.click("Top/Own##light")
    assert it.session.light == LightChoice()


def check_keys_change_light_observer_and_exposure(it):
    it.key("3")
    assert it.session.light == LightChoice.named("A")
    it.key("1")
    it.key("O")
    assert it.session.observer == "1964_10"
    it.key("Shift+O")
    it.key("E")
    assert it.session.exposure == 0.5
    it.key("Shift+E")
    it.key("K")
    assert it.session.adaptation.degree == 0.0
    it.key("K")
    assert 0.0 < it.session.adaptation.degree < 1.0
    it.key("R")
    assert it.session.adaptation.degree == 1.0 and it.session.exposure == 0.0


def check_undo_takes_back_what_was_done(it):
    it.click("Top/FL11##light")
    words = it.desk.history.undo_words
    it.key("Ctrl+Z")
    assert it.session.light == LightChoice() and words in it.said
    it.key("Ctrl+Y")
    assert it.session.light == LightChoice.named("FL11")
    it.key("Ctrl+Z")


def check_a_drag_orbits_and_is_one_step(it):
    it.settled()
    begun, steps = it.session.view, len(it.desk.history.past)
    it.point(0.5, 0.5)
    it.context.mouse_down(0)
    qualities = set()
    for _ in range(4):
        x, y = it.context.ui_context.io.mouse_pos if hasattr(it.context.ui_context, "io") else (0, 0)
        it.context.mouse_move_to_pos((x + 12, y + 4))
        it.frames(1)
        qualities.add(it.frame.quality)
    it.context.mouse_up(0)
    it.frames(3)
    assert it.session.view.position != begun.position and it.session.view.target == begun.target
    assert len(it.desk.history.past) == steps + 1
    assert Quality.MOVING in qualities
    it.settled()
    it.key("Ctrl+Z")
    assert it.session.view == begun


def check_the_wheel_zooms_and_the_right_button_pans(it):
    begun = it.session.view
    it.point(0.5, 0.5)
    it.context.mouse_wheel_y(2.0)
    it.frames(2)
    assert it.session.view.distance < begun.distance
    place = it.point(0.5, 0.5)
    it.context.mouse_down(1)
    it.context.mouse_move_to_pos((place[0] + 30, place[1]))
    it.context.mouse_up(1)
    it.frames(2)
    assert it.session.view.target[0] < 0.0
    it.key("Home")
    assert it.session.view.position == begun.position


def check_arrows_orbit_and_f_frames(it):
    begun = it.session.view
    it.key("Left")
    assert it.session.view.position != begun.position
    it.key("F")
    it.key("PageDown")
    assert it.session.view.name == "above"
    it.key("PageUp")
    assert it.session.view.name == "front"


def check_the_turntable_turns_and_leaves_no_steps(it):
    steps = len(it.desk.history.past)
    it.key("T")
    view = it.session.view
    it.frames(6)
    assert it.session.view != view
    it.key("T")
    assert it.session.turntable_deg_s == 0.0 and len(it.desk.history.past) == steps + 2
    it.key("Home")


def check_the_panels_are_grey_in_both_interfaces(it):
    from imgui_bundle import imgui

    for interface in ("light", "dark"):
        it.click("Left/Light panels" if interface == "light" else "Left/Dark panels")
        assert it.session.interface == interface
        it.frames(2)
        colours = [imgui.get_style().color_(number) for number in range(int(imgui.Col_.count))]
        assert all(max(one.x, one.y, one.z) - min(one.x, one.y, one.z) < 0.01 for one in colours)
        assert abs(colours[imgui.Col_.check_mark].x - colours[imgui.Col_.checkbox_selected_bg].x) > 0.4
        # The words of a slider stand on what it is dragged by.
        words = colours[imgui.Col_.text].x
        for grab in (imgui.Col_.slider_grab, imgui.Col_.slider_grab_active):
            assert abs(colours[grab].x - words) > 0.4
    assert imgui.get_style().grab_min_size < 0.5 * TEXT


def check_tab_hides_panels_and_the_picture_fills_the_window(it):
    it.settled()
    small = it.window.size
    it.key("Tab")
    it.frames(3)
    assert it.window.size[0] > small[0] and it.window.size[1] > small[1]
    it.key("Tab")
    it.frames(2)
    assert it.window.size == small


def check_an_unknown_lamp_is_said_and_the_picture_stays(it):
    it.settled()
    before = it.picture()
    it.type("Left/##lamp", "D650")
    it.frames(3)
    assert "D650" in it.said and "D65" in it.said
    np.testing.assert_array_equal(it.picture(), before)
    it.key("Ctrl+Z")
    it.frames(2)
    assert not any(one.problem for one in it.desk.notices)
