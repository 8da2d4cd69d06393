"""A catalogue of hundreds of materials: the list, its search, and the palette."""

import time

from imgui_bundle import imgui


def check_all_are_listed_and_frames_stay_short(it):
    it.settled()
    assert len(it.desk.choices.materials) == 304
    begun = time.process_time()
    it.frames(20)
    # CPU time: a list that draws all of its rows takes ten times as long.
    assert (time.process_time() - begun) / 20 < 0.5


def check_a_material_is_found_by_words_and_put_on(it):
    it.type("Left/##search", "red 277")
    it.frames(2)
    it.pick("red-277##many red-277")
    assert it.session.material_of("body") == "many/red-277"
    it.settled()


def check_the_palette_finds_it_too(it):
    it.key("Ctrl+Shift+P")
    it.frames(3)
    it.context.key_chars("material of b many red 123")
    it.frames(3)
    it.context.key_press(int(imgui.Key.enter))
    it.frames(3)
    assert it.session.other.material == "many/red-123"
