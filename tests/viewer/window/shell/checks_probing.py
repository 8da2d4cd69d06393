"""Probing: numbers under the pointer, spectra, pins that stay on their surfaces, regions; copied and written."""

from pathlib import Path

import numpy as np
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.gl.tile import read
from metamer.viewer.window.displayed_value import displayed
from metamer.viewer.window.shell.actions import rate


def check_the_pointer_reads_what_the_canvas_holds(it):
    it.settled()
    it.point(0.5, 0.45)
    it.settled()
    column, row = it.window.pointer
    xyz = it.on_gpu(lambda: read(it.frame.canvases[0]).astype(float))[row, column]
    np.testing.assert_allclose(it.window.read[0].xyz, xyz[:3], rtol=1e-6)
    codes = it.picture()[row, column]
    assert np.abs(np.array(it.window.read[0].shown.codes) - codes).max() <= 1


def check_spectra_are_those_of_the_surface_and_agree_with_the_picture(it):
    it.wait(lambda: it.window.probing.cursor is not None, "spectra")
    spot = it.window.probing.cursor
    assert spot.pixel == it.window.pointer and spot.readings[0].parts == ("body",)
    assert spot.readings[0].materials == ("tiny/satin-green",)
    off = delta_e_xyz(it.window.read[0].xyz, spot.readings[0].xyz, spot.readings[0].white)
    assert off < 0.05
    spectra = spot.readings[0].spectra
    assert spectra.made_of == "original data" and 490 < spectra.wavelengths_nm[np.argmax(spectra.reflectance)] < 570


def check_kinds_of_spectra_are_chosen(it):
    for label, kind in (("what arrives", "incident"), ("what leaves", "reflected"), ("reflectance", "reflectance")):
        it.choose("Right/##spectrum", f"{label}##{kind}")
        assert it.window.kept.spectrum == kind


def check_a_pin_stays_on_its_surface(it):
    it.point(0.5, 0.45)
    it.settled()
    xyz = it.window.read[0].xyz
    it.key("P")
    it.wait(lambda: len(it.session.pins) == 1, "a pin")
    assert it.session.pins[0].part == "body"
    it.settled()
    it.wait(lambda: len(it.window.probing.pins) == 1, "what the pin reads")
    spot = it.window.probing.pins[0]
    assert delta_e_xyz(xyz, spot.readings[0].xyz, spot.readings[0].white) < 1.0
    it.key("Left")
    it.settled()
    it.wait(lambda: it.window.probing.pins[0].pixel != spot.pixel, "the pin elsewhere")
    it.key("Home")
    it.settled()


def check_shift_and_a_click_pin_too(it):
    from imgui_bundle import imgui

    it.point(0.4, 0.85)
    it.context.key_down(int(imgui.Key.mod_shift))
    it.context.mouse_click(0)
    it.context.key_up(int(imgui.Key.mod_shift))
    it.wait(lambda: len(it.session.pins) == 2, "a second pin")
    assert it.session.pins[1].part == "floor" and not it.session.flicked


def check_a_region_is_drawn_and_read(it):
    from imgui_bundle import imgui

    x, y = it.point(0.45, 0.4)
    it.context.key_down(int(imgui.Key.mod_ctrl))
    it.context.mouse_down(0)
    it.context.mouse_move_to_pos((x + 30, y + 20))
    it.context.mouse_up(0)
    it.context.key_up(int(imgui.Key.mod_ctrl))
    it.settled()
    it.frames(3)
    (region,) = it.session.regions
    rows, columns = region.pixels(*it.window.shown_size)
    xyz = it.on_gpu(lambda: read(it.frame.canvases[0]).astype(float))[rows, columns, :3].mean(axis=(0, 1))
    np.testing.assert_allclose(it.window.regions["region 1"][0].xyz, xyz, rtol=1e-5)


def check_probes_are_copied_and_written(it):
    from imgui_bundle import imgui

    it.tab("Pins")
    it.wait(lambda: len(it.window.probing.pins) == 2, "both pins")
    it.click("Right/tabs/Pins/Copy")
    text = imgui.get_clipboard_text()
    assert "pin 1" in text and "tiny/satin-green" in text and "L*" in text
    it.click("Right/tabs/Pins/CSV...")
    it.frames(2)
    it.type("Dialog/##file", "probes")
    it.click("Right/tabs/Pins/CxF...")
    it.frames(2)
    it.type("Dialog/##file", "probes")
    rows = Path("probes.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) >= 3 and rows[0].startswith("probe,") and "pin 2" in rows[-1]
    assert "CxF" in Path("probes.cxf").read_text(encoding="utf-8")[:500]


def check_readings_of_the_view_before_are_none(it):
    """While the view changes, pins have no numbers, nothing is copied, nothing is judged, and a note holds none."""
    from imgui_bundle import imgui

    it.settled()
    it.point(0.5, 0.45)
    it.wait(lambda: it.window.probing.fresh("pins", it.window.view), "the pins")
    lightness = f"{it.window.probing.pins[0].readings[0].lab[0]:.2f}"
    assert lightness in it.words()
    imgui.set_clipboard_text("before")
    x, y = it.point(0.5, 0.45)
    it.context.mouse_down(0)
    it.context.mouse_move_to_pos((x + 60, y))
    it.frames(1)
    assert it.window.moving
    words = it.words()
    assert "being read" in words and lightness not in words
    it.desk.run("probe.copy")
    it.desk.run("rate.approved")
    assert imgui.get_clipboard_text() == "before" and "still being read" in it.said
    assert not it.session.ratings and "judge no colour by it" in it.said
    rate(it.window, "open", note="later")
    assert it.session.ratings[-1].probed == ()
    it.context.mouse_up(0)
    it.frames(2)
    for _ in range(2):
        it.key("Ctrl+Z")
    assert not it.session.ratings
    it.settled()
    it.wait(lambda: lightness in it.words(), "the pin where it was")


def check_what_the_display_is_sent_is_what_the_probe_says(it):
    reading = it.window.probing.pins[0].readings[0]
    column, row = it.window.probing.pins[0].pixel
    session = it.session
    shown = displayed(reading.xyz, reading.white, it.frame.display, session.adaptation, session.exposure,
                      session.surround, reading.coverage)  # fmt: skip
    assert np.abs(np.array(shown.codes) - it.picture()[row, column]).max() <= 1


def check_all_is_unpinned_and_pinned_again_by_undo(it):
    it.click("Right/tabs/Pins/Unpin all")
    it.frames(2)
    assert not it.session.pins and not it.session.regions
    it.key("Ctrl+Z")
    it.key("Ctrl+Z")
    assert len(it.session.pins) == 2 and len(it.session.regions) == 1
