"""A spectral image: under lights and observers, probed, compared with another, zoomed."""

import numpy as np
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.gl.tile import read

SIZE = (920, 560)


def xyz(it, number=0):
    return it.on_gpu(lambda: read(it.frame.canvases[number]).astype(float))[..., :3]


def folded(it, light, who):
    return it.desk.loaded.image.folded(observer(who), illuminant(light)).values


def check_it_is_seen_in_d65_at_first(it):
    it.settled()
    assert it.session.light.lamps[0].name == "D65"
    np.testing.assert_allclose(xyz(it), folded(it, "D65", "1931_2"), rtol=1e-6)


def check_light_and_observer_are_switched(it):
    it.key("3")
    it.key("O")
    it.settled()
    np.testing.assert_allclose(xyz(it), folded(it, "A", "1964_10"), rtol=1e-6)
    it.key("2")


def check_it_is_probed(it):
    it.point(0.55, 0.5)
    it.settled()
    it.wait(lambda: it.window.probing.cursor is not None, "a spectrum")
    spot = it.window.probing.cursor
    column, row = spot.pixel
    (reading,) = spot.readings
    np.testing.assert_allclose(reading.spectra.reflectance, it.desk.loaded.image.spectrum(row, column))
    np.testing.assert_allclose(reading.xyz, xyz(it)[row, column], rtol=1e-5)
    np.testing.assert_allclose(it.window.read[0].xyz, reading.xyz, rtol=1e-5)


def check_two_lights_are_compared(it):
    it.key("Shift+3")
    it.key("D")
    it.settled()
    it.frames(3)
    assert it.window.statistics[0].mean > 0.0
    it.wait(lambda: len(it.window.probing.cursor.readings) == 2, "both sides")


def check_the_wheel_zooms_and_a_drag_moves_it(it):
    it.key("A")
    before = it.context.item_info("//Picture/picture").rect_full
    x, y = it.point(0.5, 0.5)
    pixel = it.window.pointer
    for _ in range(6):
        it.context.mouse_wheel_y(5.0)
    it.frames(3)
    after = it.context.item_info("//Picture/picture").rect_full
    assert after.max.x - after.min.x > before.max.x - before.min.x
    it.context.mouse_down(0)
    it.context.mouse_move_to_pos((x - 40, y - 10))
    it.context.mouse_up(0)
    it.frames(3)
    it.context.mouse_move_to_pos((x, y))
    it.frames(3)
    assert it.window.pointer is not None and pixel is not None


def check_what_asks_for_a_scene_is_refused_in_words(it):
    from dataclasses import replace

    it.desk.do(lambda session: replace(session, light=replace(session.light, lamps=(), booth="D65")), "Booth")
    it.frames(3)
    assert "no surfaces" in it.said
    it.key("Ctrl+Z")
    it.frames(3)
    for tab in ("Edit", "Metamerism", "Protocol", "Trust", "Pins"):
        it.tab(tab)
    assert not any("surface" in one for one in it.words())
    it.point(0.5, 0.5)
    it.key("P")
    assert "no surface to pin" in it.said
    it.desk.run("rate.approved")
    assert "an image has none" in it.said and not it.session.ratings
    it.desk.dialog = "picture.keep"
    it.frames(3)
    it.type("Dialog/##file", "kept")
    it.wait(lambda: "is a file already" in it.said, "why it is not kept")


def check_b_is_not_said_to_be_what_an_image_cannot_be(it):
    """A map of no differences would say that the reference is the same."""
    it.tab("Trust")
    for change in (lambda: it.desk.run("other.reference"), lambda: it.desk.do(other_catalogue, "Catalogue of B")):
        change()
        it.frames(3)
        assert "cannot be either" in it.said
        it.key("Ctrl+Z")
        it.frames(3)
        assert "cannot be either" not in it.said
    assert not it.context.item_exists("//Left/by the reference##made")


def other_catalogue(session):
    from dataclasses import replace

    return replace(session, other=replace(session.other, catalogue="elsewhere"))
