"""Comparing: every mode, the flick, the ΔE map with its scale and contour; materials, observers and lights on B."""

from dataclasses import replace

import numpy as np
from metamer.calibration.report.plots import OVER_RGB
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.gl.tile import read
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.state import MODES, Adaptation
from PIL import Image

WORDS = {"wipe": "Wipe", "side by side": "Side by side", "checkerboard": "Checker"}


def compare(it, mode):
    it.choose("Top/##compare", f"{WORDS.get(mode, mode)}##{mode}")


def alone(it, side):
    compare(it, side)
    it.settled()
    return it.picture().astype(int)


def check_a_material_is_put_on_b(it):
    it.settled()
    it.context.key_down(int(shift()))
    it.pick("copper##tiny copper")
    it.context.key_up(int(shift()))
    it.frames(2)
    assert it.session.other.material == "tiny/copper"
    assert it.session.material_of("body") is None


def shift():
    from imgui_bundle import imgui

    return imgui.Key.mod_shift


def check_sides_alone_differ_where_the_body_is(it):
    first, second = alone(it, "A"), alone(it, "B")
    height, width = first.shape[:2]
    middle = np.abs(first - second)[height // 3 : height // 2, width // 2 - 20 : width // 2 + 20]
    assert middle.mean() > 5 and np.abs(first - second)[:4].max() == 0


def check_wipe_side_by_side_and_checkerboard_lay_them_as_they_say(it):
    first, second = alone(it, "A"), alone(it, "B")
    height, width = first.shape[:2]
    compare(it, "wipe")
    it.settled()
    codes, line = it.picture().astype(int), round(0.5 * width)
    np.testing.assert_array_equal(codes[:, :line], first[:, :line])
    np.testing.assert_array_equal(codes[:, line:], second[:, line:])
    compare(it, "side by side")
    it.settled()
    codes, half = it.picture().astype(int), width // 2
    off = (width - half) // 2
    np.testing.assert_array_equal(codes[:, :half], first[:, off : off + half])
    np.testing.assert_array_equal(codes[:, half : 2 * half], second[:, off : off + half])
    compare(it, "checkerboard")
    it.settled()
    codes, cell = it.picture().astype(int), max(1, round(it.session.compare.cell * height))
    rows, columns = np.indices((height, width)) // cell
    odd = ((rows ^ columns) & 1).astype(bool)
    np.testing.assert_array_equal(codes[odd], second[odd])
    np.testing.assert_array_equal(codes[~odd], first[~odd])


def check_a_held_key_flicks(it):
    from imgui_bundle import imgui

    compare(it, "A")
    it.settled()
    before, steps = it.picture(), len(it.desk.history.past)
    it.context.key_down(int(imgui.Key.space))
    it.frames(3)
    assert it.session.flicked and it.session.seen == "B"
    assert np.abs(it.picture().astype(int) - before).max() > 5
    it.context.key_up(int(imgui.Key.space))
    it.frames(3)
    assert not it.session.flicked and len(it.desk.history.past) == steps
    np.testing.assert_array_equal(it.picture(), before)


def check_the_line_of_the_wipe_is_dragged(it):
    compare(it, "wipe")
    it.settled()
    view, steps = it.session.view, len(it.desk.history.past)
    x, y = it.point(0.5, 0.6)
    it.context.mouse_down(0)
    it.context.mouse_move_to_pos((x + 50, y))
    it.context.mouse_up(0)
    it.frames(2)
    assert 0.55 < it.session.compare.position < 0.75 and it.session.view == view
    assert len(it.desk.history.past) == steps + 1


def check_keys_go_through_the_modes(it):
    for key, mode in zip(("A", "B", "W", "S", "C", "D"), MODES, strict=True):
        it.key(key)
        assert it.session.compare.mode == mode


def check_the_map_is_that_of_numpy_and_is_counted(it):
    it.key("D")
    it.settled()
    it.frames(3)
    found, over = it.window.statistics
    first, second = it.on_gpu(lambda: [read(one).astype(float) for one in it.frame.canvases])
    both = (first[..., 3] == 1.0) & ((first[..., :3] != 0).any(-1) | (second[..., :3] != 0).any(-1))
    off = delta_e_xyz(first[both][:, :3], second[both][:, :3], it.frame.whites[0])
    assert abs(found.mean - off.mean()) < 1e-3 and abs(found.p95 - np.percentile(off, 95)) < 0.02
    assert abs(over - (off > it.session.compare.tolerance).mean()) < 1e-3


def check_the_scale_has_the_colour_of_what_is_beyond_its_end(it):
    it.desk.do(lambda session: replace(session, compare=replace(session.compare, scale=100.0)), "Scale")
    it.settled()
    beyond = np.array(OVER_RGB)
    assert not (it.picture() == beyond).all(axis=-1).any()
    it.capture("map.png")
    seen = np.asarray(Image.open("map.png").convert("RGB")).astype(int)
    assert (np.abs(seen - beyond).max(axis=-1) <= 2).sum() > 30
    it.key("Ctrl+Z")


def check_formula_tolerance_and_contour_are_set(it):
    mean = it.window.statistics[0].mean
    it.choose("Left/##formula", "ΔE CIE 2000##CIE 2000")
    it.settled()
    it.frames(3)
    assert it.session.compare.formula == "CIE 2000" and it.window.statistics[0].mean != mean
    over = it.window.statistics[1]
    it.key("]")
    it.frames(3)
    assert it.session.compare.tolerance > 1.0 and it.window.statistics[1] <= over
    before = it.picture()
    it.click("Left/contour at the tolerance")
    it.frames(3)
    assert not it.session.compare.contour and np.abs(it.picture().astype(int) - before).max() > 0


def check_lights_and_observers_part_the_sides(it):
    it.key("Shift+3")
    assert it.session.other.light == LightChoice.named("A")
    it.choose("Left/##other observer", "1964 10°##1964_10")
    assert it.session.other.observer == "1964_10"
    it.settled()
    assert np.abs(it.frame.whites[0] - it.frame.whites[1]).max() > 0.1
    it.key("X")
    assert it.session.light == LightChoice.named("A") and it.session.material_of("body") == "tiny/copper"
    it.settled()
    it.click("Left/B as A")
    it.key("A")
    it.frames(3)
    assert it.window.statistics[0] is None


def check_the_palette_finds_and_does(it):
    it.key("Ctrl+Shift+P")
    it.frames(3)
    assert it.desk.dialog == "palette"
    it.context.key_chars("light fl2")
    it.frames(3)
    from imgui_bundle import imgui

    it.context.key_press(int(imgui.Key.enter))
    it.frames(3)
    assert it.desk.dialog is None and it.session.light == LightChoice.named("FL2")


def check_help_lists_every_key(it):
    it.key("?")
    it.frames(3)
    assert it.desk.dialog == "help"
    from imgui_bundle import imgui

    it.context.key_press(int(imgui.Key.escape))
    it.frames(3)
    assert it.desk.dialog is None


def check_help_is_closed_by_the_keys_that_open_it(it):
    for key in ("?", "H", "F1"):
        it.desk.dialog = None
        it.frames(2)
        it.key(key)
        assert it.desk.dialog == "help"
        it.frames(2)
        it.key(key)
        assert it.desk.dialog is None


def check_the_adaptation_in_use_is_marked(it):
    from metamer.viewer.window.shell.panels import display

    for degree, name in ((1.0, "Full"), (0.0, "None"), (0.6, "Incomplete")):
        it.desk.do(lambda session, d=degree: replace(session, adaptation=Adaptation(degree=d)), "adaptation")
        real, chosen = display.button, []
        display.button = lambda label, on, style, found=chosen: found.append(label) if on else None
        try:
            it.frames(2)
        finally:
            display.button = real
        assert set(chosen) == {f"{name}##adaptation"}
