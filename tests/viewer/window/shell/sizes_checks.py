"""A window of one pixel and back, and text of twice the size, as displays of many pixels have it."""

import glfw
from imgui_bundle import imgui
from imgui_bundle.glfw_utils import glfw_window_hello_imgui
from metamer.viewer.window.shell.widgets import em

SIZE, SCALE = (760, 520), 2.0


def check_text_is_twice_as_large_and_the_picture_is_still_pixel_for_pixel(it):
    it.settled()
    assert imgui.get_style().font_scale_dpi == 2.0
    info = it.context.item_info("//Picture/picture").rect_full
    scale = imgui.get_io().display_framebuffer_scale.x
    size = round((info.max.x - info.min.x) * scale), round((info.max.y - info.min.y) * scale)
    assert size == it.window.size == it.frame.texture.size


def check_one_pixel_and_back(it):
    before = it.window.size
    resize(it, 1, 1)
    it.frames(6)
    assert it.window.size[0] < 2 or it.window.size[1] < 2 or max(it.window.size) <= before[0]
    resize(it, 300, 200)
    it.frames(6)
    it.settled()
    assert it.window.size[0] <= 300 and it.frame.texture.size == it.window.size
    resize(it, *SIZE)
    it.frames(6)
    it.settled()
    assert it.frame.texture.size == it.window.size


def resize(it, width, height):
    it.on_gpu(lambda: glfw.set_window_size(glfw_window_hello_imgui(), width, height))


def check_what_is_written_has_all_its_glyphs(it):
    """Words of commands, of notices and of panels; nothing else is shown but names that people give."""
    font = it.on_gpu(lambda: imgui.get_font())
    words = "".join(one.words + one.group + "".join(one.keys) for one in it.desk.commands)
    panels = "ΔE λ ° ² · “ ” ’ × – — … ñ é"
    missing = sorted({letter for letter in words + panels if not font.is_glyph_in_font(ord(letter))})
    assert not missing and em(1.0) > 20


def check_a_dialog_that_is_taller_than_the_window_is_scrolled(it):
    it.key("?")
    it.frames(3)
    dialog = it.context.window_info("//Dialog").window
    assert dialog.pos.y + dialog.size.y <= imgui.get_main_viewport().size.y
    it.click("Dialog/Close")
    it.frames(2)
    assert it.desk.dialog is None
